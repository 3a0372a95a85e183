//! Comparison of the signals of one second with those of the time before.
//!
//! For each block of a second the mean magnitudes of e and u about their long-run means are kept, `m_c`, of their
//! backward differences of order 1 to 4, `a_cj`, and of the innovations of the recursion, `a_eps`. Their long-run
//! means M_c and A_cj follow with a time constant of 60 blocks; a block enters with no less than half and no more than
//! twice the long-run value, so that no block moves them by more than 1/60. Blocks in which a fault is found do not
//! enter.
//!
//! | finding | rule | reason |
//! |---|---|---|
//! | frozen e | `a_e1 <= A_e1/1000` in a block | the error of a person who tracks never stays constant |
//! | frozen u | `a_u1 <= A_u1/1000` in three blocks in a row, except for a rest ([`super::resting`]) in which `a_eps` is at most twice its long-run value | a hand may rest |
//! | idle | e and u each within a range of `M_c/20` in two blocks in a row | silence, with noise |
//! | larger | `a_c1 > 5 A_c1` and `a_c3 > 5 A_c3` for e and u in two blocks in a row | both signals are scaled by a factor |
//! | rescaled | all four `a_cj/A_cj` of one channel above 3.5 and within a factor of 1.5 of each other, those of the other below 2, in two blocks in a row | the unit or a gain setting was changed |
//! | swapped | the sum over blocks of `d(own) - d(other) - 1`, at most 4 a block and never below 0, reaches 6 | e resembles the earlier u, and u the earlier e; d is the sum over both channels of `\|log a_1/A_1\| + \|log a_3/A_3\|` |
//! | misfit | `R = a_eps/min_j a_uj` is above 4 times its long-run value, and above 1.5, and a_eps above twice its own, in two blocks in a row | the last samples of u predict it better than the model, which also uses e; before, the model was better |
//!
//! The sum for swapped channels is a one-sided CUSUM (E. S. Page, *Biometrika* 41 (1954) 100-115) of a difference that
//! is negative for channels that are not swapped and at most the distance of the two profiles for swapped ones:
//! channels that are alike are never reported as swapped.

use super::channel::ORDERS;
use crate::bounds::within;

/// e and u.
pub const CHANNELS: usize = 2;
/// Number of blocks after which the long-run values are known.
const LEARNT: u32 = 10;
/// Weight of a block after that.
const WEIGHT: f64 = 1.0 / 60.0;
/// Limits of the rules. Share of the typical mean difference up to which a signal counts as constant.
pub const STILL: f64 = 1e-3;
const FROZEN_U_BLOCKS: u32 = 3;
const IDLE: f64 = 0.05;
const IDLE_BLOCKS: u32 = 2;
const LARGER: f64 = 5.0;
const RESCALED: f64 = 3.5;
const ALL_ORDERS: f64 = 1.5;
const OTHER: f64 = 2.0;
const LARGER_BLOCKS: u32 = 2;
const SWAPPED_DRIFT: f64 = 1.0;
const SWAPPED: f64 = 6.0;
/// Largest contribution of one block to the sum.
const MOST_EVIDENCE: f64 = 4.0;
const MISFIT: f64 = 4.0;
/// Ratio R up to which a model predicts well enough.
const LEAST_RATIO: f64 = 1.5;
/// Growth of the innovations below which there is no misfit.
const LEAST_GROWTH: f64 = 2.0;
const MISFIT_BLOCKS: u32 = 2;
/// Distance of a typical block: four logarithms of four.
const ALIKE: f64 = 4.0 * 1.386;
/// Distance of an unusual block.
const UNLIKE: f64 = 4.0;
/// Limit of the logarithms of features.
const LARGEST_LOG: f64 = 10.0;

/// Sums over a block, or its means.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block {
    /// Magnitudes of the backward differences of order 1 to 4.
    pub differences: [[f64; ORDERS]; CHANNELS],
    /// Magnitudes about the long-run means.
    pub magnitude: [f64; CHANNELS],
    /// Smallest and largest value.
    pub range: [[f64; 2]; CHANNELS],
    /// Values.
    pub mean: [f64; CHANNELS],
    /// Magnitudes of innovations.
    pub innovation: f64,
    /// Number of samples.
    pub samples: u32,
    /// Number of innovations among them.
    pub innovations: u32,
}

crate::state!([] Block { differences, magnitude, range, mean, innovation, samples, innovations });

impl Default for Block {
    fn default() -> Self {
        Self {
            differences: [[0.0; ORDERS]; CHANNELS],
            magnitude: [0.0; CHANNELS],
            range: [[f64::INFINITY, f64::NEG_INFINITY]; CHANNELS],
            mean: [0.0; CHANNELS],
            innovation: 0.0,
            samples: 0,
            innovations: 0,
        }
    }
}

impl Block {
    /// Adds the samples of both channels: differences, values, and the long-run means.
    #[inline(always)]
    pub fn add(&mut self, differences: &[[f64; ORDERS]; CHANNELS], values: [f64; CHANNELS], centre: [f64; CHANNELS]) {
        for c in 0..CHANNELS {
            for j in 0..ORDERS {
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

    /// Adds an innovation.
    #[inline(always)]
    pub fn add_innovation(&mut self, innovation: f64) {
        self.innovation += innovation.abs();
        self.innovations += 1;
    }

    /// Returns the means.
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

    /// R: the mean innovation over the least mean difference of u; `None` if either is missing.
    fn ratio(&self) -> Option<f64> {
        let least = self.least_of_u();
        (self.innovations > 0 && least > 0.0).then(|| self.innovation / least)
    }

    /// The smallest mean of the differences of u: the error of predicting u from its own past.
    fn least_of_u(&self) -> f64 {
        self.differences[1]
            .iter()
            .fold(f64::INFINITY, |least, a| if *a < least { *a } else { least })
    }
}

/// Kind of trouble of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trouble {
    /// e stays constant.
    FrozenInput,
    /// u stays constant.
    FrozenOutput,
    /// e and u are nearly silent.
    Idle,
    /// Both are larger by a factor.
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

impl Trouble {
    /// True for troubles that may become the typical state; silence may not.
    pub fn may_be_the_new_level(self) -> bool {
        !matches!(self, Self::FrozenInput | Self::FrozenOutput | Self::Idle)
    }

    /// Least duration in blocks at the first report.
    pub fn blocks(self) -> u32 {
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

/// The long-run values, and the duration of troubles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Profile {
    typical: Block,
    /// Number of blocks from which they were learnt.
    blocks: u32,
    frozen_u: u32,
    idle: u32,
    larger: u32,
    rescaled: [u32; CHANNELS],
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
    /// An empty profile.
    pub fn new() -> Self {
        Self {
            typical: Block::default(),
            blocks: 0,
            frozen_u: 0,
            idle: 0,
            larger: 0,
            rescaled: [0; CHANNELS],
            swapped: 0.0,
            misfits: 0,
            ratio: 0.0,
            ratios: 0,
            innovation: 0.0,
        }
    }

    /// A profile with known long-run values.
    pub fn of(typical: &Block) -> Self {
        Self {
            typical: *typical,
            blocks: LEARNT,
            ..Self::new()
        }
    }

    /// True if the last blocks gave no reason for suspicion.
    pub fn is_calm(&self) -> bool {
        self.is_known()
            && self.frozen_u == 0
            && self.idle == 0
            && self.larger == 0
            && self.rescaled == [0; CHANNELS]
            && self.swapped == 0.0
            && self.misfits == 0
    }

    /// True for the means of an unusual block: different by a factor of e in the mean of the logarithms.
    pub fn is_unusual(&self, block: &Block) -> bool {
        self.is_known() && self.distance(block, [0, 1]) > UNLIKE
    }

    /// True for the means of a block that is like the typical ones: within a factor of four in the mean of the
    /// logarithms.
    pub fn resembles(&self, block: &Block) -> bool {
        self.is_known() && self.distance(block, [0, 1]) < ALIKE
    }

    /// True once long-run values are known.
    pub fn is_known(&self) -> bool {
        self.blocks >= LEARNT
    }

    /// Returns the long-run values.
    pub fn typical(&self) -> &Block {
        &self.typical
    }

    /// Takes the means of a sound block into the long-run values.
    pub fn update(&mut self, block: &Block) {
        let known = self.is_known();
        self.blocks = self.blocks.saturating_add(1);
        let weight = if known { WEIGHT } else { 1.0 / f64::from(self.blocks) };
        let toward = |typical: &mut f64, found: f64, least: f64, most: f64| {
            let bounded = if known { within(found, [least, most]) } else { found };
            *typical += weight * (bounded - *typical);
        };
        // Signals whose squares underflow have no ratio.
        let sound = |ratio: &f64| ratio.is_finite() && block.innovation.is_finite();
        if let Some(ratio) = block.ratio().filter(sound) {
            let known = self.ratios >= LEARNT;
            self.ratios = self.ratios.saturating_add(1);
            let weight = if known { WEIGHT } else { 1.0 / f64::from(self.ratios) };
            let bounded = if known {
                within(ratio, [0.5 * self.ratio, 2.0 * self.ratio])
            } else {
                ratio
            };
            self.ratio += weight * (bounded - self.ratio);
            let size = block.innovation;
            let bounded = if known {
                within(size, [0.5 * self.innovation, 2.0 * self.innovation])
            } else {
                size
            };
            self.innovation += weight * (bounded - self.innovation);
        }
        for c in 0..CHANNELS {
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

    /// Returns the least duration in blocks of a trouble that was just reported.
    pub fn lasting(&self, trouble: Trouble) -> u32 {
        match trouble {
            Trouble::FrozenOutput => self.frozen_u.max(trouble.blocks()),
            _ => trouble.blocks(),
        }
    }

    /// Returns the fault found in a block, given the earlier blocks; `rests` if u is constant at its end because the
    /// person rests.
    pub fn judge(&mut self, block: &Block, rests: bool) -> Option<Trouble> {
        if !self.is_known() {
            return None;
        }
        // A channel that never moved (there is no input, or it was never recorded) is not frozen.
        let below = |found: f64, share: f64, typical: f64| typical > 0.0 && found <= share * typical;
        let still = |c: usize| below(block.differences[c][0], STILL, self.typical.differences[c][0]);
        let silent = |c: usize| below(block.range[c][1] - block.range[c][0], IDLE, self.typical.magnitude[c]);
        let count = |run: u32, is: bool| if is { run.saturating_add(1) } else { 0 };
        let frozen_e = still(0);
        self.frozen_u = count(self.frozen_u, still(1));
        self.idle = count(self.idle, silent(0) && silent(1));
        let grown = |c: usize, j: usize| {
            let typical = self.typical.differences[c][j];
            typical > 0.0 && block.differences[c][j] > LARGER * typical
        };
        self.larger = count(self.larger, [0, 2].iter().all(|j| grown(0, *j) && grown(1, *j)));
        let ratios = [0, 1].map(|c| self.ratios_of(block, c));
        for (c, run) in self.rescaled.iter_mut().enumerate() {
            let [least, most] = ratios[c];
            let other = ratios[1 - c][1];
            *run = count(*run, least > RESCALED && most < ALL_ORDERS * least && other < OTHER);
        }
        let evidence = self.distance(block, [0, 1]) - self.distance(block, [1, 0]) - SWAPPED_DRIFT;
        let evidence = evidence.clamp(-MOST_EVIDENCE, MOST_EVIDENCE);
        self.swapped = (self.swapped + evidence).clamp(0.0, 2.0 * SWAPPED);
        let limit = (MISFIT * self.ratio).max(LEAST_RATIO);
        let misfit = self.ratios >= LEARNT && block.ratio().is_some_and(|ratio| ratio > limit);
        // During a rest the past predicts u exactly, and the model need not be wrong.
        let as_foretold = self.ratios < LEARNT || block.innovation <= LEAST_GROWTH * self.innovation;
        let misfit = misfit && !as_foretold;
        self.misfits = count(self.misfits, misfit);
        if frozen_e {
            Some(Trouble::FrozenInput)
        } else if self.idle >= IDLE_BLOCKS {
            Some(Trouble::Idle)
        } else if self.frozen_u >= FROZEN_U_BLOCKS && !(rests && as_foretold) {
            Some(Trouble::FrozenOutput)
        } else if self.larger >= LARGER_BLOCKS {
            Some(Trouble::Larger)
        } else if self.rescaled[0] >= LARGER_BLOCKS {
            Some(Trouble::RescaledInput)
        } else if self.rescaled[1] >= LARGER_BLOCKS {
            Some(Trouble::RescaledOutput)
        } else if self.swapped >= SWAPPED {
            Some(Trouble::Swapped)
        } else if self.misfits >= MISFIT_BLOCKS {
            Some(Trouble::Misfit)
        } else {
            None
        }
    }

    /// The least and the largest ratio of the differences of a channel to the typical ones.
    fn ratios_of(&self, block: &Block, c: usize) -> [f64; 2] {
        let mut ends = [f64::INFINITY, 0.0];
        for (found, typical) in block.differences[c].iter().zip(&self.typical.differences[c]) {
            let ratio = if found == typical { 1.0 } else { found / typical };
            ends = [ends[0].min(ratio), ends[1].max(ratio)];
        }
        ends
    }

    /// Distance of a block from the long-run values, those of `of[c]` for channel c.
    fn distance(&self, block: &Block, of: [usize; CHANNELS]) -> f64 {
        let mut sum = 0.0;
        for (c, typical) in of.into_iter().enumerate() {
            for j in [0, 2] {
                let (found, typical) = (block.differences[c][j], self.typical.differences[typical][j]);
                // Zero compared with zero is not a difference.
                let log = if found == typical {
                    0.0
                } else {
                    libm::log(found / typical).abs()
                };
                sum += if log < LARGEST_LOG { log } else { LARGEST_LOG };
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

    fn known() -> Profile {
        let mut profile = Profile::new();
        for _ in 0..20 {
            let typical = block([0.02, 0.1], [0.1, 1.1]);
            assert_eq!(profile.judge(&typical, false), None);
            profile.update(&typical);
        }
        profile
    }

    /// Squares that underflow: infinite innovations are not a long-run value, and nothing panics after them.
    #[test]
    fn numbers_without_a_size_are_not_learnt() {
        let mut profile = known();
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
    fn each_trouble_has_its_name_and_ends() {
        let typical = block([0.02, 0.1], [0.1, 1.1]);
        let cases = [
            (block([0.0, 0.1], [0.1, 1.1]), Trouble::FrozenInput, 1),
            (block([0.02, 0.0], [0.1, 1.1]), Trouble::FrozenOutput, 3),
            (block([1e-4, 1e-4], [0.1, 1.1]), Trouble::Idle, 2),
            (block([0.2, 1.0], [0.1, 1.1]), Trouble::Larger, 2),
            (block([0.1, 0.1], [0.1, 1.1]), Trouble::RescaledInput, 2),
            (block([0.02, 0.45], [0.1, 1.1]), Trouble::RescaledOutput, 2),
            (block([0.1, 0.02], [1.1, 0.1]), Trouble::Swapped, 2),
            (
                Block {
                    innovation: 1.0,
                    ..typical
                },
                Trouble::Misfit,
                2,
            ),
        ];
        for (bad, trouble, after) in cases {
            let mut profile = known();
            for n in 1..=5 {
                let found = profile.judge(&bad, false);
                assert_eq!(found, (n >= after).then_some(trouble), "{n} {trouble:?}");
            }
            let left = (0..30).find(|_| profile.judge(&typical, false).is_none());
            assert!(left.is_some_and(|n| n <= 12), "{trouble:?}: {left:?}");
        }
    }

    /// A trouble only if e is constant too, or the control during the rest is not predicted: u is constant at its rest
    /// position and e continues.
    #[test]
    fn a_rest_is_not_frozen_but_a_rest_that_does_not_fit_is() {
        let still = block([0.02, 0.0], [0.1, 1.1]);
        let quiet = |innovation: f64, e: f64| Block {
            innovation,
            ..block([e, 0.0], [0.1, 1.1])
        };
        let after = |rests: bool, found: &Block| {
            let mut profile = known();
            (1..=20).find_map(|n| profile.judge(found, rests).map(|trouble| (n, trouble)))
        };
        assert_eq!(after(false, &still), Some((3, Trouble::FrozenOutput)));
        assert_eq!(after(true, &quiet(0.0, 0.02)), None);
        assert_eq!(after(true, &quiet(0.19, 0.02)), None);
        assert_eq!(after(true, &quiet(0.21, 0.02)), Some((3, Trouble::FrozenOutput)));
        assert_eq!(after(true, &quiet(0.0, 0.0)), Some((1, Trouble::FrozenInput)));
        // A channel that was trusted for long has had the trouble for as long.
        let mut profile = known();
        (0..9).for_each(|_| assert_eq!(profile.judge(&quiet(0.0, 0.02), true), None));
        let told = profile.judge(&quiet(0.0, 0.02), false);
        assert_eq!(told.map(|trouble| profile.lasting(trouble)), Some(10));
    }

    #[test]
    fn a_block_moves_the_long_run_values_by_a_sixtieth() {
        let mut profile = known();
        let before = *profile.typical();
        profile.update(&block([20.0, 100.0], [0.1, 1.1]));
        for c in 0..CHANNELS {
            let ratio = profile.typical().differences[c][0] / before.differences[c][0];
            assert!((1.0..1.02).contains(&ratio), "{ratio}");
        }
    }

    #[test]
    fn channels_that_are_alike_are_never_swapped() {
        let mut profile = Profile::new();
        let mut size = 0.1;
        for n in 0..200 {
            let found = block([size, size], [0.9, 0.9]);
            assert_eq!(profile.judge(&found, false), None, "{n}");
            profile.update(&found);
            size *= if n % 7 < 4 { 1.5 } else { 0.6 };
        }
    }
}
