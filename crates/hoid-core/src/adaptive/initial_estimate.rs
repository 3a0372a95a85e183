//! Initial estimate from an earlier fit of the person, with its covariance.
//!
//! Gains and corrections start at the fitted values with their covariance and are updated from the first sample. The
//! noise model starts as if it had already been estimated from the remnant of the fit, so it need not be estimated in
//! the first seconds.

use super::{
    noise::{Lags, NoiseModel},
    sizes::{GAIN_COUNT, STATE_COUNT},
};

/// Estimate before the first sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InitialEstimate {
    /// Gains, level, and corrections of the basis point.
    pub state: [f64; STATE_COUNT],
    /// Covariance of the state.
    pub covariance: [[f64; STATE_COUNT]; STATE_COUNT],
    /// Innovation variance.
    pub variance: f64,
    /// |Y| at the reference frequency.
    pub unit: f64,
    /// Remnant of the fit, if known: its autocovariances from lag zero, relative to the innovation variance, and the
    /// duration in s of the data that they represent.
    pub remnant: Option<(Lags, f64)>,
}

impl InitialEstimate {
    /// True if all numbers are valid.
    pub(super) fn is_valid(&self) -> bool {
        let finite = |x: &f64| x.is_finite();
        self.state.iter().all(finite)
            && self.covariance.iter().flatten().all(finite)
            && (0..STATE_COUNT).all(|i| self.covariance[i][i] >= 0.0)
            && self.covariance[GAIN_COUNT][GAIN_COUNT] > 0.0
            && self.variance > 0.0
            && self.unit > 0.0
            && self.variance.is_finite()
            && self.unit.is_finite()
    }

    /// Initialises a noise model with the remnant of the fit, if known; returns false if its numbers are not valid.
    pub(super) fn apply_to_noise(&self, noise: &mut NoiseModel, sample_time: f64) -> bool {
        match &self.remnant {
            Some((lags, seconds)) => noise.set_prior(lags, self.variance, seconds / sample_time),
            None => true,
        }
    }
}
