//! Comparison of the signals of one second with earlier data.
//!
//! For each block of one second, three kinds of mean magnitudes are computed: `m_c` of each channel c (e and u) about
//! its long-run mean, `a_cj` of its backward differences of order j = 1 to 4, and `a_eps` of the innovations of the
//! recursion. The long-run values M_c and A_cj follow with a time constant of 60 blocks. The values of a block are
//! limited to between half and twice the long-run values, so no block changes these by more than 1/60. Blocks in which
//! a fault is found are not used.
//!
//! | finding | rule | reason |
//! |---|---|---|
//! | frozen e | `a_e1 <= A_e1/1000` in a block | the error of a tracking person never stays constant |
//! | frozen u | `a_u1 <= A_u1/1000` in three consecutive blocks, except for a rest ([`super::resting`]) during which `a_eps` is at most twice its long-run value | a hand may rest |
//! | idle | e and u each within a range of `M_c/20` in two consecutive blocks | only noise is recorded |
//! | larger | `a_c1 > 5 A_c1` and `a_c3 > 5 A_c3` for both e and u in two consecutive blocks | both signals are scaled by a factor |
//! | rescaled | all four `a_cj/A_cj` of one channel above 3.5 and within a factor of 1.5 of each other, and all four of the other channel below 2, in two consecutive blocks | a unit or a gain setting was changed |
//! | swapped | the sum over blocks of `d(own) - d(other) - 1`, at most 4 per block and never below 0, reaches 6 | e resembles the earlier u, and u the earlier e; d is the sum over both channels of `\|log a_1/A_1\| + \|log a_3/A_3\|` |
//! | misfit | `R = a_eps/min_j a_uj` is above 4 times its long-run value and above 1.5, and a_eps is above twice its long-run value, in two consecutive blocks | the past of u alone predicts u better than the model, which also uses e; earlier, the model was better |
//!
//! The sum for swapped channels is a one-sided CUSUM (E. S. Page, *Biometrika* 41 (1954) 100-115). Its terms are
//! negative for channels that are not swapped, and at most the distance between the two profiles for swapped channels.
//! Channels with similar profiles are therefore never reported as swapped.

use super::channel::ORDER_COUNT;
use crate::bounds::clamp;

/// Number of channels: e and u.
pub const CHANNEL_COUNT: usize = 2;
/// Number of blocks from which the long-run values are learnt.
const ESTIMATION_BLOCKS: u32 = 10;
/// Weight of a block once the long-run values are known.
const BLOCK_WEIGHT: f64 = 1.0 / 60.0;
/// Fraction of the long-run mean difference up to which a signal counts as constant. The constants below are the limits
/// of the other rules.
pub const CONSTANT_FRACTION: f64 = 1e-3;
const FROZEN_U_BLOCKS: u32 = 3;
const IDLE_RATIO: f64 = 0.05;
const IDLE_BLOCKS: u32 = 2;
const LARGER_RATIO: f64 = 5.0;
const RESCALED_RATIO: f64 = 3.5;
const LARGEST_ORDER_RATIO: f64 = 1.5;
const OTHER_CHANNEL_RATIO: f64 = 2.0;
const LARGER_BLOCKS: u32 = 2;
const SWAPPED_DRIFT: f64 = 1.0;
const SWAPPED_EVIDENCE: f64 = 6.0;
/// Largest contribution of one block to the sum for swapped channels.
const MAX_EVIDENCE: f64 = 4.0;
const MISFIT_EVIDENCE: f64 = 4.0;
/// Ratio R up to which there is never a misfit.
const MIN_MISFIT_RATIO: f64 = 1.5;
/// Ratio of the innovations to their long-run value below which there is no misfit.
const MIN_INNOVATION_GROWTH: f64 = 2.0;
const MISFIT_BLOCKS: u32 = 2;
/// Multiple of the long-run value of R up to which the model predicts u as well as before a misfit.
const MAX_FIT_RATIO: f64 = 2.0;
/// Distance of a block from the long-run values below which it resembles them: four times the logarithm of four.
const SIMILAR_DISTANCE: f64 = 4.0 * 1.386;
/// Distance from the long-run values above which a block is unusual.
const UNUSUAL_DISTANCE: f64 = 4.0;
/// Largest contribution of the logarithm of one ratio to a distance.
const MAX_LOG_RATIO: f64 = 10.0;

/// Sums over the samples of a block, or the means computed from them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block {
    /// Magnitudes of the backward differences of order 1 to 4 of e and u.
    pub differences: [[f64; ORDER_COUNT]; CHANNEL_COUNT],
    /// Magnitudes of e and u about their long-run means.
    pub magnitude: [f64; CHANNEL_COUNT],
    /// Smallest and largest values of e and u.
    pub range: [[f64; 2]; CHANNEL_COUNT],
    /// Sums or means of the values of e and u.
    pub mean: [f64; CHANNEL_COUNT],
    /// Magnitudes of the innovations.
    pub innovation: f64,
    /// Number of samples.
    pub samples: u32,
    /// Number of samples with an innovation.
    pub innovations: u32,
}

crate::state!([] Block { differences, magnitude, range, mean, innovation, samples, innovations });

impl Default for Block {
    fn default() -> Self {
        Self {
            differences: [[0.0; ORDER_COUNT]; CHANNEL_COUNT],
            magnitude: [0.0; CHANNEL_COUNT],
            range: [[f64::INFINITY, f64::NEG_INFINITY]; CHANNEL_COUNT],
            mean: [0.0; CHANNEL_COUNT],
            innovation: 0.0,
            samples: 0,
            innovations: 0,
        }
    }
}

impl Block {
    /// Adds a sample of both channels: its backward differences and values; `centre` are the long-run means.
    #[inline(always)]
    pub fn add(
        &mut self,
        differences: &[[f64; ORDER_COUNT]; CHANNEL_COUNT],
        values: [f64; CHANNEL_COUNT],
        centre: [f64; CHANNEL_COUNT],
    ) {
        for c in 0..CHANNEL_COUNT {
            for j in 0..ORDER_COUNT {
                self.differences[c][j] += differences[c][j].abs();
            }
            self.magnitude[c] += (values[c] - centre[c]).abs();
            self.mean[c] += values[c];
            let [low, high] = self.range[c];
            self.range[c] = [
                if values[c] < low { values[c] } else { low },
                if values[c] > high { values[c] } else { high },
            ];
        }
        self.samples += 1;
    }

    /// Adds the magnitude of an innovation.
    #[inline(always)]
    pub fn add_innovation(&mut self, innovation: f64) {
        self.innovation += innovation.abs();
        self.innovations += 1;
    }

    /// Returns the means over the block, computed from the sums.
    #[must_use]
    pub fn means(&self) -> Self {
        let over = |sum: f64, count: u32| if count > 0 { sum / f64::from(count) } else { 0.0 };
        let n = self.samples;
        Self {
            differences: self.differences.map(|all| all.map(|sum| over(sum, n))),
            magnitude: self.magnitude.map(|sum| over(sum, n)),
            mean: self.mean.map(|sum| over(sum, n)),
            innovation: over(self.innovation, self.innovations),
            ..*self
        }
    }

    /// Ratio R of the mean magnitude of the innovations to the smallest mean difference of u; `None` if either is
    /// missing.
    fn ratio(&self) -> Option<f64> {
        let least = self.smallest_prediction_error_of_u();
        (self.innovations > 0 && least > 0.0).then(|| self.innovation / least)
    }

    /// Smallest mean magnitude of the differences of u of order 1 to 4, which is the error of predicting u from its own
    /// past.
    fn smallest_prediction_error_of_u(&self) -> f64 {
        self.differences[1]
            .iter()
            .fold(f64::INFINITY, |least, a| if *a < least { *a } else { least })
    }
}

/// Kind of fault found in a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// e stays constant.
    FrozenInput,
    /// u stays constant.
    FrozenOutput,
    /// e and u contain little more than noise.
    Idle,
    /// e and u are both larger by a factor.
    Larger,
    /// e is scaled by a factor.
    RescaledInput,
    /// u is scaled by a factor.
    RescaledOutput,
    /// e resembles the earlier u, and u the earlier e.
    Swapped,
    /// The model predicts u worse than the past of u does.
    Misfit,
}

impl Fault {
    /// True for faults that can turn out to be a new normal state of the signals; frozen and idle channels cannot.
    pub fn may_be_new_level(self) -> bool {
        !matches!(self, Self::FrozenInput | Self::FrozenOutput | Self::Idle)
    }

    /// Minimum duration of the fault in blocks when it is first reported.
    pub fn min_duration_blocks(self) -> u32 {
        match self {
            Self::FrozenInput => 1,
            Self::FrozenOutput => FROZEN_U_BLOCKS,
            Self::Idle => IDLE_BLOCKS,
            Self::Larger | Self::RescaledInput | Self::RescaledOutput => LARGER_BLOCKS,
            Self::Swapped => 2,
            Self::Misfit => MISFIT_BLOCKS,
        }
    }
}

/// Long-run values of the signals, and durations of the current faults.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Profile {
    typical: Block,
    /// Number of blocks from which the long-run values were learnt.
    blocks: u32,
    frozen_u: u32,
    idle: u32,
    larger: u32,
    rescaled: [u32; CHANNEL_COUNT],
    swapped: f64,
    misfits: u32,
    /// Long-run value of R, and number of blocks from which it was learnt.
    ratio: f64,
    ratios: u32,
    /// Long-run value of a_eps.
    innovation: f64,
}

crate::state!([] Profile { typical, blocks, frozen_u, idle, larger, rescaled, swapped, misfits, ratio, ratios, innovation });

impl Default for Profile {
    fn default() -> Self {
        Self::new()
    }
}

impl Profile {
    /// Returns a profile without long-run values.
    pub fn new() -> Self {
        Self {
            typical: Block::default(),
            blocks: 0,
            frozen_u: 0,
            idle: 0,
            larger: 0,
            rescaled: [0; CHANNEL_COUNT],
            swapped: 0.0,
            misfits: 0,
            ratio: 0.0,
            ratios: 0,
            innovation: 0.0,
        }
    }

    /// Returns a profile with the given long-run values.
    pub fn of(typical: &Block) -> Self {
        Self {
            typical: *typical,
            blocks: ESTIMATION_BLOCKS,
            ..Self::new()
        }
    }

    /// True if the long-run values are known and no fault was suspected in the last blocks.
    pub fn is_calm(&self) -> bool {
        self.is_known()
            && self.frozen_u == 0
            && self.idle == 0
            && self.larger == 0
            && self.rescaled == [0; CHANNEL_COUNT]
            && self.swapped == 0.0
            && self.misfits == 0
    }

    /// True if the mean differences of a block differ from the long-run values by more than a factor of 2.7, averaged
    /// over the absolute logarithms of their ratios.
    pub fn is_unusual(&self, block: &Block) -> bool {
        self.is_known() && self.distance(block, [0, 1]) > UNUSUAL_DISTANCE
    }

    /// True if the mean differences of a block are within a factor of four of the long-run values, averaged over the
    /// absolute logarithms of their ratios.
    pub fn resembles(&self, block: &Block) -> bool {
        self.is_known() && self.distance(block, [0, 1]) < SIMILAR_DISTANCE
    }

    /// True if R of a block is at most twice its long-run value: the model predicts u about as well as it typically
    /// does.
    pub fn has_typical_fit(&self, block: &Block) -> bool {
        block.ratio().is_none_or(|ratio| ratio <= MAX_FIT_RATIO * self.ratio)
    }

    /// True once the long-run values are known.
    pub fn is_known(&self) -> bool {
        self.blocks >= ESTIMATION_BLOCKS
    }

    /// Returns the long-run values.
    pub fn typical_values(&self) -> &Block {
        &self.typical
    }

    /// Updates the long-run values with the means of a block without a fault.
    pub fn update(&mut self, block: &Block) {
        let known = self.is_known();
        self.blocks = self.blocks.saturating_add(1);
        let weight = if known {
            BLOCK_WEIGHT
        } else {
            1.0 / f64::from(self.blocks)
        };
        let toward = |typical: &mut f64, found: f64, least: f64, most: f64| {
            let bounded = if known { clamp(found, [least, most]) } else { found };
            *typical += weight * (bounded - *typical);
        };
        // If the squares of a signal underflow, the ratio R is not defined.
        let sound = |ratio: &f64| ratio.is_finite() && block.innovation.is_finite();
        if let Some(ratio) = block.ratio().filter(sound) {
            let known = self.ratios >= ESTIMATION_BLOCKS;
            self.ratios = self.ratios.saturating_add(1);
            let weight = if known {
                BLOCK_WEIGHT
            } else {
                1.0 / f64::from(self.ratios)
            };
            let bounded = if known {
                clamp(ratio, [0.5 * self.ratio, 2.0 * self.ratio])
            } else {
                ratio
            };
            self.ratio += weight * (bounded - self.ratio);
            let size = block.innovation;
            let bounded = if known {
                clamp(size, [0.5 * self.innovation, 2.0 * self.innovation])
            } else {
                size
            };
            self.innovation += weight * (bounded - self.innovation);
        }
        for c in 0..CHANNEL_COUNT {
            for (typical, found) in self.typical.differences[c].iter_mut().zip(block.differences[c]) {
                let now = *typical;
                toward(typical, found, 0.5 * now, 2.0 * now);
            }
            let size = self.typical.magnitude[c];
            toward(
                &mut self.typical.magnitude[c],
                block.magnitude[c],
                0.5 * size,
                2.0 * size,
            );
            let mean = self.typical.mean[c];
            toward(&mut self.typical.mean[c], block.mean[c], mean - size, mean + size);
        }
    }

    /// Returns the minimum time, in blocks, for which a fault that was just reported has lasted.
    pub fn duration_blocks(&self, fault: Fault) -> u32 {
        match fault {
            Fault::FrozenOutput => self.frozen_u.max(fault.min_duration_blocks()),
            _ => fault.min_duration_blocks(),
        }
    }

    /// Returns the fault found in a block, taking the preceding blocks into account. `rests` is true if u is constant
    /// at the end of the block because the person is resting.
    pub fn find_fault(&mut self, block: &Block, rests: bool) -> Option<Fault> {
        if !self.is_known() {
            return None;
        }
        // A channel that has never moved (because there is no input, or because it was not recorded) is not frozen.
        let below = |found: f64, share: f64, typical: f64| typical > 0.0 && found <= share * typical;
        let still = |c: usize| {
            below(
                block.differences[c][0],
                CONSTANT_FRACTION,
                self.typical.differences[c][0],
            )
        };
        let silent = |c: usize| {
            below(
                block.range[c][1] - block.range[c][0],
                IDLE_RATIO,
                self.typical.magnitude[c],
            )
        };
        let count = |run: u32, is: bool| if is { run.saturating_add(1) } else { 0 };
        let frozen_e = still(0);
        self.frozen_u = count(self.frozen_u, still(1));
        self.idle = count(self.idle, silent(0) && silent(1));
        let grown = |c: usize, j: usize| {
            let typical = self.typical.differences[c][j];
            typical > 0.0 && block.differences[c][j] > LARGER_RATIO * typical
        };
        self.larger = count(self.larger, [0, 2].iter().all(|j| grown(0, *j) && grown(1, *j)));
        let ratios = [0, 1].map(|c| self.ratio_range(block, c));
        for (c, run) in self.rescaled.iter_mut().enumerate() {
            let [least, most] = ratios[c];
            let other = ratios[1 - c][1];
            *run = count(
                *run,
                least > RESCALED_RATIO && most < LARGEST_ORDER_RATIO * least && other < OTHER_CHANNEL_RATIO,
            );
        }
        let evidence = self.distance(block, [0, 1]) - self.distance(block, [1, 0]) - SWAPPED_DRIFT;
        let evidence = evidence.clamp(-MAX_EVIDENCE, MAX_EVIDENCE);
        self.swapped = (self.swapped + evidence).clamp(0.0, 2.0 * SWAPPED_EVIDENCE);
        let limit = (MISFIT_EVIDENCE * self.ratio).max(MIN_MISFIT_RATIO);
        let misfit = self.ratios >= ESTIMATION_BLOCKS && block.ratio().is_some_and(|ratio| ratio > limit);
        // During a rest the past of u predicts u exactly, which does not imply that the model is wrong.
        let innovations_normal =
            self.ratios < ESTIMATION_BLOCKS || block.innovation <= MIN_INNOVATION_GROWTH * self.innovation;
        let misfit = misfit && !innovations_normal;
        self.misfits = count(self.misfits, misfit);
        if frozen_e {
            Some(Fault::FrozenInput)
        } else if self.idle >= IDLE_BLOCKS {
            Some(Fault::Idle)
        } else if self.frozen_u >= FROZEN_U_BLOCKS && !(rests && innovations_normal) {
            Some(Fault::FrozenOutput)
        } else if self.larger >= LARGER_BLOCKS {
            Some(Fault::Larger)
        } else if self.rescaled[0] >= LARGER_BLOCKS {
            Some(Fault::RescaledInput)
        } else if self.rescaled[1] >= LARGER_BLOCKS {
            Some(Fault::RescaledOutput)
        } else if self.swapped >= SWAPPED_EVIDENCE {
            Some(Fault::Swapped)
        } else if self.misfits >= MISFIT_BLOCKS {
            Some(Fault::Misfit)
        } else {
            None
        }
    }

    /// Smallest and largest ratio of the differences of a channel to their long-run values.
    fn ratio_range(&self, block: &Block, c: usize) -> [f64; 2] {
        let mut ends = [f64::INFINITY, 0.0];
        for (found, typical) in block.differences[c].iter().zip(&self.typical.differences[c]) {
            let ratio = if found == typical { 1.0 } else { found / typical };
            ends = [ends[0].min(ratio), ends[1].max(ratio)];
        }
        ends
    }

    /// Distance of a block from the long-run values, where channel c of the block is compared with the long-run values
    /// of channel `of[c]`.
    fn distance(&self, block: &Block, of: [usize; CHANNEL_COUNT]) -> f64 {
        let mut sum = 0.0;
        for (c, typical) in of.into_iter().enumerate() {
            for j in [0, 2] {
                let (found, typical) = (block.differences[c][j], self.typical.differences[typical][j]);
                // If the values are equal, as two zeros are, their distance is zero.
                let log = if found == typical {
                    0.0
                } else {
                    libm::log(found / typical).abs()
                };
                sum += if log < MAX_LOG_RATIO { log } else { MAX_LOG_RATIO };
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(size: [f64; 2], smooth: [f64; 2]) -> Block {
        let differences = [0, 1].map(|c| [0, 1, 2, 3].map(|j| size[c] * libm::pow(smooth[c], f64::from(j))));
        Block {
            differences,
            magnitude: [10.0 * size[0], 5.0 * size[1]],
            range: [[0.0, 40.0 * size[0]], [0.0, 20.0 * size[1]]],
            mean: [0.0; 2],
            innovation: size[1],
            samples: 100,
            innovations: 100,
        }
    }

    fn known_profile() -> Profile {
        let mut profile = Profile::new();
        for _ in 0..20 {
            let typical = block([0.02, 0.1], [0.1, 1.1]);
            assert_eq!(profile.find_fault(&typical, false), None);
            profile.update(&typical);
        }
        profile
    }

    /// Innovations that are not finite, as after an underflow of squares, do not enter the long-run values and cause no
    /// panic.
    #[test]
    fn non_finite_innovations_do_not_enter_the_profile() {
        let mut profile = known_profile();
        for innovation in [f64::INFINITY, f64::NAN, 0.1] {
            let found = Block {
                innovation,
                ..block([0.02, 0.1], [0.1, 1.1])
            };
            profile.update(&found);
            assert!(profile.ratio.is_finite() && profile.innovation.is_finite());
        }
    }

    #[test]
    fn each_fault_is_identified_and_ends() {
        let typical = block([0.02, 0.1], [0.1, 1.1]);
        let cases = [
            (block([0.0, 0.1], [0.1, 1.1]), Fault::FrozenInput, 1),
            (block([0.02, 0.0], [0.1, 1.1]), Fault::FrozenOutput, 3),
            (block([1e-4, 1e-4], [0.1, 1.1]), Fault::Idle, 2),
            (block([0.2, 1.0], [0.1, 1.1]), Fault::Larger, 2),
            (block([0.1, 0.1], [0.1, 1.1]), Fault::RescaledInput, 2),
            (block([0.02, 0.45], [0.1, 1.1]), Fault::RescaledOutput, 2),
            (block([0.1, 0.02], [1.1, 0.1]), Fault::Swapped, 2),
            (
                Block {
                    innovation: 1.0,
                    ..typical
                },
                Fault::Misfit,
                2,
            ),
        ];
        for (bad, fault, after) in cases {
            let mut profile = known_profile();
            for n in 1..=5 {
                let found = profile.find_fault(&bad, false);
                assert_eq!(found, (n >= after).then_some(fault), "{n} {fault:?}");
            }
            let left = (0..30).find(|_| profile.find_fault(&typical, false).is_none());
            assert!(left.is_some_and(|n| n <= 12), "{fault:?}: {left:?}");
        }
    }

    /// A constant u at its rest position is a fault only if e is constant too, or if the innovations during the rest
    /// are too large.
    #[test]
    fn rest_is_a_fault_only_with_constant_e_or_large_innovations() {
        let still = block([0.02, 0.0], [0.1, 1.1]);
        let quiet = |innovation: f64, e: f64| Block {
            innovation,
            ..block([e, 0.0], [0.1, 1.1])
        };
        let after = |rests: bool, found: &Block| {
            let mut profile = known_profile();
            (1..=20).find_map(|n| profile.find_fault(found, rests).map(|fault| (n, fault)))
        };
        assert_eq!(after(false, &still), Some((3, Fault::FrozenOutput)));
        assert_eq!(after(true, &quiet(0.0, 0.02)), None);
        assert_eq!(after(true, &quiet(0.19, 0.02)), None);
        assert_eq!(after(true, &quiet(0.21, 0.02)), Some((3, Fault::FrozenOutput)));
        assert_eq!(after(true, &quiet(0.0, 0.0)), Some((1, Fault::FrozenInput)));
        // The duration of a fault includes the blocks in which it was accepted as a rest.
        let mut profile = known_profile();
        (0..9).for_each(|_| assert_eq!(profile.find_fault(&quiet(0.0, 0.02), true), None));
        let reported = profile.find_fault(&quiet(0.0, 0.02), false);
        assert_eq!(reported.map(|fault| profile.duration_blocks(fault)), Some(10));
    }

    #[test]
    fn one_block_changes_long_run_values_by_at_most_two_percent() {
        let mut profile = known_profile();
        let before = *profile.typical_values();
        profile.update(&block([20.0, 100.0], [0.1, 1.1]));
        for c in 0..CHANNEL_COUNT {
            let ratio = profile.typical_values().differences[c][0] / before.differences[c][0];
            assert!((1.0..1.02).contains(&ratio), "{ratio}");
        }
    }

    #[test]
    fn similar_channels_are_never_reported_as_swapped() {
        let mut profile = Profile::new();
        let mut size = 0.1;
        for n in 0..200 {
            let found = block([size, size], [0.9, 0.9]);
            assert_eq!(profile.find_fault(&found, false), None, "{n}");
            profile.update(&found);
            size *= if n % 7 < 4 { 1.5 } else { 0.6 };
        }
    }
}
