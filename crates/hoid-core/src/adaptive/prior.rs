//! The prior of a person and of the changes of the operator.

use super::{
    basis::Point,
    detector::Detection,
    mixture::ChangePrior,
    sizes::{DYNAMICS, STARTS},
};

/// The prior of a person and of the changes of the operator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptivePrior {
    /// Point of the basis, and its prior standard deviations: relative for omega and zeta, in s for the delay.
    pub person: Point,
    /// Prior standard deviations; see `person`.
    pub spread: [f64; DYNAMICS],
    /// Ts, s.
    pub sample_time: f64,
    /// Order of the noise model.
    pub order: usize,
    /// Its memory, s.
    pub noise_memory: f64,
    /// Time after which the estimate starts, s: the ratio of u to e in it gives the prior of the gains.
    pub hold: f64,
    /// Prior of the changes of the operator.
    pub changes: ChangePrior,
    /// Starting points of the first estimate; their lags are that of the person.
    pub starts: [Point; STARTS],
    /// The detector.
    pub detection: Detection,
}

impl AdaptivePrior {
    /// True for valid numbers.
    pub(super) fn is_sound(&self) -> bool {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        [self.sample_time, self.hold].into_iter().all(positive)
            && self.spread.into_iter().all(positive)
            && self.changes.is_sound()
    }
}
