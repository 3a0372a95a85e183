//! What is supposed of the gains, for all filters.

use crate::population::{
    basis::Point,
    sizes::{DRIFTS, HELD},
};

/// What all filters share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainPrior {
    /// Standard deviation of a gain's drift in one second, over |Y| at the reference.
    pub drifts: [f64; DRIFTS],
    /// What is supposed of their weights.
    pub shares: [f64; DRIFTS],
    /// The newborns: drift in one second and added standard deviation, over |Y| at the reference.
    pub newborn: [f64; 2],
    /// Their weight at birth, over that of the first filter.
    pub odds: f64,
    /// Births that these odds are worth, against those of this person.
    pub births: f64,
    /// Their life, s.
    pub life: f64,
    /// Time in which the gains do not walk once what is held is corrected, s.
    pub steady: f64,
    /// Degrees of freedom of the Student distribution.
    pub freedom: f64,
    /// Standard deviations beyond which an innovation moves the estimate no further.
    pub limit: f64,
    /// Shares of the logarithms of the weights that a sample forgets, among forms and drifts.
    pub forgotten: [f64; 2],
    /// Standard deviations of omega and zeta, as shares of theirs, and of tau, s.
    pub held: [f64; HELD],
    /// Sample time, s.
    pub sample_time: f64,
}

impl GainPrior {
    /// Standard deviations of what is held, in its units.
    pub(super) fn held_at(&self, point: Point) -> [f64; HELD] {
        let [omega, zeta, tau] = self.held;
        [omega * point.omega, zeta * point.zeta, tau]
    }

    pub(super) fn is_sound(&self) -> bool {
        let sizes = self.drifts.iter().chain(&self.newborn).chain(&self.held);
        sizes.into_iter().all(|d| *d >= 0.0)
            && self.shares.iter().all(|s| *s > 0.0 && *s <= 1.0)
            && self.odds > 0.0
            && self.births > 0.0
            && self.life > 0.0
            && self.steady >= 0.0
            && self.freedom > 0.0
            && self.limit > 0.0
            && self.sample_time > 0.0
            && self.forgotten.iter().all(|f| (0.0..=1.0).contains(f))
    }
}
