//! Detector of changes in the operator: a Wald test that compares the last few seconds with the preceding data, over
//! blocks of half a second (`blocks`).
//!
//! Least squares over the latest blocks (the present) and over the preceding blocks (the past), with gains, natural
//! frequency, damping, delay and level free in both, gives a difference d. The covariance C of d is estimated from the
//! scores (`contrast`). For gains, natural frequency, damping and delay, but not for the level,
//!
//! `T = d' C^-1 d`
//!
//! has a chi-square distribution with `nu = 6` degrees of freedom if there is no change, and four more for each further
//! input (G. C. Chow, *Econometrica* 28 (1960) 591-605). T is computed for a short and for a long present, since small
//! changes take more data to detect than large ones. One second between past and present is left out, since a change
//! need not coincide with the border of a block.
//!
//! A third statistic, for the short present, assumes that only gain and lead change (`gain_and_lead`). It has 2 degrees
//! of freedom. With further inputs there is such a statistic for each response. A statistic of all parameters of one
//! response, with those of the others free, would have little power: a few seconds of data show that u is predicted
//! worse, but hardly which response changed.
//!
//! **Normalisation.** Some operators vary more than others. T is therefore divided by the square root of c, the level
//! of T relative to a chi-square in the absence of a change. c is estimated from the mean of `ln T`, whose expected
//! value for a chi-square is `ln 2 + psi(nu/2)`; c is at least one, and its prior counts as half a minute of blocks.
//! The statistic is reported as its log significance in nats, with `x = T/(2 sqrt c)`
//!
//! `-ln P(chi^2 > 2x) = x - ln (1 + x + .. + x^(nu/2-1)/(nu/2-1)!)`
//!
//! (M. Abramowitz and I. A. Stegun, 1964, eq. 6.3.3, 6.3.4, 26.4.5).
//!
//! **Declaration.** A change is declared if one of the statistics exceeds the threshold. The significance of gain and
//! lead is first multiplied by 1.9: in recordings of pilots without a change, 8 nats of it are about as rare as 15 nats
//! of the test of all parameters, whose covariance is less certain. The time of the change is
//! the block border that gives the smallest residual sum of squares when all parameters are free before and after it
//! (R. E. Quandt, *J. American Statistical Association* 53 (1958) 873-880).
//!
//! **Response that changed.** A change is often declared within a second, when the outputs are still limited about the
//! old estimate and the whitening filter contains outputs from before the change. So few data do not show which of two
//! responses changed. With further inputs, the changed parameters are therefore estimated again when the present has
//! the length of the long present, without the data next to the change. Of 51 simulated changes in one or both
//! responses, 25 were attributed to the right responses when they were declared, and 47 after the second estimate.
//!
//! The blocks come from the live candidate (`last_blocks`) and use its noise model and basis. From four seconds after a
//! gap, the data recorded after the gap are compared with those recorded before it.

use super::{
    blocks::Block,
    contrast::{Contrast, EMPIRICAL_WEIGHT, MODEL_ONLY_WEIGHT, SolvedSpans},
    difference::Difference,
    gain_and_lead,
    last_blocks::{BLOCK_S, LastBlocks, MAX_BLOCKS},
    sizes::{DYNAMICS_COUNT, GAIN_COUNT, correction_places},
};

/// Expected value of the logarithm of a chi-square with one pair of degrees of freedom, `ln 2 - gamma`.
const MEAN_LOG_CHI_SQUARE: f64 = 0.115_931_515_658_412_45;
/// Factor of the log significance of the statistics of gain and lead.
const GAIN_AND_LEAD_FACTOR: f64 = 1.9;
/// Number of blocks left out between past and present.
const GUARD_BLOCKS: usize = 2;
/// Number of blocks before the located border in which the change can lie.
const BORDER_BLOCKS: usize = 1;
/// Minimum number of blocks in a present that starts after a gap.
const MIN_BLOCKS_AFTER_GAP: usize = 4;
/// Weight, in blocks, of the prior for the level of a statistic; the prior is the level of a chi-square.
const PRIOR_BLOCKS: f64 = 60.0;
/// Maximum number of blocks, in addition to the prior, in the mean that estimates the level of a statistic.
const LEVEL_MEMORY_BLOCKS: f64 = 240.0;
/// Largest amount by which the logarithm of a statistic may exceed its mean level in the update of that level, so a
/// change does not count as normal variation.
const LARGEST_LOG_STEP: f64 = 3.0;

/// Settings of the change detector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectorSettings {
    /// Numbers of blocks in the short and in the long present.
    pub recent: [usize; 2],
    /// Minimum number of blocks in the past.
    pub least: usize,
    /// Maximum number of blocks in the past.
    pub most: usize,
    /// Log significance in nats above which a change is declared.
    pub threshold: f64,
    /// Prior standard deviations of natural frequency (rad/s), damping ratio and delay (s).
    pub dynamics: [f64; DYNAMICS_COUNT],
    /// Number of blocks after a declared change in which no other change is declared.
    pub refractory: u64,
}

/// Statistic, with its level in the absence of a change.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Statistic {
    /// Number of pairs of degrees of freedom.
    pairs: u32,
    level: f64,
    levels: f64,
    log_significance: f64,
}

crate::state!([] Statistic { level, levels, log_significance });

impl Statistic {
    fn new(pairs: u32) -> Self {
        Self {
            pairs,
            level: mean_log_chi_square(pairs),
            levels: PRIOR_BLOCKS,
            log_significance: 0.0,
        }
    }

    /// Mean ratio of the statistic so far to a chi-square, at least one.
    fn scale(&self) -> f64 {
        libm::exp(self.level - mean_log_chi_square(self.pairs)).max(1.0)
    }

    fn update(&mut self, t: f64) {
        // The test uses the level estimated before this block, so a change does not reduce its own significance.
        self.log_significance = log_significance(t / libm::sqrt(self.scale()), self.pairs);
        self.levels = (self.levels + 1.0).min(PRIOR_BLOCKS + LEVEL_MEMORY_BLOCKS);
        let log = libm::log(t.max(0.05)).min(self.level + LARGEST_LOG_STEP);
        self.level += (log - self.level) / self.levels;
    }
}

/// Returns the expected value of the logarithm of a chi-square with the given number of pairs of degrees of freedom.
fn mean_log_chi_square(pairs: u32) -> f64 {
    MEAN_LOG_CHI_SQUARE + (1..pairs).map(|k| 1.0 / f64::from(k)).sum::<f64>()
}

/// Returns `-ln P(chi^2 > x)` for a chi-square with the given number of pairs of degrees of freedom.
fn log_significance(x: f64, pairs: u32) -> f64 {
    let half = 0.5 * x;
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..pairs {
        term *= half / f64::from(k);
        sum += term;
    }
    half - libm::log(sum)
}

/// Detector of changes in the operator.
#[derive(Debug, Clone, PartialEq)]
pub struct Detector<const I: usize, const S: usize> {
    settings: DetectorSettings,
    /// Statistics of all parameters, for the short and for the long present.
    statistics: [Statistic; 2],
    /// Statistics of gain and lead of each input.
    gain_and_lead: [Statistic; I],
    /// Number of blocks since the last change was declared.
    since: u64,
    declared: bool,
    declared_contrast: Contrast<S>,
    innovation_variances: [f64; 2],
    difference: Difference<S>,
    ago: usize,
    /// Number of blocks that were available at the last declared change, if its parameters are to be estimated again;
    /// otherwise zero.
    preliminary: usize,
    revised: bool,
}

crate::state!([const I: usize, const S: usize] Detector<I, S> { statistics, gain_and_lead, since, declared, declared_contrast, innovation_variances, difference, ago, preliminary, revised });

impl<const I: usize, const S: usize> Detector<I, S> {
    /// Number of pairs of degrees of freedom of the statistic: gains and dynamics are tested, but not the level.
    const PAIR_COUNT: u32 = (S as u32 - 1) / 2;

    /// Builds the detector. Returns `None` if the settings are not valid or need more blocks than can be stored.
    pub fn new(settings: DetectorSettings) -> Option<Self> {
        let [short, long] = settings.recent;
        let present = short > 0 && short <= long;
        let room =
            present && settings.least > 0 && settings.least <= settings.most && long + settings.most <= MAX_BLOCKS;
        let sound = settings.dynamics.iter().all(|d| *d > 0.0 && d.is_finite());
        (room && sound).then_some(Self {
            settings,
            statistics: [Statistic::new(Self::PAIR_COUNT); 2],
            gain_and_lead: [Statistic::new(1); I],
            since: u64::MAX >> 12,
            declared: false,
            declared_contrast: Contrast::default(),
            innovation_variances: [0.0; 2],
            difference: Difference::default(),
            ago: 0,
            preliminary: 0,
            revised: false,
        })
    }

    /// Tests the stored blocks; the last one is new. `mean` is the current state, in the basis of the blocks, and
    /// `gain_and_lead` contains the directions of gain and lead of each input in that basis.
    pub(super) fn test<const P: usize>(
        &mut self,
        last: &LastBlocks<S, P>,
        mean: &[f64; S],
        gain_and_lead: &[[[f64; GAIN_COUNT]; 2]; I],
    ) {
        self.ignore_sample();
        self.since += 1;
        // Blocks recorded before the last declared change belong to another operator and are not used.
        let known = self.since().saturating_add(self.ago).min(last.blocks().len());
        let blocks = &last.blocks()[last.blocks().len() - known..];
        let fresh = last.fresh_block_count();
        let spans = |recent| self.solve(self.spans(blocks, fresh, recent)?, mean);
        let [short, long] = self.settings.recent.map(spans);
        let of_all =
            |spans: &SolvedSpans<'_, S, P>| Contrast::of(spans, EMPIRICAL_WEIGHT).wald_statistic(|i| i != GAIN_COUNT);
        let values = [&short, &long].map(|spans| spans.as_ref().and_then(of_all));
        let of_inputs: [Option<f64>; I] =
            core::array::from_fn(|input| gain_and_lead::wald_statistic(short.as_ref()?, input, gain_and_lead[input]));
        let statistics = self.statistics.iter_mut().chain(&mut self.gain_and_lead);
        for (statistic, value) in statistics.zip(values.into_iter().chain(of_inputs)) {
            match value {
                Some(t) => statistic.update(t),
                None => statistic.log_significance = 0.0,
            }
        }
        let [_, long] = self.settings.recent;
        if self.log_significance() > self.settings.threshold && self.since > self.settings.refractory {
            self.declared = true;
            self.since = 0;
            self.ago = self.locate_change(blocks, mean, long.min(fresh));
            let border = blocks.len() - self.ago;
            self.describe_change([&blocks[..border], &blocks[border..]], mean);
            self.preliminary = if I > 1 { known } else { 0 };
        }
        if self.preliminary > 0 && self.since() + self.ago >= long {
            let known = (self.preliminary + self.since()).min(last.blocks().len());
            self.revise_change(&last.blocks()[last.blocks().len() - known..], mean);
        }
    }

    /// Number of blocks since the last declared change.
    fn since(&self) -> usize {
        usize::try_from(self.since).unwrap_or(MAX_BLOCKS)
    }

    /// Returns the blocks of the past and of a present of the given length; `None` if there are too few blocks.
    fn spans<'b, const P: usize>(
        &self,
        blocks: &'b [Block<S, P>],
        fresh: usize,
        recent: usize,
    ) -> Option<[&'b [Block<S, P>]; 2]> {
        let DetectorSettings { least, most, .. } = self.settings;
        let enough = MIN_BLOCKS_AFTER_GAP.min(self.settings.recent[0]);
        let recent = recent.min(fresh);
        let now = blocks.len().saturating_sub(recent);
        let before = now.saturating_sub(GUARD_BLOCKS);
        (before >= least && recent >= enough).then(|| [&blocks[before.saturating_sub(most)..before], &blocks[now..]])
    }

    /// Returns the number of blocks, at most `recent`, after the block border with the smallest residual sum of
    /// squares.
    fn locate_change<const P: usize>(&self, blocks: &[Block<S, P>], mean: &[f64; S], recent: usize) -> usize {
        let recent = recent.min(blocks.len().saturating_sub(1));
        let (mut ago, mut least) = (recent, f64::INFINITY);
        for after in 1..=recent {
            let (past, present) = blocks.split_at(blocks.len() - after);
            if let Some(spans) = self.solve([past, present], mean)
                && spans.residual_squares < least
            {
                (ago, least) = (after, spans.residual_squares);
            }
        }
        ago
    }

    /// Estimates the change between past and present. The difference is reported with the covariance given by the noise
    /// model, multiplied by a dispersion. The dispersion is the mean ratio of the covariance estimated from the scores
    /// to that given by the noise model, for the difference between the two halves of the past. The covariance from the
    /// scores alone is too uncertain to distinguish gains from a delay, and the scores of the present contain the
    /// change.
    fn describe_change<const P: usize>(&mut self, sides: [&[Block<S, P>]; 2], mean: &[f64; S]) {
        let [past, _] = sides;
        let halves = past.split_at(past.len() / 2);
        let dispersion = self.solve([halves.0, halves.1], mean).and_then(|halves| {
            let [by_model, shown] = [MODEL_ONLY_WEIGHT, EMPIRICAL_WEIGHT].map(|w| Contrast::of(&halves, w));
            shown.dispersion(&by_model)
        });
        let found = self
            .solve(sides, mean)
            .map(|spans| Contrast::of(&spans, MODEL_ONLY_WEIGHT));
        self.declared_contrast = found.unwrap_or_default().scaled(dispersion.unwrap_or(1.0).max(1.0));
        self.innovation_variances = sides.map(|side| Block::of(side).innovation_variance());
        self.difference = Difference::of(&self.declared_contrast).unwrap_or_default();
    }

    /// Estimates the last declared change again from the blocks recorded since then and before it.
    fn revise_change<const P: usize>(&mut self, blocks: &[Block<S, P>], mean: &[f64; S]) {
        self.preliminary = 0;
        let ago = self.locate_change(blocks, mean, self.since() + self.ago + GUARD_BLOCKS);
        let border = blocks.len() - ago;
        if border > self.settings.least && ago > GUARD_BLOCKS {
            self.describe_change(
                [&blocks[..border - BORDER_BLOCKS], &blocks[border + GUARD_BLOCKS..]],
                mean,
            );
            self.ago = ago.saturating_sub(self.since());
            self.revised = true;
        }
    }

    /// Solves the normal equations of the past and of the present, each with the prior of the corrections.
    fn solve<'b, const P: usize>(
        &self,
        sides: [&'b [Block<S, P>]; 2],
        mean: &[f64; S],
    ) -> Option<SolvedSpans<'b, S, P>> {
        let mut deviations = [0.0; S];
        for input in 0..I {
            for (place, deviation) in correction_places(input).into_iter().zip(self.settings.dynamics) {
                deviations[place] = deviation;
            }
        }
        SolvedSpans::new(sides, |sum| sum.with_prior(mean, &deviations))
    }

    /// Returns the time in s from the last change to its declaration.
    pub fn detection_delay_s(&self) -> f64 {
        self.ago as f64 * BLOCK_S
    }

    /// Returns the log significance in nats at the last block: the largest over the statistics, with that of gain and
    /// lead multiplied by 1.9; zero while there are too few blocks.
    pub fn log_significance(&self) -> f64 {
        let all = self.statistics.iter().map(|s| s.log_significance);
        let of_gain_and_lead = self
            .gain_and_lead
            .iter()
            .map(|s| GAIN_AND_LEAD_FACTOR * s.log_significance);
        all.chain(of_gain_and_lead).fold(0.0, |most, s| s.max(most))
    }

    /// Returns the typical ratio of T of all parameters to a chi-square in the absence of a change: the larger of the
    /// ratios for the short and for the long present.
    pub fn typical_level(&self) -> f64 {
        self.statistics.iter().fold(1.0, |most, s| s.scale().max(most))
    }

    /// Returns the difference between present and past at the last declared change, computed with all parameters free.
    pub fn contrast(&self) -> &Contrast<S> {
        &self.declared_contrast
    }

    /// Returns the mean squares of the innovations before and after the last declared change.
    pub fn innovation_variances(&self) -> [f64; 2] {
        self.innovation_variances
    }

    /// True if a change was declared at the newest sample.
    pub fn is_change_declared(&self) -> bool {
        self.declared
    }

    /// True if the parameters of the last declared change were estimated again at the newest sample.
    pub fn is_change_revised(&self) -> bool {
        self.revised
    }

    /// Returns the parameters that differ at the last declared change, and the sizes of their changes.
    pub fn difference(&self) -> &Difference<S> {
        &self.difference
    }

    /// Records that no block was completed at this sample, so no change is declared or revised at it.
    pub(super) fn ignore_sample(&mut self) {
        (self.declared, self.revised) = (false, false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn significance_matches_chi_square_tables() {
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
