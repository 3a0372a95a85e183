//! What an earlier fit of the person left: the recursion starts there, with its covariance.
//!
//! Gains and corrections start at the estimate of the fit with its covariance, and are followed from the
//! first sample on. The noise model starts with the products that a span with the remnant of the fit would
//! have left, so that the first seconds do not have to find it.

use super::{
    noise::{Lags, NoiseModel},
    sizes::{GAINS, STATES},
};

/// An estimate that is there before the first sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InitialEstimate {
    /// Gains, level, and corrections of the basis.
    pub state: [f64; STATES],
    /// Their covariance.
    pub covariance: [[f64; STATES]; STATES],
    /// Variance of eps.
    pub variance: f64,
    /// |Y| at the reference.
    pub unit: f64,
    /// Remnant of the fit, where there is one: its autocovariances over the variance of eps, from lag
    /// zero on, and the seconds that they count for.
    pub remnant: Option<(Lags, f64)>,
}

impl InitialEstimate {
    /// True for numbers that are valid.
    pub(super) fn is_sound(&self) -> bool {
        let finite = |x: &f64| x.is_finite();
        self.state.iter().all(finite)
            && self.covariance.iter().flatten().all(finite)
            && (0..STATES).all(|i| self.covariance[i][i] >= 0.0)
            && self.covariance[GAINS][GAINS] > 0.0
            && self.variance > 0.0
            && self.unit > 0.0
            && self.variance.is_finite()
            && self.unit.is_finite()
    }

    /// Puts the remnant into a noise model; false for numbers that are not valid.
    pub(super) fn apply_to_noise(&self, noise: &mut NoiseModel, sample_time: f64) -> bool {
        match &self.remnant {
            Some((lags, seconds)) => noise.set_prior(lags, self.variance, seconds / sample_time),
            None => true,
        }
    }
}
