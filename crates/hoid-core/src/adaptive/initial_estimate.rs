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
pub struct InitialEstimate<const I: usize = 1, const S: usize = STATE_COUNT> {
    /// Gains, level, and corrections of the basis points.
    pub state: [f64; S],
    /// Covariance of the state.
    pub covariance: [[f64; S]; S],
    /// Innovation variance.
    pub variance: f64,
    /// Magnitude of the response to each input at the reference frequency.
    pub units: [f64; I],
    /// Remnant of the fit, if known: its autocovariances from lag zero, relative to the innovation variance, and the
    /// duration in s of the data that they represent.
    pub remnant: Option<(Lags, f64)>,
}

impl<const I: usize, const S: usize> InitialEstimate<I, S> {
    /// True if all numbers are valid.
    pub(super) fn is_valid(&self) -> bool {
        let finite = |x: &f64| x.is_finite();
        self.state.iter().all(finite)
            && self.covariance.iter().flatten().all(finite)
            && (0..S).all(|i| self.covariance[i][i] >= 0.0)
            && self.covariance[GAIN_COUNT][GAIN_COUNT] > 0.0
            && self.variance > 0.0
            && self.variance.is_finite()
            && self.units.iter().all(|unit| *unit > 0.0 && unit.is_finite())
    }

    /// Initialises a noise model with the remnant of the fit, if known; returns false if its numbers are not valid.
    pub(super) fn apply_to_noise(&self, noise: &mut NoiseModel, sample_time: f64) -> bool {
        match &self.remnant {
            Some((lags, seconds)) => noise.set_prior(lags, self.variance, seconds / sample_time),
            None => true,
        }
    }
}
