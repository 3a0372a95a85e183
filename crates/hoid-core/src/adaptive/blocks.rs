//! Normal equations over blocks of half a second, used by the change detector.
//!
//! Let r be the whitened regressors of gains and level, `q_j = sum_i theta_i dr_i/dj` the whitened regressors of the
//! dynamics, both at the current estimate, and p the corrections of the dynamics at a sample. To first order,
//!
//! `y + q' p = r' x + q' p_1 + eps`,
//!
//! where x are the unknown gains and level, and p_1 the unknown corrections. Each sample is weighted by the reciprocal
//! of the variance of eps, so the sums are in units of that variance. Each output is limited to a number of standard
//! deviations about its prediction. The dynamics have a weak prior at their current value, the same for all spans, so
//! two spans without information about the dynamics do not differ in them.

use hoid_numerics::{cholesky, products::dot};

use super::sizes::is_correction;

/// Ridge that is added to the diagonal, relative to the diagonal and divided by the number of samples.
const RELATIVE_RIDGE: f64 = 1e-3;

/// Row of one sample in the normal equations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row<const S: usize> {
    /// Regressors of gains and level, followed by the regressors of the dynamics.
    pub x: [f64; S],
    /// Output, with its innovation limited, plus `q' p`.
    pub y: f64,
    /// Innovation before limiting.
    pub innovation: f64,
    /// Variance of eps.
    pub variance: f64,
}

/// Sums over one block from which its normal equations are formed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Block<const S: usize, const P: usize> {
    /// Products of the regressors: the upper triangle, by rows.
    products: [f64; P],
    with_output: [f64; S],
    square: f64,
    pub samples: f64,
    /// Sum of the squares of the innovations before limiting.
    power: f64,
}

crate::state!([const S: usize, const P: usize] Block<S, P> { products, with_output, square, samples, power });

/// Solution of the normal equations `A x = b`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Solution<const S: usize> {
    pub state: [f64; S],
    /// `A^-1`.
    pub inverse: [[f64; S]; S],
    /// Residual sum of squares, including the contribution of the prior.
    pub residual_squares: f64,
}

impl<const S: usize, const P: usize> Block<S, P> {
    pub const EMPTY: Self = Self {
        products: [0.0; P],
        with_output: [0.0; S],
        square: 0.0,
        samples: 0.0,
        power: 0.0,
    };

    /// Adds the row of one sample to the sums.
    #[inline(always)]
    pub fn add(&mut self, row: &Row<S>) {
        let Row { x, y, .. } = row;
        let weight = 1.0 / row.variance;
        let mut k = 0;
        for i in 0..S {
            let a = weight * x[i];
            for x in &x[i..] {
                self.products[k] += a * x;
                k += 1;
            }
            self.with_output[i] += a * y;
        }
        self.square += weight * y * y;
        self.samples += 1.0;
        self.power += row.innovation * row.innovation;
    }

    fn merge(&mut self, other: &Self) {
        let sums = |to: &mut [f64], from: &[f64]| to.iter_mut().zip(from).for_each(|(t, f)| *t += f);
        sums(&mut self.products, &other.products);
        sums(&mut self.with_output, &other.with_output);
        self.square += other.square;
        self.samples += other.samples;
        self.power += other.power;
    }

    pub fn of(blocks: &[Self]) -> Self {
        blocks.iter().fold(Self::EMPTY, |mut sum, block| {
            sum.merge(block);
            sum
        })
    }

    /// Returns the block with a normal prior of the dynamics, of the given mean and standard deviations, added to its
    /// sums. Only the entries for the corrections are used.
    pub fn with_prior(mut self, mean: &[f64; S], deviations: &[f64; S]) -> Self {
        let mut diagonal = 0;
        for i in 0..S {
            if is_correction(i) {
                // The sums are in units of the variance of eps, so the weight of the prior is the reciprocal of its
                // variance.
                let weight = 1.0 / (deviations[i] * deviations[i]);
                self.products[diagonal] += weight;
                self.with_output[i] += weight * mean[i];
                self.square += weight * mean[i] * mean[i];
            }
            diagonal += S - i;
        }
        self
    }

    /// Mean square of the innovations before limiting.
    pub fn innovation_variance(&self) -> f64 {
        self.power / self.samples.max(1.0)
    }

    /// Matrix A of the normal equations.
    pub fn matrix(&self) -> [[f64; S]; S] {
        let mut matrix = [[0.0; S]; S];
        let mut k = 0;
        for i in 0..S {
            for j in i..S {
                (matrix[i][j], matrix[j][i]) = (self.products[k], self.products[k]);
                k += 1;
            }
        }
        matrix
    }

    /// Least-squares solution; `None` if the equations are singular or there are too few samples.
    pub fn solve(&self) -> Option<Solution<S>> {
        if self.samples <= S as f64 {
            return None;
        }
        let mut factor = self.matrix();
        for (i, row) in factor.iter_mut().enumerate() {
            row[i] *= 1.0 + RELATIVE_RIDGE / self.samples;
        }
        if !cholesky::factor(&mut factor, S) {
            return None;
        }
        let mut state = self.with_output;
        cholesky::solve(&factor, S, &mut state);
        let inverse = cholesky::scaled_inverse(&factor, S, 1.0);
        let residual_squares = (self.square - dot(&state, &self.with_output)).max(self.samples * 1e-12);
        Some(Solution {
            state,
            inverse,
            residual_squares,
        })
    }

    /// Score `b - A x` of a state x. Its expected value is zero at the true state.
    pub fn score(&self, state: &[f64; S]) -> [f64; S] {
        let matrix = self.matrix();
        core::array::from_fn(|i| self.with_output[i] - dot(&matrix[i], state))
    }
}
