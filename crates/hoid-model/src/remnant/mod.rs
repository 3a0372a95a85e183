//! The remnant filter `K_n / (T_n s + 1)^m`, m = 1..4: its discretisations, its monic noise model, and the retrieval of
//! T_n and K_n from a noise model (B.11-B.16).
//!
//! **Zero-order hold** (exact for white noise that is drawn once per sample, as in the simulator). With `a = Ts/T_n`
//! and `alpha = e^-a`
//!
//! `H(z) = K_n (n_1 z^-1 + ... + n_m z^-m) / (1 - alpha z^-1)^m`,
//! `n_j = a^m  integral over [j-1, j] of e^{-a t} B_m(t) dt`,
//!
//! where B_m is the cardinal B-spline of order m: the numerator samples an exponential spline (Unser and Blu, IEEE
//! Trans. Signal Processing 53, 2005). All n_j are integrals of positive functions, so no digits cancel, however fine
//! the sampling. As a tends to 0, the zeros tend to the Euler-Frobenius zeros (m = 2: -1; m = 3: -3.73, -0.27; m = 4:
//! -9.90, -1, -0.10).
//!
//! **Backward Euler** (B.11): `H(z) = K_n (1 - alpha)^m / (1 - alpha z^-1)^m` with
//! `alpha = T_n/(T_n + Ts)`.
//!
//! **Noise model.** The noise model has the same spectrum, in the form `C/D eps'` with C and D monic and stable: the
//! delay is dropped, numerator zeros zeta outside the unit circle are reflected, and the standard deviation of eps' is
//! `sigma' = K_n |n_1| prod over |zeta| > 1 of |zeta|`.
//!
//! **Retrieval.** Each coefficient `d_i = (-1)^i binom(m, i) alpha^i` of an estimated D gives an alpha and thus a time
//! constant; T_n is the mean of these time constants (eq. 16, B.14). K_n is sigma' divided by the value of sigma' for
//! the filter with this T_n and K_n = 1 (backward Euler: B.16). C is not used: if D was estimated without a C, m >= 2
//! and the true filter is the zero-order hold, D absorbs the missing C and T_n is biased.

mod discretisation;
mod filter;
mod retrieval;
mod zoh_numerator;

pub use discretisation::RemnantDiscretisation;
pub(crate) use discretisation::denominator;
pub use filter::{NoiseModel, RemnantFilter};
pub use retrieval::{RetrievedRemnant, retrieval_jacobian, retrieve};
pub(crate) use zoh_numerator::FactoredNumerator;
pub use zoh_numerator::HIGHEST_ORDER;

#[cfg(test)]
mod tests;
