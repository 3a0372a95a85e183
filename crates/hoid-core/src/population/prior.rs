//! What is supposed of a person and their changes.

use super::{basis::Point, detector::Detection, gains::GainPrior, sizes::RIVALS};

/// What is supposed of a person and their changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PopulationPrior {
    /// Drifts, outliers and weights.
    pub gains: GainPrior,
    /// Order of the noise model.
    pub order: usize,
    /// Its memory, s.
    pub noise_memory: f64,
    /// Time constants of the variance of eps for the gains and for the detector, s.
    pub level_memory: [f64; 2],
    /// Drifts of the level of u in one second, over the root mean square of u: of the filter whose
    /// gains hardly move, and of the others.
    pub offset_drift: [f64; 2],
    /// Time after which the estimate begins, s: the ratio of u to e in it gives the prior of the
    /// gains.
    pub hold: f64,
    /// Time after which what is held is corrected, s. What was learnt before counts no more than the
    /// prior then: the noise model was not known.
    pub reopen: f64,
    /// What a declared change adds to the gains, over |Y| at the reference.
    pub jump: f64,
    /// Where else somebody may begin; their lags are those of the basis.
    pub rivals: [Point; RIVALS],
    /// The detector.
    pub detection: Detection,
}

impl PopulationPrior {
    /// True for numbers that make sense.
    pub(super) fn is_sound(&self) -> bool {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        self.level_memory.iter().all(|m| positive(*m))
            && positive(self.hold)
            && self.reopen >= self.hold
            && self.offset_drift.iter().all(|d| *d >= 0.0)
            && self.jump >= 0.0
    }
}
