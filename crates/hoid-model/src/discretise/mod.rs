//! Discretisation of general transfer functions (Table 5.2 of the thesis).
//!
//! | method | rule |
//! |---|---|
//! | forward Euler | `s = (z - 1)/Ts` |
//! | backward Euler | `s = (z - 1)/(Ts z)` |
//! | Tustin | `s = (2/Ts) (z - 1)/(z + 1)` |
//! | Tustin prewarped | `s = omega_p / tan(omega_p Ts/2) (z - 1)/(z + 1)`: exact at `omega_p` |
//! | zero-order hold | exact for an input that is constant over each sample |
//! | first-order hold | exact for an input that is linear over each sample (the triangle hold) |
//! | matched | poles and zeros by `z = e^{s Ts}` |
//!
//! **First-order hold.** `H(z) = (z - 1)^2 / (Ts z) Z{H(s)/s^2}` (Franklin, Powell, Workman,
//! *Digital Control of Dynamic Systems*, 3rd ed., 1998, section 6.3.2). The formula printed in
//! Table 5.2, `(z - 1)^2/Ts^2 Z{H/s^2}`, lacks a factor Ts/z.
//!
//! **Holds.** With `p = s/alpha`, alpha the larger of 1/Ts and the magnitude of the poles, the
//! controllable canonical form has entries of order one. The exponential of its matrix extended by
//! input and input slope gives `Phi`, `Gamma_1`, `Gamma_2` (Van Loan 1978). They are converted back to polynomials by
//! the Faddeev-LeVerrier recursion on `Phi - I`, in powers of `delta = z - 1`, and a Taylor shift: in powers of z the
//! coefficients of a finely sampled system are differences of binomials, in powers of delta they are not, so that
//! numerators of size `(Ts/T)^n / n!` keep their digits. Both holds accept any delay: the remainder of whole samples
//! moves the instant at which the output is read (the modified z-transform, Jury 1964).
//!
//! **Matched.** Of the r zeros at infinity r - 1 go to z = -1 and one stays at infinity, which
//! leaves one sample of delay: the modified matched method of Franklin, Powell and Workman (section
//! 6.2) and of MATLAB's `c2d(..., 'matched')`. The gain makes both responses equal at s = 0; with k
//! poles (or zeros) there, `s^k H(s)` and `((z - 1)/Ts)^k H(z)` are equal in the limit of small
//! real s, so that the velocity or acceleration constant is kept. Both cases are given by the same product over poles
//! and zeros `p / (e^{p Ts} - 1)`, which is 1/Ts at p = 0.

mod hold;
mod matched;
mod methods;

pub use methods::{Method, discretise};

#[cfg(test)]
mod tests;
