//! Variance of the innovations, estimated with an exponential memory.
//!
//! `sigma^2 = sum_k lambda^{t-k} s_k/sum_k lambda^{t-k}`. Here s_k is the square of an innovation divided by the ratio
//! of its variance to sigma^2, so each s_k has the expected value sigma^2.

/// Weighted mean of the s_k. The sum of the weights is the number of residuals from which the variance is estimated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InnovationVariance {
    sum: f64,
    residuals: f64,
    lambda: f64,
}

crate::state!([] InnovationVariance { sum, residuals, lambda });

impl InnovationVariance {
    /// Starts from a variance that was estimated from the given number of residuals; zero residuals mean no prior
    /// knowledge. `lambda` is the forgetting factor.
    pub fn new(variance: f64, residuals: f64, lambda: f64) -> Self {
        Self {
            sum: variance * residuals,
            residuals,
            lambda,
        }
    }

    /// Updates the variance with s_k, the square of an innovation divided by the ratio of its variance to sigma^2.
    #[inline(always)]
    pub fn update(&mut self, squared: f64) {
        self.sum = self.lambda * self.sum + squared;
        self.residuals = self.lambda * self.residuals + 1.0;
    }

    /// Returns the variance; zero before the first update.
    #[inline(always)]
    pub fn variance(&self) -> f64 {
        if self.residuals > 0.0 {
            self.sum / self.residuals
        } else {
            0.0
        }
    }

    /// Returns the number of residuals from which the variance is estimated.
    #[inline(always)]
    pub fn residual_count(&self) -> f64 {
        self.residuals
    }

    /// True if an innovation exceeds `limit` standard deviations; false as long as sigma is unknown.
    #[inline(always)]
    pub(crate) fn is_beyond(&self, eps: f64, limit: f64) -> bool {
        // Comparing squares avoids a square root, which is needed for few innovations only.
        self.sum > 0.0 && eps * eps * self.residuals > limit * limit * self.sum
    }

    /// Limits the number of residuals from which the variance counts as estimated, without changing the variance: the
    /// next residuals then have more weight.
    pub fn limit_residual_count(&mut self, residuals: f64) {
        if self.residuals > residuals && residuals > 0.0 {
            self.sum *= residuals / self.residuals;
            self.residuals = residuals;
        }
    }
}
