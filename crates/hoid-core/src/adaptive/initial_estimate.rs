//! An initial estimate from an earlier fit of the person: the recursion starts at it, with its covariance.
//!
//! Gains and corrections start at the fitted values with their covariance and are updated from the first sample on. The
//! noise model starts with the products of a span with the remnant of the fit, so that it need not be estimated in the
//! first seconds.

use super::{
    noise::{Lags, NoiseModel},
    sizes::{GAINS, STATES},
};

/// An estimate before the first sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InitialEstimate {
    /// Gains, level, and corrections of the basis.
    pub state: [f64; STATES],
    /// Their covariance.
    pub covariance: [[f64; STATES]; STATES],
    /// Variance of eps.
    pub variance: f64,
    /// |Y| at the reference frequency.
    pub unit: f64,
    /// Remnant of the fit, if there is one: its autocovariances relative to the variance of eps, from lag zero on, and
    /// the time that they count as, s.
    pub remnant: Option<(Lags, f64)>,
}

impl InitialEstimate {
    /// True for valid numbers.
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

    /// Sets a noise model to the remnant; false for invalid numbers.
    pub(super) fn apply_to_noise(&self, noise: &mut NoiseModel, sample_time: f64) -> bool {
        match &self.remnant {
            Some((lags, seconds)) => noise.set_prior(lags, self.variance, seconds / sample_time),
            None => true,
        }
    }
}
