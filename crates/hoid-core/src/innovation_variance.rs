//! The variance of the innovations, with an exponential memory.
//!
//! `sigma^2 = sum_k lambda^{t-k} s_k/sum_k lambda^{t-k}`. Here s_k is the square of an innovation
//! over its variance in units of sigma^2, so that the expectation of each s_k is sigma^2.

/// The weighted mean of the s_k; the sum of the weights is the number of residuals from which it is estimated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InnovationVariance {
    sum: f64,
    residuals: f64,
    lambda: f64,
}

crate::state!([] InnovationVariance { sum, residuals, lambda });

impl InnovationVariance {
    /// Starts from a variance that was estimated from this number of residuals; 0 starts without prior knowledge.
    /// `lambda` is the factor of forgetting.
    pub fn new(variance: f64, residuals: f64, lambda: f64) -> Self {
        Self {
            sum: variance * residuals,
            residuals,
            lambda,
        }
    }

    /// Updates the variance by s_k, the square of an innovation over its variance in units of sigma^2.
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
    pub fn residuals(&self) -> f64 {
        self.residuals
    }

    /// True if an innovation is beyond `limit` standard deviations. While sigma is unknown there is no limit.
    #[inline(always)]
    pub(crate) fn is_beyond(&self, eps: f64, limit: f64) -> bool {
        // Without a square root, which few innovations need.
        self.sum > 0.0 && eps * eps * self.residuals > limit * limit * self.sum
    }

    /// Keeps the variance, but limits the number of residuals: the next ones have more weight.
    pub fn limit_residuals(&mut self, residuals: f64) {
        if self.residuals > residuals && residuals > 0.0 {
            self.sum *= residuals / self.residuals;
            self.residuals = residuals;
        }
    }
}
