//! Loss function for residuals: quadratic, or robust against outliers.
//!
//! Huber's loss of a residual r in units of the scale s is `rho(r) = r^2/2` for `|r| <= k` and `k |r| - k^2/2` beyond
//! (P. J. Huber, *Robust Statistics*, 1981, section 7.8).

/// Loss function for residuals.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Loss {
    /// Quadratic loss.
    #[default]
    Quadratic,
    /// Huber's loss: quadratic up to `threshold` times the scale of the residuals, linear beyond. A threshold of 1.345
    /// has an efficiency of 95 % for Gaussian noise.
    Huber {
        /// Threshold k in units of the scale of the residuals.
        threshold: f64,
    },
}
