//! Difference between two spans of data: two least-squares solutions, with a covariance estimated from their scores.
//!
//! The noise model whitens the residuals, but it resolves the spectrum in the frequency band of manual control poorly:
//! 16 lags at 100 Hz cover 0.16 s, whereas people's responses last for seconds. Where that spectrum is wrong by a
//! factor, `sigma^2 A^-1` is wrong by the same factor. The covariance of the score `g = b - A x` is therefore estimated
//! from the data as well (the sandwich of P. J. Huber, *Proc. Fifth Berkeley Symposium* 1 (1967) 221-233; H. White,
//! *Econometrica* 48 (1980) 817-838). With the scores `g_k` of stretches of one second, which are nearly independent
//! (W. K. Newey and K. D. West, *Econometrica* 55 (1987) 703-708),
//!
//! `S = sum_k g_k g_k' / (1 - (N + 3)/K)`, `W_i = w n_i/n S + (1 - w) sigma^2 A_i`,
//!
//! for K stretches in both spans together, N unknowns, and `n_i` of the n samples in span i. The divisor corrects for
//! two lost degrees of freedom, since the scores of each span sum to zero, and for the mean `K/(K - N - 1)` of an
//! inverse Wishart matrix. With few stretches S is uncertain; the term with `sigma^2` keeps the covariance positive
//! definite. The weight w is `EMPIRICAL_WEIGHT`. Then
//!
//! `d = x_1 - x_0`, `C = A_0^-1 W_0 A_0^-1 + A_1^-1 W_1 A_1^-1`.
//!
//! sigma^2 and S are common to both spans. With a separate variance for each span, a quiet second or a stronger remnant
//! would count as a change in the operator.

use hoid_numerics::{cholesky, products::dot};

use super::blocks::{Block, Solution};

pub(super) type Matrix<const S: usize> = [[f64; S]; S];

/// Number of blocks over which each score is summed.
const BLOCKS_PER_SCORE: usize = 2;
/// Weight w of the covariance estimated from the scores. `MODEL_ONLY_WEIGHT` is the weight at which only the covariance
/// given by the noise model is used.
pub(super) const EMPIRICAL_WEIGHT: f64 = 2.0 / 3.0;
pub(super) const MODEL_ONLY_WEIGHT: f64 = 0.0;
/// Lower limit of the divisor of S.
const MIN_DIVISOR: f64 = 0.3;

/// Difference between present and past in gains, level, natural frequency, damping and delay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contrast<const S: usize> {
    /// State of the present minus state of the past.
    pub difference: [f64; S],
    /// Covariance of the difference.
    pub covariance: Matrix<S>,
    /// State of the past, with corrections relative to the point of the basis.
    pub before: [f64; S],
    /// Covariance of the state of the past.
    pub covariance_before: Matrix<S>,
    /// Residual sum of squares over both spans.
    pub residual_squares: f64,
    /// Numbers of samples in the past and in the present.
    pub samples: [f64; 2],
}

crate::state!([const S: usize] Contrast<S> {
    difference,
    covariance,
    before,
    covariance_before,
    residual_squares,
    samples,
});

impl<const S: usize> Default for Contrast<S> {
    fn default() -> Self {
        Self {
            difference: [0.0; S],
            covariance: [[0.0; S]; S],
            before: [0.0; S],
            covariance_before: [[0.0; S]; S],
            residual_squares: 0.0,
            samples: [0.0; 2],
        }
    }
}

impl<const S: usize> Contrast<S> {
    /// Computes the difference between two spans; `empirical_share` is w.
    pub(super) fn of<const P: usize>(spans: &SolvedSpans<'_, S, P>, empirical_share: f64) -> Self {
        let SolvedSpans {
            sides, sums, solutions, ..
        } = spans;
        let mut scores = Scores::default();
        for (blocks, solution) in sides.iter().zip(solutions) {
            scores.add(blocks, &solution.state);
        }
        let samples = sums.each_ref().map(|s| s.samples);
        let [covariance_before, covariance_now] = core::array::from_fn(|side| {
            let of_score = scores.covariance(&sums[side], samples[0] + samples[1], empirical_share, spans.variance);
            sandwich(&solutions[side].inverse, &of_score)
        });
        let [before, now] = solutions;
        Self {
            difference: core::array::from_fn(|i| now.state[i] - before.state[i]),
            covariance: matrix_from_fn(|i, j| covariance_before[i][j] + covariance_now[i][j]),
            before: before.state,
            covariance_before,
            residual_squares: spans.residual_squares,
            samples,
        }
    }

    /// Returns the mean ratio of this covariance to the covariance of another contrast, `tr(C_other^-1 C)/N`, or `None`
    /// if the latter is not positive definite.
    pub(super) fn dispersion(&self, other: &Self) -> Option<f64> {
        let mut factor = other.covariance;
        if !cholesky::factor(&mut factor, S) {
            return None;
        }
        let mut trace = 0.0;
        for i in 0..S {
            let mut column = core::array::from_fn(|j| self.covariance[j][i]);
            cholesky::solve(&factor, S, &mut column);
            trace += column[i];
        }
        Some(trace / S as f64)
    }

    /// Returns this contrast with both covariances multiplied by a factor.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self {
            covariance: self.covariance.map(|row| row.map(|c| factor * c)),
            covariance_before: self.covariance_before.map(|row| row.map(|c| factor * c)),
            ..*self
        }
    }

    /// Returns the Wald statistic `d' C^-1 d` of the selected components, or `None` if their covariance C is not
    /// positive definite.
    pub(super) fn wald_statistic(&self, is_selected: impl Fn(usize) -> bool) -> Option<f64> {
        let (mut d, mut c, mut n) = ([0.0; S], [[0.0; S]; S], 0);
        for i in (0..S).filter(|i| is_selected(*i)) {
            d[n] = self.difference[i];
            for (j, place) in (0..S).filter(|j| is_selected(*j)).enumerate() {
                c[n][j] = self.covariance[i][place];
            }
            n += 1;
        }
        wald(d, c, n)
    }
}

/// Returns the Wald statistic `d' C^-1 d` of the first n components, or `None` if C is not positive definite.
pub(super) fn wald<const N: usize>(d: [f64; N], mut c: [[f64; N]; N], n: usize) -> Option<f64> {
    if !cholesky::factor(&mut c, n) {
        return None;
    }
    let mut solved = d;
    cholesky::solve(&c, n, &mut solved);
    let t = dot(&solved[..n], &d[..n]);
    t.is_finite().then_some(t)
}

/// Past and present, each with its sums and its least-squares solution.
#[derive(Debug, Clone)]
pub(super) struct SolvedSpans<'b, const S: usize, const P: usize> {
    pub sides: [&'b [Block<S, P>]; 2],
    pub sums: [Block<S, P>; 2],
    pub solutions: [Solution<S>; 2],
    /// Residual sum of squares over both spans.
    pub residual_squares: f64,
    /// Variance sigma^2 over both spans.
    pub variance: f64,
}

impl<'b, const S: usize, const P: usize> SolvedSpans<'b, S, P> {
    /// Solves both spans. `with_prior` adds a prior to the sums of each span. Returns `None` if the data of a span do
    /// not determine a state.
    pub fn new(sides: [&'b [Block<S, P>]; 2], with_prior: impl Fn(Block<S, P>) -> Block<S, P>) -> Option<Self> {
        let sums = sides.map(|blocks| with_prior(Block::of(blocks)));
        let solutions = [sums[0].solve()?, sums[1].solve()?];
        let samples = sums[0].samples + sums[1].samples;
        let residual_squares = solutions[0].residual_squares + solutions[1].residual_squares;
        let variance = residual_squares / (samples - 2.0 * S as f64).max(1.0);
        Some(Self {
            sides,
            sums,
            solutions,
            residual_squares,
            variance,
        })
    }
}

/// Sum of the outer products `g_k g_k'` of the scores of stretches of one second, and the number of stretches.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scores<const S: usize> {
    squares: Matrix<S>,
    stretches: f64,
}

impl<const S: usize> Default for Scores<S> {
    fn default() -> Self {
        Self {
            squares: [[0.0; S]; S],
            stretches: 0.0,
        }
    }
}

impl<const S: usize> Scores<S> {
    /// Adds the scores of a span at its least-squares solution.
    pub fn add<const P: usize>(&mut self, blocks: &[Block<S, P>], state: &[f64; S]) {
        for stretch in blocks.rchunks_exact(BLOCKS_PER_SCORE) {
            let score = Block::of(stretch).score(state);
            for (row, a) in self.squares.iter_mut().zip(score) {
                row.iter_mut().zip(score).for_each(|(s, b)| *s += a * b);
            }
            self.stretches += 1.0;
        }
    }

    /// Covariance W of the score of a span with the given sums. `samples` is the number n of samples that the scores
    /// come from, `empirical_share` is w, and `variance` is sigma^2.
    pub fn covariance<const P: usize>(
        &self,
        sums: &Block<S, P>,
        samples: f64,
        empirical_share: f64,
        variance: f64,
    ) -> Matrix<S> {
        let free = (1.0 - (S + 3) as f64 / self.stretches).max(MIN_DIVISOR);
        let share = empirical_share * sums.samples / (samples * free);
        let (model, matrix) = ((1.0 - empirical_share) * variance, sums.matrix());
        matrix_from_fn(|i, j| share * self.squares[i][j] + model * matrix[i][j])
    }
}

fn matrix_from_fn<const S: usize>(of: impl Fn(usize, usize) -> f64) -> Matrix<S> {
    core::array::from_fn(|i| core::array::from_fn(|j| of(i, j)))
}

/// Returns `A M A` for symmetric matrices.
pub(super) fn sandwich<const S: usize>(a: &Matrix<S>, m: &Matrix<S>) -> Matrix<S> {
    let product = |a: &Matrix<S>, b: &Matrix<S>| matrix_from_fn(|i, j| (0..S).map(|k| a[i][k] * b[k][j]).sum());
    product(&product(a, m), a)
}

#[cfg(test)]
pub(super) mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::adaptive::{
        blocks::Row,
        sizes::{GAIN_COUNT, PRODUCT_COUNT, STATE_COUNT},
    };

    /// Returns a number of the standard normal distribution, except for its tails.
    fn random_normal(state: &mut u64) -> f64 {
        let uniform = |state: &mut u64| {
            *state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (*state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform(state)).sum::<f64>() - 6.0
    }

    const STATE: [f64; STATE_COUNT] = [1.0, -0.5, 0.3, 0.2, 0.1, -0.2, 0.4];
    /// Number of samples in a block.
    const SAMPLES_PER_BLOCK: usize = 25;

    /// Returns blocks whose regressors and noise are first-order processes, with the pole 0.8 for the regressors and
    /// the given pole for the noise.
    pub fn blocks(
        count: usize,
        state: &[f64; STATE_COUNT],
        noise_pole: f64,
        random: &mut u64,
    ) -> std::vec::Vec<Block<STATE_COUNT, PRODUCT_COUNT>> {
        let (mut x, mut v) = ([0.0; STATE_COUNT], 0.0);
        let mut all = std::vec::Vec::new();
        for _ in 0..count {
            let mut block = Block::EMPTY;
            for _ in 0..SAMPLES_PER_BLOCK {
                for x in &mut x {
                    *x = 0.8 * *x + 0.6 * random_normal(random);
                }
                v = noise_pole * v + libm::sqrt(1.0 - noise_pole * noise_pole) * random_normal(random);
                let y: f64 = x.iter().zip(state).map(|(x, s)| x * s).sum();
                block.add(&Row {
                    x,
                    y: y + v,
                    innovation: v,
                    variance: 1.0,
                });
            }
            all.push(block);
        }
        all
    }

    /// Returns the mean of T and its standard error over a number of pairs of spans (60 blocks before, 10 blocks
    /// after), and the mean of T with the covariance given by the noise model.
    fn mean_distance(noise_pole: f64, runs: usize, seed: u64) -> [f64; 3] {
        let mut random = seed;
        let (mut sum, mut square, mut by_model) = (0.0, 0.0, 0.0);
        for _ in 0..runs {
            let all = blocks(70, &STATE, noise_pole, &mut random);
            let spans = SolvedSpans::new([&all[..60], &all[60..]], |sum| sum).unwrap();
            let contrast = Contrast::of(&spans, EMPIRICAL_WEIGHT);
            let t = contrast.wald_statistic(|i| i != GAIN_COUNT).unwrap();
            sum += t;
            square += t * t;
            let model = Contrast::of(&spans, MODEL_ONLY_WEIGHT);
            by_model += model.wald_statistic(|i| i != GAIN_COUNT).unwrap();
        }
        let n = runs as f64;
        let mean = sum / n;
        [mean, libm::sqrt((square / n - mean * mean) / n), by_model / n]
    }

    #[test]
    fn distance_is_chi_square_for_white_noise() {
        let [mean, error, by_model] = mean_distance(0.0, 400, 1);
        // The mean of 400 values with variance 12 has a standard error of .17; the margin is larger because S is
        // estimated from 35 stretches.
        assert!((by_model - 6.0).abs() < 0.7, "{by_model}");
        assert!((mean - 6.0).abs() < 1.0 && error < 0.3, "{mean} {error}");
    }

    #[test]
    fn empirical_covariance_corrects_for_coloured_noise() {
        let [mean, error, by_model] = mean_distance(0.9, 400, 2);
        // With the covariance given by the noise model, T is several times too large.
        assert!(by_model > 20.0, "{by_model}");
        assert!(mean < 10.0 && error < 0.5, "{mean} {error}");
    }

    #[test]
    fn dispersion_measures_the_error_of_the_noise_model() {
        for (pole, [low, high]) in [(0.0, [0.9, 1.6]), (0.9, [3.0, 12.0])] {
            let mut random = 5;
            let all = blocks(70, &STATE, pole, &mut random);
            let spans = SolvedSpans::new([&all[..60], &all[60..]], |sum| sum).unwrap();
            let [shown, model] = [1.0, MODEL_ONLY_WEIGHT].map(|w| Contrast::of(&spans, w));
            let times = shown.dispersion(&model).unwrap();
            assert!((low..high).contains(&times), "{pole}: {times}");
            assert!((model.scaled(times).dispersion(&model).unwrap() - times).abs() < 1e-9);
        }
    }

    #[test]
    fn change_and_values_before_it_are_estimated() {
        let mut random = 3;
        let mut all = blocks(60, &STATE, 0.0, &mut random);
        let changed = core::array::from_fn(|i| STATE[i] + if i == 1 { 1.0 } else { 0.0 });
        all.extend(blocks(10, &changed, 0.0, &mut random));
        let contrast = Contrast::of(
            &SolvedSpans::new([&all[..60], &all[60..]], |sum| sum).unwrap(),
            EMPIRICAL_WEIGHT,
        );
        assert!(contrast.wald_statistic(|i| i != GAIN_COUNT).unwrap() > 100.0);
        for i in 0..STATE_COUNT {
            let expected = if i == 1 { 1.0 } else { 0.0 };
            let error = libm::sqrt(contrast.covariance[i][i]);
            assert!((contrast.difference[i] - expected).abs() < 4.0 * error);
            let error = libm::sqrt(contrast.covariance_before[i][i]);
            assert!((contrast.before[i] - STATE[i]).abs() < 4.0 * error);
        }
    }

    #[test]
    fn empty_blocks_give_no_contrast() {
        let mut random = 4;
        let all = blocks(20, &STATE, 0.0, &mut random);
        assert!(SolvedSpans::new([&[], &all], |sum| sum).is_none());
        assert!(SolvedSpans::new([&all, &[Block::EMPTY; 4]], |sum| sum).is_none());
        let nothing = |sum: Block<STATE_COUNT, PRODUCT_COUNT>| sum;
        assert!(SolvedSpans::new([&[Block::EMPTY; 10], &[Block::EMPTY; 4]], nothing).is_none());
        assert!(
            Contrast::<STATE_COUNT>::default()
                .wald_statistic(|i| i != GAIN_COUNT)
                .is_none()
        );
    }
}
