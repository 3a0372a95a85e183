//! Validation of a model with a record.
//!
//! - `VAF = max(0, 1 - sum (u - u^)^2 / sum u^2) 100 %` (eq. 39): no mean is removed;
//! - `NRMSE fit = (1 - |u - u^| / |u - mean u|) 100 %`: the mean is removed, and the result may be negative (the "fit
//!   percent" of most programs);
//! - residual autocorrelation `r_eps(k) / r_eps(0)` with the bounds `+- z / sqrt n` for white residuals;
//! - cross-correlation of residuals and input, `r_eps,e(k) / sqrt(r_eps(0) r_e(0))`, with the bounds
//!   `+- z sqrt( (1/n) sum_k rho_eps(k) rho_e(k) )`, which are valid even if the residuals are not white (Ljung,
//!   *System Identification*, 1999, eq. 16.56). At nonnegative lags it shows dynamics that the model lacks; at negative
//!   lags (the residual leads the input) it shows feedback, which is always present in a closed loop;
//! - whiteness test by `Q = n (n + 2) sum_k r_k^2/(n - k)`, which is chi-square distributed for white residuals (G. M.
//!   Ljung and G. E. P. Box, *Biometrika* 65 (1978) 297-303).
//!
//! | module | contents |
//! |---|---|
//! | `comparison` | comparison of a model with a record |
//! | `goodness_of_fit` | VAF and NRMSE |
//! | `correlation` | correlations with their bounds |
//! | `whiteness` | Ljung-Box test |

mod comparison;
mod correlation;
mod goodness_of_fit;
mod whiteness;

pub use comparison::{MAX_OUTSIDE_SHARE, ResidualDiagnostics, Validation};
pub use correlation::Correlation;
pub use goodness_of_fit::{GoodnessOfFit, nrmse_fit, vaf};
pub use whiteness::{LjungBox, MAX_LAG, whiteness};
