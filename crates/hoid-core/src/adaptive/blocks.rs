//! Sums over blocks of half a second, and what the last of them say against those before.
//!
//! Behind the whitening filter, with the regressors of gains and level r, those of what is held
//! `q_j = sum_i theta_i dx_i/dj`, both where the estimate is at that sample, and the held values p of
//! that sample, about those of the basis,
//!
//! `y = r' s + eps` (what is held is known), `y + q' p = r' s + q' p' + eps` (it is not),
//!
//! the second to first order. Each sample counts as one over the variance of eps and is limited to some standard
//! deviations about its prediction. Least squares over a span of blocks has the covariance `sigma^2
//! A^-1` with a variance of its own. What is held has a weak prior at where it is now, the same for all
//! spans: where the data say nothing of it, two spans do not differ.

use super::{
    cholesky,
    sizes::{HELD, LINEAR, STATES},
};

/// Products of the upper triangle.
const PRODUCTS: usize = LINEAR * (LINEAR + 1) / 2;
const HELD_PRODUCTS: usize = HELD * (HELD + 1) / 2;
/// Share of the diagonal that is added to it.
const RIDGE: f64 = 1e-3;

/// What a sample says.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row {
    /// Regressors of gains and level, and of what is held.
    pub r: [f64; LINEAR],
    pub q: [f64; HELD],
    /// What is held, about where the basis was made.
    pub p: [f64; HELD],
    /// Limited output.
    pub y: f64,
    /// Innovation as it is.
    pub innovation: f64,
    /// Variance of eps.
    pub variance: f64,
}

/// Sums of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Block {
    products: [f64; PRODUCTS],
    with_output: [f64; LINEAR],
    square: f64,
    pub samples: f64,
    /// Squares of the innovations as they are.
    power: f64,
    /// Those of q: with r, with itself, with `y + q' p`; r with that, and its square.
    mixed: [[f64; LINEAR]; HELD],
    held: [f64; HELD_PRODUCTS],
    held_with_output: [f64; HELD],
    shifted: [f64; LINEAR],
    shifted_square: f64,
}

crate::state!([] Block {
    products, with_output, square, samples, power, mixed, held, held_with_output, shifted, shifted_square,
});

pub(super) const EMPTY: Block = Block {
    products: [0.0; PRODUCTS],
    with_output: [0.0; LINEAR],
    square: 0.0,
    samples: 0.0,
    power: 0.0,
    mixed: [[0.0; LINEAR]; HELD],
    held: [0.0; HELD_PRODUCTS],
    held_with_output: [0.0; HELD],
    shifted: [0.0; LINEAR],
    shifted_square: 0.0,
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

/// Gains, level and what is held (about where the basis was made) of one of the two spans.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WholeSpan {
    /// Gains, level, held.
    pub state: [f64; STATES],
    /// Their covariance.
    pub covariance: [[f64; STATES]; STATES],
    /// Sum of the squares of what is left, in the variance of eps, the prior's among them.
    pub left: f64,
}

crate::state!([] WholeSpan { state, covariance, left });

impl Block {
    /// Takes a sample.
    #[inline(always)]
    pub fn add(&mut self, row: &Row) {
        let Row { r, q, p, y, .. } = row;
        let weight = 1.0 / row.variance;
        let mut shifted = *y;
        for j in 0..HELD {
            shifted += q[j] * p[j];
        }
        let mut k = 0;
        for i in 0..LINEAR {
            let a = weight * r[i];
            for r in &r[i..] {
                self.products[k] += a * r;
                k += 1;
            }
            self.with_output[i] += a * y;
            self.shifted[i] += a * shifted;
        }
        k = 0;
        for j in 0..HELD {
            let a = weight * q[j];
            for (mixed, r) in self.mixed[j].iter_mut().zip(r) {
                *mixed += a * r;
            }
            for q in &q[j..] {
                self.held[k] += a * q;
                k += 1;
            }
            self.held_with_output[j] += a * shifted;
        }
        self.square += weight * y * y;
        self.shifted_square += weight * shifted * shifted;
        self.samples += 1.0;
        self.power += row.innovation * row.innovation;
    }

    fn join(&mut self, other: &Self) {
        let sums = |to: &mut [f64], from: &[f64]| to.iter_mut().zip(from).for_each(|(t, f)| *t += f);
        sums(&mut self.products, &other.products);
        sums(&mut self.with_output, &other.with_output);
        sums(self.mixed.as_flattened_mut(), other.mixed.as_flattened());
        sums(&mut self.held, &other.held);
        sums(&mut self.held_with_output, &other.held_with_output);
        sums(&mut self.shifted, &other.shifted);
        self.square += other.square;
        self.shifted_square += other.shifted_square;
        self.samples += other.samples;
        self.power += other.power;
    }

    pub fn of(blocks: &[Self]) -> Self {
        blocks.iter().fold(EMPTY, |mut sum, block| {
            sum.join(block);
            sum
        })
    }

    /// Least squares with what is held known.
    pub fn fit(&self) -> Option<Span> {
        let n = self.samples;
        if n <= LINEAR as f64 {
            return None;
        }
        let mut matrix = [[0.0; LINEAR]; LINEAR];
        self.fill(&mut matrix);
        let (state, covariance, _) = solved(matrix, self.with_output, self.square, n)?;
        Some(Span {
            state,
            covariance,
            variance: self.power / n,
            samples: n,
        })
    }

    /// The same with what is held not known, but for a prior of this mean and these standard
    /// deviations.
    pub fn fit_whole(&self, mean: [f64; HELD], deviations: [f64; HELD]) -> Option<WholeSpan> {
        let n = self.samples;
        if n <= STATES as f64 {
            return None;
        }
        let mut matrix = [[0.0; STATES]; STATES];
        self.fill(&mut matrix);
        let mut with_output = [0.0; STATES];
        with_output[..LINEAR].copy_from_slice(&self.shifted);
        let mut square = self.shifted_square;
        let mut k = 0;
        for j in 0..HELD {
            let own = LINEAR + j;
            for i in 0..LINEAR {
                (matrix[own][i], matrix[i][own]) = (self.mixed[j][i], self.mixed[j][i]);
            }
            for other in own..STATES {
                (matrix[own][other], matrix[other][own]) = (self.held[k], self.held[k]);
                k += 1;
            }
            with_output[own] = self.held_with_output[j];
            // The sums are in units of the variance of eps, so that the prior counts as it is.
            let weight = 1.0 / (deviations[j] * deviations[j]);
            matrix[own][own] += weight;
            with_output[own] += weight * mean[j];
            square += weight * mean[j] * mean[j];
        }
        let (state, covariance, variance) = solved(matrix, with_output, square, n)?;
        Some(WholeSpan {
            state,
            covariance,
            left: variance * (n - STATES as f64),
        })
    }

    fn fill<const N: usize>(&self, matrix: &mut [[f64; N]; N]) {
        let mut k = 0;
        for i in 0..LINEAR {
            for j in i..LINEAR {
                (matrix[i][j], matrix[j][i]) = (self.products[k], self.products[k]);
                k += 1;
            }
        }
    }
}

/// Solution, covariance and variance of normal equations.
fn solved<const N: usize>(
    mut matrix: [[f64; N]; N],
    with_output: [f64; N],
    square: f64,
    n: f64,
) -> Option<([f64; N], [[f64; N]; N], f64)> {
    for (i, row) in matrix.iter_mut().enumerate() {
        row[i] *= 1.0 + RIDGE / n;
    }
    if !cholesky::factor(&mut matrix, N) {
        return None;
    }
    let mut state = with_output;
    cholesky::solve(&matrix, N, &mut state);
    let explained: f64 = state.iter().zip(with_output).map(|(s, b)| s * b).sum();
    let variance = ((square - explained) / (n - N as f64)).max(1e-12);
    let mut covariance = [[0.0; N]; N];
    for (i, row) in covariance.iter_mut().enumerate() {
        row[i] = variance;
        cholesky::solve(&matrix, N, row);
    }
    Some((state, covariance, variance))
}
