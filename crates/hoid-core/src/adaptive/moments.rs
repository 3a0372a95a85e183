//! Step 4: the second moments of a block, which are a sufficient statistic for the likelihood of a hypothesis.
//!
//! After the whitening filter, a sample consists of the signals of the basis and the level, `z` (seven numbers), and
//! the output y. The response in a state x (gains, level, corrections) is `w(x)' z`. It is bilinear in gains and
//! corrections, so the block enters the likelihood only through
//!
//! `sum z z'`, `sum z y`, `sum y^2`.
//!
//! About a state x, with the derivatives `T = dw/dx` and the innovations `nu = y - w' z`, the Gauss-Newton model of the
//! block is
//!
//! `A = T' (sum z z') T`, `b = T' sum z nu`, `E = sum nu^2`
//!
//! (information, score and energy; the information and the score are multiplied by sigma^2). `H = z' T` is the
//! measurement row of a sample.

use super::{
    basis::Basis,
    sizes::{DYNAMICS_COUNT, GAIN_COUNT, INPUT_COUNT, LINEAR_COUNT, SIGNAL_COUNT, STATE_COUNT},
};

const SUM_COUNT: usize = INPUT_COUNT + 1;

/// Sums of products over a number of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moments {
    /// Products of the signals, the level and the output; only the upper triangle is used.
    products: [[f64; SUM_COUNT]; SUM_COUNT],
    pub samples: f64,
}

crate::state!([] Moments { products, samples });

/// Gauss-Newton model of a block about a state.
#[derive(Debug, Clone, Copy)]
pub(super) struct LocalModel {
    /// Information matrix, followed by the score, both multiplied by the innovation variance.
    pub information: [[f64; STATE_COUNT]; STATE_COUNT],
    pub score: [f64; STATE_COUNT],
    /// Sum of the squared residuals at the state.
    pub energy: f64,
}

impl Moments {
    pub const EMPTY: Self = Self {
        products: [[0.0; SUM_COUNT]; SUM_COUNT],
        samples: 0.0,
    };

    /// Adds a whitened sample.
    #[inline(always)]
    pub fn add(&mut self, signals: &[f64; SIGNAL_COUNT], level: f64, y: f64) {
        let mut z = [0.0; SUM_COUNT];
        z[..SIGNAL_COUNT].copy_from_slice(signals);
        (z[SIGNAL_COUNT], z[INPUT_COUNT]) = (level, y);
        // Whole rows are summed: the entries below the diagonal are not used, but the loop has a constant length.
        for (row, a) in self.products.iter_mut().zip(z) {
            for (sum, b) in row.iter_mut().zip(z) {
                *sum += a * b;
            }
        }
        self.samples += 1.0;
    }

    /// Returns the sums over the samples of `self` and of `others`.
    pub fn merged(&self, others: &Self) -> Self {
        Self {
            products: core::array::from_fn(|i| core::array::from_fn(|j| self.products[i][j] + others.products[i][j])),
            samples: self.samples + others.samples,
        }
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.products[i.min(j)][i.max(j)]
    }

    /// Sum of the squared residuals at a state.
    pub fn residual_energy(&self, basis: &Basis, state: &[f64; STATE_COUNT]) -> f64 {
        self.residual_sums(&weights(basis, state)).1
    }

    /// Returns `sum z r` and `sum r^2`, where r are the residuals for the weights w of a response.
    fn residual_sums(&self, w: &[f64; INPUT_COUNT]) -> ([f64; INPUT_COUNT], f64) {
        let (mut c, mut energy) = ([0.0; INPUT_COUNT], self.at(INPUT_COUNT, INPUT_COUNT));
        for i in 0..INPUT_COUNT {
            let response: f64 = (0..INPUT_COUNT).map(|k| self.at(i, k) * w[k]).sum();
            let with_output = self.at(i, INPUT_COUNT);
            c[i] = with_output - response;
            energy += w[i] * (response - 2.0 * with_output);
        }
        // If the energy is nearly zero, rounding can make it negative.
        (c, energy.max(0.0))
    }

    /// Gauss-Newton model of the block about a state.
    pub fn local_model(&self, basis: &Basis, state: &[f64; STATE_COUNT]) -> LocalModel {
        let w = weights(basis, state);
        let (c, energy) = self.residual_sums(&w);
        let t = weight_derivatives(basis, state, &w);
        let through: [[f64; INPUT_COUNT]; STATE_COUNT] =
            t.map(|column| core::array::from_fn(|i| (0..INPUT_COUNT).map(|k| self.at(i, k) * column[k]).sum()));
        let mut information = [[0.0; STATE_COUNT]; STATE_COUNT];
        for i in 0..STATE_COUNT {
            for j in i..STATE_COUNT {
                let sum = (0..INPUT_COUNT).map(|k| t[i][k] * through[j][k]).sum();
                (information[i][j], information[j][i]) = (sum, sum);
            }
        }
        LocalModel {
            information,
            score: t.map(|column| (0..INPUT_COUNT).map(|k| column[k] * c[k]).sum()),
            energy,
        }
    }
}

/// Weights of the signals and of the level in the response at a state.
pub(super) fn weights(basis: &Basis, state: &[f64; STATE_COUNT]) -> [f64; INPUT_COUNT] {
    let mut w = [0.0; INPUT_COUNT];
    w[..SIGNAL_COUNT].copy_from_slice(&basis.weights(state));
    w[SIGNAL_COUNT] = state[GAIN_COUNT];
    w
}

/// Derivatives of the weights `w` with respect to each element of the state. They are exact, because the weights are
/// bilinear in gains and corrections.
fn weight_derivatives(
    basis: &Basis,
    state: &[f64; STATE_COUNT],
    w: &[f64; INPUT_COUNT],
) -> [[f64; INPUT_COUNT]; STATE_COUNT] {
    let mut t = [[0.0; INPUT_COUNT]; STATE_COUNT];
    for i in 0..GAIN_COUNT {
        let mut one = *state;
        one[..LINEAR_COUNT].fill(0.0);
        one[i] = 1.0;
        t[i] = weights(basis, &one);
    }
    t[GAIN_COUNT][SIGNAL_COUNT] = 1.0;
    for j in 0..DYNAMICS_COUNT {
        let mut moved = *state;
        moved[LINEAR_COUNT + j] += 1.0;
        let there = weights(basis, &moved);
        t[LINEAR_COUNT + j] = core::array::from_fn(|k| there[k] - w[k]);
    }
    t
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::adaptive::basis::Point;

    fn basis() -> Basis {
        let point = Point {
            tau: 0.213,
            omega: 10.0,
            zeta: 0.3,
            lag: 3.0,
        };
        Basis::new(point, 0.01).unwrap()
    }

    fn block(mut y: impl FnMut(&[f64; SIGNAL_COUNT], usize) -> f64) -> Moments {
        let (mut basis, mut moments) = (basis(), Moments::EMPTY);
        for k in 0..40 {
            let e = |k: usize| libm::sin(0.37 * k as f64) + libm::cos(0.11 * k as f64);
            let z = basis.step([e(k + 2), e(k + 1), e(k)]);
            moments.add(&z, 0.2, y(&z, k));
        }
        moments
    }

    #[test]
    fn score_and_information_match_difference_quotients() {
        let state = [0.3, -0.2, 0.1, 0.4, 0.2, -0.03, 0.01];
        let moments = block(|_, k| libm::sin(k as f64));
        let about = moments.local_model(&basis(), &state);
        assert!((about.energy - moments.residual_energy(&basis(), &state)).abs() < 1e-12);
        for i in 0..STATE_COUNT {
            // E has degree four in the state but is quadratic in each number, so a difference quotient is exact.
            let at = |step: f64| {
                let mut moved = state;
                moved[i] += step;
                moments.residual_energy(&basis(), &moved)
            };
            let h = 1e-4;
            let slope = (at(h) - at(-h)) / (2.0 * h);
            let curvature = (at(h) - 2.0 * at(0.0) + at(-h)) / (h * h);
            let size = about.information[i][i].abs().max(1e-9);
            assert!(
                (slope + 2.0 * about.score[i]).abs() < 1e-6 * (slope.abs() + size),
                "{i}"
            );
            assert!(
                (curvature - 2.0 * about.information[i][i]).abs() < 1e-4 * size + 1e-6,
                "{i}"
            );
        }
    }

    #[test]
    fn true_state_leaves_no_residual() {
        let state = [0.3, -0.2, 0.1, 0.4, 0.2, -0.03, 0.01];
        let w = weights(&basis(), &state);
        let moments = block(|z, _| (0..SIGNAL_COUNT).map(|k| w[k] * z[k]).sum::<f64>() + w[SIGNAL_COUNT] * 0.2);
        let about = moments.local_model(&basis(), &state);
        assert!(about.energy < 1e-12 && about.score.iter().all(|s| s.abs() < 1e-9));
        assert_eq!(Moments::EMPTY.local_model(&basis(), &state).energy, 0.0);
    }
}
