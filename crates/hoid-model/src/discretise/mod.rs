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
//! | matched | poles and zeros are mapped by `z = e^{s Ts}` |
//!
//! **First-order hold.** `H(z) = (z - 1)^2 / (Ts z) Z{H(s)/s^2}` (Franklin, Powell, Workman,
//! *Digital Control of Dynamic Systems*, 3rd ed., 1998, section 6.3.2). The formula printed in
//! Table 5.2, `(z - 1)^2/Ts^2 Z{H/s^2}`, lacks a factor Ts/z.
//!
//! **Holds.** With `p = s/alpha`, where alpha is the larger of 1/Ts and the magnitude of the largest pole, the entries
//! of the controllable canonical form are of order one. The exponential of its matrix, extended by the input and the
//! slope of the input, gives `Phi`, `Gamma_1`, `Gamma_2` (Van Loan 1978). These matrices are converted back to
//! polynomials by the Faddeev-LeVerrier recursion on `Phi - I`, in powers of `delta = z - 1`, and a Taylor shift. In
//! powers of z, the coefficients of a finely sampled system are small differences between multiples of binomial
//! coefficients; in powers of delta there is no such cancellation, so numerators of size `(Ts/T)^n / n!` keep their
//! digits. Both holds accept any delay: the fraction of a sample shifts the instant at which the output is read (the
//! modified z-transform, Jury 1964).
//!
//! **Matched.** Of the r zeros at infinity, r - 1 are mapped to z = -1 and one remains at infinity, which gives a delay
//! of one sample. This is the modified matched method of Franklin, Powell and Workman (section 6.2) and of MATLAB's
//! `c2d(..., 'matched')`. The gain makes the continuous and discrete responses equal at s = 0. If there are k poles (or
//! zeros) at s = 0, `s^k H(s)` and `((z - 1)/Ts)^k H(z)` are equal in the limit of small real s, which preserves the
//! velocity or acceleration constant. With or without roots at s = 0, the gain follows from the products of
//! `p / (e^{p Ts} - 1)` over the poles and over the zeros; a factor with p = 0 is 1/Ts.

mod hold;
mod matched;
mod methods;

pub use methods::{Method, discretise};

#[cfg(test)]
mod tests;
