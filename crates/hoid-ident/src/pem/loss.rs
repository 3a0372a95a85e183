//! How a residual counts: by its square, or so that outliers do not dominate.
//!
//! Huber's loss of a residual in units of the scale s is `rho(r) = r^2/2` for `|r| <= k` and
//! `k |r| - k^2/2` beyond (P. J. Huber, *Robust Statistics*, 1981, section 7.8).

/// How a residual counts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Loss {
    /// By its square.
    #[default]
    Quadratic,
    /// By its square up to `threshold` times the scale of the residuals, linearly beyond (Huber).
    /// 1.345 keeps 95 % of the efficiency where the noise is Gaussian after all.
    Huber {
        /// Threshold k in units of the scale.
        threshold: f64,
    },
}
