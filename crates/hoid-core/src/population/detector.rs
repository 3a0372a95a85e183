//! Has the person changed? Y at one frequency, now against before.
//!
//! Blocks of half a second hold the sums of `r r'`, `r y` and `y^2` behind the whitening filter, each
//! sample over the variance of eps and limited to some standard deviations about its prediction.
//! Least squares over the last blocks and over those before give `s_1, s_0` with the covariances
//! `sigma_1^2 A_1^-1`, `sigma_0^2 A_0^-1`, each with a variance of its own. With the responses
//! `h = [Re, Im]` of the basis at [`Detection::frequency`] the difference `d = h (s_1 - s_0)` has the
//! covariance C, and
//!
//! `T = d' C^-1 d`
//!
//! is chi-square with two degrees of freedom where nothing changes and the basis is right. People
//! vary, and no basis is right: T is divided by the level c at which it has been so far, from the
//! mean of log T, whose expectation for a chi-square with two degrees of freedom is
//! `ln 2 - gamma = .116`. A change is declared where T/c is above the threshold in some blocks one
//! after another.
//!
//! Sources: G. C. Chow, *Econometrica* 28 (1960) 591-605; B. L. Welch, *Biometrika* 34 (1947) 28-35;
//! the mean of the logarithm: M. Abramowitz and I. A. Stegun, 1964, eq. 6.3.3.

use super::{
    basis::Complex,
    cholesky,
    sizes::{GAINS, LINEAR},
};

/// Blocks that there is room for.
pub const BLOCKS: usize = 90;
/// Length of a block, s.
pub const BLOCK_S: f64 = 0.5;
/// Expectation of the logarithm of a chi-square with two degrees of freedom.
const MEAN_LOG: f64 = 0.115_931_515_658_412_45;
/// Blocks that the supposed level of T counts for, and the logarithm of that level.
const SUPPOSED: f64 = 5.0;
const USUAL: f64 = 0.5;
/// Blocks that the level is a mean of at most.
const LONGEST: f64 = 240.0;
/// By so much a logarithm raises the level at most: a change is no usual variation.
const MOST: f64 = 3.0;
/// Share of the diagonal that is added to it.
const RIDGE: f64 = 1e-3;
/// Products of the upper triangle.
const PRODUCTS: usize = LINEAR * (LINEAR + 1) / 2;

/// What the detector looks at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Frequency, rad/s.
    pub frequency: f64,
    /// Blocks of the present, and least and largest number of those before.
    pub recent: usize,
    /// Least number of blocks before.
    pub least: usize,
    /// Largest number of blocks before.
    pub most: usize,
    /// T/c from which there is a change.
    pub threshold: f64,
    /// Blocks in which it must be above.
    pub persistence: u64,
    /// Blocks after a change in which none is declared.
    pub refractory: u64,
}

/// Sums of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Block {
    products: [f64; PRODUCTS],
    with_output: [f64; LINEAR],
    square: f64,
    samples: f64,
    /// Squares of the innovations as they are.
    power: f64,
}

crate::state!([] Block { products, with_output, square, samples, power });

const EMPTY: Block = Block {
    products: [0.0; PRODUCTS],
    with_output: [0.0; LINEAR],
    square: 0.0,
    samples: 0.0,
    power: 0.0,
};

/// Gains of one of the two spans, with their covariance and the variance of eps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Span {
    /// Gains and level.
    pub state: [f64; LINEAR],
    /// Their covariance.
    pub covariance: [[f64; LINEAR]; LINEAR],
    /// Variance of eps.
    pub variance: f64,
    /// Samples.
    pub samples: f64,
}

crate::state!([] Span { state, covariance, variance, samples });

/// The blocks and what they say.
#[derive(Debug, Clone, PartialEq)]
pub struct Detector {
    what: Detection,
    response: [Complex; GAINS],
    samples_of_block: u64,
    block: Block,
    blocks: [Block; BLOCKS],
    count: usize,
    level: f64,
    levels: f64,
    statistic: f64,
    above: u64,
    since: u64,
    spans: [Span; 2],
    declared: bool,
}

crate::state!([] Detector {
    response, block, blocks, count, level, levels, statistic, above, since, spans, declared,
});

impl Detector {
    /// Without blocks. `response` is that of the basis at the frequency, Ts in s. `None` where there
    /// is no room for the blocks.
    pub fn new(what: Detection, response: [Complex; GAINS], ts: f64) -> Option<Self> {
        let room = what.recent > 0 && what.least > 0 && what.least <= what.most && what.recent + what.most <= BLOCKS;
        room.then_some(Self {
            what,
            response,
            samples_of_block: libm::round(BLOCK_S / ts).max(1.0) as u64,
            block: EMPTY,
            blocks: [EMPTY; BLOCKS],
            count: 0,
            level: MEAN_LOG + USUAL,
            levels: SUPPOSED,
            statistic: 0.0,
            above: 0,
            since: u64::MAX >> 12,
            spans: [Span::default(); 2],
            declared: false,
        })
    }

    /// Takes a sample: regressors and limited output behind the whitening filter, the innovation, and
    /// the variance of eps. True where a change is declared.
    #[inline]
    pub fn update(&mut self, r: &[f64; LINEAR], y: f64, innovation: f64, variance: f64) -> bool {
        self.declared = false;
        let weight = 1.0 / variance;
        let block = &mut self.block;
        let mut k = 0;
        for i in 0..LINEAR {
            let a = weight * r[i];
            for r in &r[i..] {
                block.products[k] += a * r;
                k += 1;
            }
            block.with_output[i] += a * y;
        }
        block.square += weight * y * y;
        block.samples += 1.0;
        block.power += innovation * innovation;
        if block.samples >= self.samples_of_block as f64 {
            self.close();
        }
        self.declared
    }

    /// Ends a block.
    fn close(&mut self) {
        if self.count == self.what.recent + self.what.most {
            self.blocks.copy_within(1..self.count, 0);
            self.count -= 1;
        }
        self.blocks[self.count] = self.block;
        self.count += 1;
        self.block = EMPTY;
        self.since += 1;
        self.statistic = 0.0;
        let before = self.count.saturating_sub(self.what.recent);
        if before < self.what.least {
            self.above = 0;
            return;
        }
        let (Some(past), Some(present)) = (fit(&self.blocks[..before]), fit(&self.blocks[before..self.count])) else {
            return;
        };
        self.spans = [past, present];
        let Some(t) = self.distance() else { return };
        let c = libm::exp(self.level - MEAN_LOG).max(1.0);
        self.statistic = t / c;
        self.levels = (self.levels + 1.0).min(SUPPOSED + LONGEST);
        let log = libm::log(t.max(0.05)).min(self.level + MOST);
        self.level += (log - self.level) / self.levels;
        self.above = if self.statistic > self.what.threshold {
            self.above + 1
        } else {
            0
        };
        if self.above >= self.what.persistence && self.since > self.what.refractory {
            self.declared = true;
            self.since = 0;
            self.above = 0;
            // What was before is no measure of what comes.
            self.blocks.copy_within(before..self.count, 0);
            self.count = self.what.recent;
        }
    }

    /// The response of the gains at the frequency is this from now on.
    pub fn look_at(&mut self, response: [Complex; GAINS]) {
        self.response = response;
    }

    /// T; `None` where the spans say nothing of the frequency.
    fn distance(&self) -> Option<f64> {
        let [past, present] = &self.spans;
        let (mut d, mut c) = ([0.0; 2], [[0.0; 2]; 2]);
        for i in 0..GAINS {
            for (part, d) in d.iter_mut().enumerate() {
                *d += self.response[i][part] * (present.state[i] - past.state[i]);
            }
            for j in 0..GAINS {
                let both = past.covariance[i][j] + present.covariance[i][j];
                for a in 0..2 {
                    for b in 0..2 {
                        c[a][b] += self.response[i][a] * both * self.response[j][b];
                    }
                }
            }
        }
        let determinant = c[0][0] * c[1][1] - c[0][1] * c[1][0];
        let t = (d[0] * d[0] * c[1][1] - 2.0 * d[0] * d[1] * c[0][1] + d[1] * d[1] * c[0][0]) / determinant;
        (determinant > 0.0 && t.is_finite()).then_some(t)
    }

    /// T/c of the last block; zero while there is too little to compare.
    pub fn statistic(&self) -> f64 {
        self.statistic
    }

    /// How many times larger than a chi-square T has been without a change.
    pub fn usual_level(&self) -> f64 {
        libm::exp(self.level - MEAN_LOG).max(1.0)
    }

    /// Before and now, at the last block.
    pub fn spans(&self) -> &[Span; 2] {
        &self.spans
    }

    /// True where a change was declared at the last sample.
    pub fn declared(&self) -> bool {
        self.declared
    }

    /// No change is declared at a sample that is not taken.
    pub fn skip(&mut self) {
        self.declared = false;
    }
}

/// Least squares over blocks.
fn fit(blocks: &[Block]) -> Option<Span> {
    let mut sum = EMPTY;
    for block in blocks {
        for (s, p) in sum.products.iter_mut().zip(block.products) {
            *s += p;
        }
        for (s, b) in sum.with_output.iter_mut().zip(block.with_output) {
            *s += b;
        }
        sum.square += block.square;
        sum.samples += block.samples;
        sum.power += block.power;
    }
    let n = sum.samples;
    if n <= LINEAR as f64 {
        return None;
    }
    let mut matrix = [[0.0; LINEAR]; LINEAR];
    let mut k = 0;
    for i in 0..LINEAR {
        for j in i..LINEAR {
            (matrix[i][j], matrix[j][i]) = (sum.products[k], sum.products[k]);
            k += 1;
        }
        matrix[i][i] *= 1.0 + RIDGE / n;
    }
    if !cholesky::factor(&mut matrix, LINEAR) {
        return None;
    }
    let mut state = sum.with_output;
    cholesky::solve(&matrix, LINEAR, &mut state);
    let explained: f64 = state.iter().zip(sum.with_output).map(|(s, b)| s * b).sum();
    let variance = ((sum.square - explained) / (n - LINEAR as f64)).max(1e-12);
    let mut covariance = [[0.0; LINEAR]; LINEAR];
    for (i, row) in covariance.iter_mut().enumerate() {
        row[i] = variance;
        cholesky::solve(&matrix, LINEAR, row);
    }
    Some(Span {
        state,
        covariance,
        variance: sum.power / n,
        samples: n,
    })
}
