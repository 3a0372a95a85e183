//! Detector of changes of the operator: a Wald test of the last few seconds against the time before, over blocks of
//! half a second (`blocks`).
//!
//! Least squares over the last blocks and over the earlier blocks, with gains, natural frequency, damping, delay and
//! level free in both, give a difference d with the covariance C of the scores (`contrast`). For gains, natural
//! frequency, damping and delay, but not for the level,
//!
//! `T = d' C^-1 d`
//!
//! is chi-square with `nu = 6` degrees of freedom without a change (G. C. Chow, *Econometrica* 28 (1960) 591-605). It is
//! computed for a short and for a long present: small changes need more data than large ones. One second between past and
//! present is left out, since a change need not be at the border of a block.
//!
//! **Normalisation.** Operators vary to different degrees. T is therefore divided by the root of its level c without a
//! change, from the mean of `ln T`, whose expectation for a chi-square is `ln 2 + psi(nu/2)`; c is at least one, and its
//! prior counts as half a minute of blocks. The statistic is reported as its log significance in nats, with `x = T/2 sqrt c`
//!
//! `-ln P(chi^2 > 2x) = x - ln (1 + x + .. + x^(nu/2-1)/(nu/2-1)!)`
//!
//! (M. Abramowitz and I. A. Stegun, 1964, eq. 6.3.3, 6.3.4, 26.4.5).
//!
//! **Declaration.** A change is declared if one of the statistics exceeds the threshold. Its time is the border of blocks
//! with the least residual sum of squares when all parameters are free before and after it (R. E. Quandt, *J. American
//! Statistical Association* 53 (1958) 873-880).
//!
//! The blocks belong to the live candidate (`last_blocks`), with its noise model and basis. From three seconds
//! after a gap on, the time after it is compared with the time before it.

use super::{
    blocks::Block,
    contrast::{Contrast, EMPIRICAL_SHARE, MODEL_ONLY},
    difference::Difference,
    last_blocks::{BLOCK_S, BLOCKS, LastBlocks},
    sizes::{DYNAMICS, GAINS, LINEAR},
};

/// Expectation of the logarithm of a chi-square with one pair of degrees of freedom, `ln 2 - gamma`.
const MEAN_LOG: f64 = 0.115_931_515_658_412_45;
/// Number of parameters that are tested: gains and dynamics.
const OPERATOR: usize = GAINS + DYNAMICS;
/// Their indices in the state: all except the level.
const OPERATOR_STATES: [usize; OPERATOR] = [0, 1, 2, LINEAR, LINEAR + 1, LINEAR + 2];
/// Pairs of degrees of freedom.
const PAIRS: u32 = OPERATOR as u32 / 2;
/// Blocks between past and present.
const GUARD_BLOCKS: usize = 2;
/// Least number of blocks of a present after a gap.
const LEAST_AFTER_GAP: usize = 4;
/// Number of blocks that the prior of the level, that of a chi-square, counts as.
const PRIOR_BLOCKS: f64 = 60.0;
/// Largest number of blocks in the mean of the level.
const LEVEL_MEMORY: f64 = 240.0;
/// Largest contribution of one logarithm to the level: a change must not count as variation.
const LARGEST_LOG_STEP: f64 = 3.0;

/// Settings of the detector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Number of blocks of the short and of the long present.
    pub recent: [usize; 2],
    /// Least number of blocks of the past.
    pub least: usize,
    /// Largest number of blocks of the past.
    pub most: usize,
    /// Log significance at which a change is declared, nats.
    pub threshold: f64,
    /// Prior standard deviations of the dynamics, in their units.
    pub dynamics: [f64; DYNAMICS],
    /// Number of blocks after a declared change in which no other is declared.
    pub refractory: u64,
}

/// A statistic and its level without a change.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Statistic {
    level: f64,
    levels: f64,
    log_significance: f64,
}

crate::state!([] Statistic { level, levels, log_significance });

impl Statistic {
    fn new() -> Self {
        Self {
            level: mean_log(PAIRS),
            levels: PRIOR_BLOCKS,
            log_significance: 0.0,
        }
    }

    /// Ratio of the statistic to a chi-square so far, at least one.
    fn scale(&self) -> f64 {
        libm::exp(self.level - mean_log(PAIRS)).max(1.0)
    }

    fn take(&mut self, t: f64) {
        // The test uses the level before this block, so that a change does not reduce its own significance.
        self.log_significance = log_significance(t / libm::sqrt(self.scale()), PAIRS);
        self.levels = (self.levels + 1.0).min(PRIOR_BLOCKS + LEVEL_MEMORY);
        let log = libm::log(t.max(0.05)).min(self.level + LARGEST_LOG_STEP);
        self.level += (log - self.level) / self.levels;
    }
}

/// Expectation of the logarithm of a chi-square with a given number of pairs of degrees of freedom.
fn mean_log(pairs: u32) -> f64 {
    MEAN_LOG + (1..pairs).map(|k| 1.0 / f64::from(k)).sum::<f64>()
}

/// `-ln P(chi^2 > x)` for a chi-square with a given number of pairs of degrees of freedom.
fn log_significance(x: f64, pairs: u32) -> f64 {
    let half = 0.5 * x;
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..pairs {
        term *= half / f64::from(k);
        sum += term;
    }
    half - libm::log(sum)
}

/// The detector.
#[derive(Debug, Clone, PartialEq)]
pub struct Detector {
    settings: Detection,
    /// For the short and for the long present.
    statistics: [Statistic; 2],
    /// Blocks since the last change was declared.
    since: u64,
    declared: bool,
    declared_contrast: Contrast,
    innovation_variances: [f64; 2],
    difference: Difference,
    ago: usize,
}

crate::state!([] Detector { statistics, since, declared, declared_contrast, innovation_variances, difference, ago });

impl Detector {
    /// Builds the detector before the first block. `None` if the capacity for blocks is too small.
    pub fn new(settings: Detection) -> Option<Self> {
        let [short, long] = settings.recent;
        let present = short > 0 && short <= long;
        let room = present && settings.least > 0 && settings.least <= settings.most && long + settings.most <= BLOCKS;
        let sound = settings.dynamics.iter().all(|d| *d > 0.0 && d.is_finite());
        (room && sound).then_some(Self {
            settings,
            statistics: [Statistic::new(); 2],
            since: u64::MAX >> 12,
            declared: false,
            declared_contrast: Contrast::default(),
            innovation_variances: [0.0; 2],
            difference: Difference::default(),
            ago: 0,
        })
    }

    /// Tests blocks of which the last is new. `dynamics` are the current corrections, relative to the basis of the
    /// blocks.
    pub(super) fn test(&mut self, last: &LastBlocks, dynamics: [f64; DYNAMICS]) {
        self.declared = false;
        self.since += 1;
        // Blocks before the last declared change belong to another operator and are not used.
        let known = last
            .all()
            .len()
            .min(usize::try_from(self.since).unwrap_or(BLOCKS) + self.ago);
        let blocks = &last.all()[last.all().len() - known..];
        for present in 0..self.statistics.len() {
            match self.wald_statistic(blocks, last.fresh(), dynamics, present) {
                Some(t) => self.statistics[present].take(t),
                None => self.statistics[present].log_significance = 0.0,
            }
        }
        if self.log_significance() > self.settings.threshold && self.since > self.settings.refractory {
            self.declared = true;
            self.since = 0;
            let [_, long] = self.settings.recent;
            self.locate_change(blocks, dynamics, long.min(last.fresh()));
        }
    }

    /// T for a present; `None` if there are too few blocks.
    fn wald_statistic(&self, blocks: &[Block], fresh: usize, dynamics: [f64; DYNAMICS], present: usize) -> Option<f64> {
        let Detection {
            recent, least, most, ..
        } = self.settings;
        let recent_blocks = recent[present].min(fresh);
        let now = blocks.len().saturating_sub(recent_blocks);
        let before = now.saturating_sub(GUARD_BLOCKS);
        if before < least || recent_blocks < LEAST_AFTER_GAP.min(recent[0]) {
            return None;
        }
        let sides = [&blocks[before.saturating_sub(most)..before], &blocks[now..]];
        self.compare(sides, EMPIRICAL_SHARE, dynamics)?
            .wald_statistic(OPERATOR_STATES)
    }

    /// Locates the change at the border of blocks with the least residual sum of squares. The difference is reported
    /// with the covariance of the noise model times a dispersion: the mean ratio of the covariance of the scores to
    /// that of the model between the halves of the past. The covariance of the scores alone is too uncertain to
    /// distinguish gains from a delay, and scores of the present contain the change.
    fn locate_change(&mut self, blocks: &[Block], dynamics: [f64; DYNAMICS], recent: usize) {
        let mut best: Option<Contrast> = None;
        self.ago = recent.min(blocks.len().saturating_sub(1));
        for after in 1..=self.ago {
            let (past, present) = blocks.split_at(blocks.len() - after);
            let Some(contrast) = self.compare([past, present], MODEL_ONLY, dynamics) else {
                continue;
            };
            if best.is_none_or(|best| contrast.left < best.left) {
                (best, self.ago) = (Some(contrast), after);
            }
        }
        let (past, present) = blocks.split_at(blocks.len() - self.ago);
        let halves = past.split_at(past.len() / 2);
        let [by_model, shown] = [MODEL_ONLY, EMPIRICAL_SHARE].map(|w| self.compare([halves.0, halves.1], w, dynamics));
        let dispersion = shown.zip(by_model).and_then(|(shown, model)| shown.dispersion(&model));
        self.declared_contrast = best.unwrap_or_default().times(dispersion.unwrap_or(1.0).max(1.0));
        self.innovation_variances = [past, present].map(|side| Block::of(side).innovation_variance());
        self.difference = Difference::of(&self.declared_contrast).unwrap_or_default();
    }

    /// The difference of all states between two spans.
    fn compare(&self, sides: [&[Block]; 2], shown: f64, dynamics: [f64; DYNAMICS]) -> Option<Contrast> {
        let deviations = self.settings.dynamics;
        Contrast::between(sides, shown, |sum| sum.with_prior(dynamics, deviations))
    }

    /// Returns the time from the last declared change to its declaration, s.
    pub fn ago_s(&self) -> f64 {
        self.ago as f64 * BLOCK_S
    }

    /// Returns the log significance at the last block, nats: the larger of both statistics; zero while there are too
    /// few blocks.
    pub fn log_significance(&self) -> f64 {
        self.statistics.iter().fold(0.0, |most, s| s.log_significance.max(most))
    }

    /// Returns the ratio of T to a chi-square without a change: the larger of both statistics.
    pub fn typical_level(&self) -> f64 {
        self.statistics.iter().fold(1.0, |most, s| s.scale().max(most))
    }

    /// Returns the difference at the last declared change.
    pub fn contrast(&self) -> &Contrast {
        &self.declared_contrast
    }

    /// Returns the mean square of the innovations before and after the last declared change.
    pub fn innovation_variances(&self) -> [f64; 2] {
        self.innovation_variances
    }

    /// True if a change was declared at the last sample.
    pub fn declared(&self) -> bool {
        self.declared
    }

    /// Returns the parameters that changed at the last declared change.
    pub fn difference(&self) -> &Difference {
        &self.difference
    }

    /// No block ended at this sample: no change is declared at it.
    pub(super) fn pass_over(&mut self) {
        self.declared = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chance_is_that_of_the_tables() {
        // Abramowitz and Stegun, table 26.8: percentage points of the chi-square for Q = .05 and .001.
        for (pairs, [five, one]) in [
            (1, [5.99147, 13.8155]),
            (2, [9.48773, 18.4668]),
            (3, [12.5916, 22.4577]),
        ] {
            for (x, q) in [(five, 0.05_f64), (one, 0.001)] {
                assert!((log_significance(x, pairs) + libm::log(q)).abs() < 1e-4, "{pairs} {q}");
            }
        }
        assert_eq!(log_significance(0.0, 3), 0.0);
    }
}
