//! Prior for a person and for the changes in the operator.

use super::{
    basis::Point,
    detector::DetectorSettings,
    mixture::ChangePrior,
    sizes::{DYNAMICS_COUNT, START_COUNT},
};

/// Longest delay in s.
pub(super) const LONGEST_DELAY_S: f64 = 0.9;

/// Prior of the delay of a further input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DelayPrior {
    /// Delay in s, for an input that is interpolated linearly between samples.
    pub tau: f64,
    /// Standard deviation in s.
    pub deviation: f64,
    /// Delays of the starting points in s.
    pub starts: [f64; START_COUNT],
}

impl DelayPrior {
    /// True if both numbers are valid.
    pub(super) fn is_valid(&self) -> bool {
        let longest = |tau: &f64| (0.0..=LONGEST_DELAY_S).contains(tau);
        longest(&self.tau) && self.starts.iter().all(longest) && self.deviation > 0.0 && self.deviation.is_finite()
    }
}

/// Prior for a person and for the changes in the operator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptivePrior {
    /// Delay, natural frequency, damping and lag of the person, the point at which the basis starts.
    pub person: Point,
    /// Prior standard deviations of omega and zeta (relative) and of the delay (in s).
    pub spread: [f64; DYNAMICS_COUNT],
    /// Sample time Ts in s.
    pub sample_time: f64,
    /// Order of the noise model.
    pub order: usize,
    /// Memory of the noise model in s.
    pub noise_memory: f64,
    /// Time in s after which the estimate starts. The ratio of the magnitudes of u and e over this time sets the scale
    /// of the prior of the gains.
    pub hold: f64,
    /// Prior of the changes in the operator.
    pub changes: ChangePrior,
    /// Starting points of the first estimate; each has the lag of the person.
    pub starts: [Point; START_COUNT],
    /// Settings of the change detector.
    pub detection: DetectorSettings,
}

impl AdaptivePrior {
    /// True if all numbers are valid.
    pub(super) fn is_valid(&self) -> bool {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        [self.sample_time, self.hold].into_iter().all(positive)
            && self.spread.into_iter().all(positive)
            && self.changes.is_valid()
    }
}
