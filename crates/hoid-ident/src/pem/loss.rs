//! Loss of a residual: quadratic, or robust against outliers.
//!
//! Huber's loss of a residual in units of the scale s is `rho(r) = r^2/2` for `|r| <= k` and
//! `k |r| - k^2/2` beyond (P. J. Huber, *Robust Statistics*, 1981, section 7.8).

/// Loss of a residual.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Loss {
    /// Quadratic.
    #[default]
    Quadratic,
    /// Quadratic up to `threshold` times the scale of the residuals, linear beyond (Huber). 1.345 keeps 95 % of the
    /// efficiency for Gaussian noise.
    Huber {
        /// Threshold k in units of the scale.
        threshold: f64,
    },
}
