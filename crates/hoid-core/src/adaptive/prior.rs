//! What is supposed of a person and their changes.

use super::{
    basis::Point,
    detector::Detection,
    mixture::ChangePrior,
    sizes::{DYNAMICS, STARTS},
};

/// What is supposed of a person and their changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptivePrior {
    /// What is held of the person, and how far they may be from it: shares of omega and zeta, and s for
    /// the delay.
    pub person: Point,
    /// See `person`.
    pub spread: [f64; DYNAMICS],
    /// Ts, s.
    pub sample_time: f64,
    /// Order of the noise model.
    pub order: usize,
    /// Its memory, s.
    pub noise_memory: f64,
    /// Time after which the estimate starts, s: the ratio of u to e in it gives the prior of the gains.
    pub hold: f64,
    /// How the operator changes.
    pub changes: ChangePrior,
    /// Where estimates start when there are data for the first time; their lags are that of the person.
    pub starts: [Point; STARTS],
    /// The detector.
    pub detection: Detection,
}

impl AdaptivePrior {
    /// True for numbers that are valid.
    pub(super) fn is_sound(&self) -> bool {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        [self.sample_time, self.hold].into_iter().all(positive)
            && self.spread.into_iter().all(positive)
            && self.changes.is_sound()
    }
}
