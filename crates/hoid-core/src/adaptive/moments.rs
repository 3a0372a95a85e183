//! Step 4: the second moments of a block, which are a sufficient statistic for the likelihood of a hypothesis.
//!
//! After the whitening filter, a sample consists of the signals of the basis of each input and the level, `z` (seven
//! numbers for one input), and the output y. The response in a state x (gains, level, corrections) is `w(x)' z`. It is
//! bilinear in gains and corrections, so the block enters the likelihood only through
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
    bases::Bases,
    basis::Signals,
    sizes::{GAIN_COUNT, SIGNAL_COUNT, correction_places, first_gain, input_part},
};

/// Sums of products over a number of samples, for M numbers per sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moments<const M: usize> {
    /// Products of the signals, the level and the output; only the upper triangle is used.
    products: [[f64; M]; M],
    pub samples: f64,
}

crate::state!([const M: usize] Moments<M> { products, samples });

/// Gauss-Newton model of a block about a state.
#[derive(Debug, Clone, Copy)]
pub(super) struct LocalModel<const S: usize> {
    /// Information matrix, followed by the score, both multiplied by the innovation variance.
    pub information: [[f64; S]; S],
    pub score: [f64; S],
    /// Sum of the squared residuals at the state.
    pub energy: f64,
}

/// Weights of the signals and of the level; the last number, in the place of the output, is not used.
type Weights<const M: usize> = [f64; M];

impl<const M: usize> Moments<M> {
    pub const EMPTY: Self = Self {
        products: [[0.0; M]; M],
        samples: 0.0,
    };
    /// Place of the output and number of the weights; the level is at the place before it.
    const OUTPUT: usize = M - 1;

    /// Adds a whitened sample.
    #[inline(always)]
    pub fn add(&mut self, signals: &[Signals], level: f64, y: f64) {
        let mut z = [0.0; M];
        z[..Self::OUTPUT - 1].copy_from_slice(signals.as_flattened());
        (z[Self::OUTPUT - 1], z[Self::OUTPUT]) = (level, y);
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
    pub fn residual_energy<const I: usize, const S: usize>(&self, bases: &Bases<I>, state: &[f64; S]) -> f64 {
        self.residual_sums(&weights(bases, state)).1
    }

    /// Returns `sum z r` and `sum r^2`, where r are the residuals for the weights w of a response.
    fn residual_sums(&self, w: &Weights<M>) -> (Weights<M>, f64) {
        let (mut c, mut energy) = ([0.0; M], self.at(Self::OUTPUT, Self::OUTPUT));
        for i in 0..Self::OUTPUT {
            let response: f64 = (0..Self::OUTPUT).map(|k| self.at(i, k) * w[k]).sum();
            let with_output = self.at(i, Self::OUTPUT);
            c[i] = with_output - response;
            energy += w[i] * (response - 2.0 * with_output);
        }
        // If the energy is nearly zero, rounding can make it negative.
        (c, energy.max(0.0))
    }

    /// Gauss-Newton model of the block about a state.
    pub fn local_model<const I: usize, const S: usize>(&self, bases: &Bases<I>, state: &[f64; S]) -> LocalModel<S> {
        let w = weights(bases, state);
        let (c, energy) = self.residual_sums(&w);
        let t = weight_derivatives(bases, state, &w);
        let mut through: [Weights<M>; S] = [[0.0; M]; S];
        for (through, column) in through.iter_mut().zip(&t) {
            for i in 0..Self::OUTPUT {
                through[i] = (0..Self::OUTPUT).map(|k| self.at(i, k) * column[k]).sum();
            }
        }
        let mut information = [[0.0; S]; S];
        for i in 0..S {
            for j in i..S {
                let sum = (0..Self::OUTPUT).map(|k| t[i][k] * through[j][k]).sum();
                (information[i][j], information[j][i]) = (sum, sum);
            }
        }
        LocalModel {
            information,
            score: t.map(|column| (0..Self::OUTPUT).map(|k| column[k] * c[k]).sum()),
            energy,
        }
    }
}

/// Weights of the signals and of the level in the response at a state.
fn weights<const I: usize, const S: usize, const M: usize>(bases: &Bases<I>, state: &[f64; S]) -> Weights<M> {
    let mut w = [0.0; M];
    w[..I * SIGNAL_COUNT].copy_from_slice(bases.weights(state).as_flattened());
    w[I * SIGNAL_COUNT] = state[GAIN_COUNT];
    w
}

/// Derivatives of the weights `w` with respect to each element of the state. They are exact, because the weights are
/// bilinear in gains and corrections.
fn weight_derivatives<const I: usize, const S: usize, const M: usize>(
    bases: &Bases<I>,
    state: &[f64; S],
    w: &Weights<M>,
) -> [Weights<M>; S] {
    let mut t = [[0.0; M]; S];
    t[GAIN_COUNT][I * SIGNAL_COUNT] = 1.0;
    for input in 0..I {
        let (basis, (gains, corrections)) = (bases.of(input), input_part(state, input));
        let (first, at) = (first_gain(input), input * SIGNAL_COUNT);
        for i in 0..GAIN_COUNT {
            let mut one = [0.0; GAIN_COUNT];
            one[i] = 1.0;
            t[first + i][at..at + SIGNAL_COUNT].copy_from_slice(&basis.weights(&one, &corrections));
        }
        for (j, place) in correction_places(input).into_iter().enumerate() {
            let mut moved = corrections;
            moved[j] += 1.0;
            let there = basis.weights(&gains, &moved);
            for k in 0..SIGNAL_COUNT {
                t[place][at + k] = there[k] - w[at + k];
            }
        }
    }
    t
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::adaptive::{
        basis::Point,
        sizes::{STATE_COUNT, SUM_COUNT, state_count, sum_count},
    };

    fn bases<const I: usize>() -> Bases<I> {
        let point = |input: usize| Point {
            tau: 0.213 - 0.06 * input as f64,
            omega: 10.0,
            zeta: 0.3,
            lag: 3.0,
        };
        Bases::new(core::array::from_fn(point), 0.01).unwrap()
    }

    fn block<const I: usize, const M: usize>(mut y: impl FnMut(&[Signals; I], usize) -> f64) -> Moments<M> {
        let (mut bases, mut moments) = (bases::<I>(), Moments::EMPTY);
        for k in 0..40 {
            let z = bases.step(|input, age| {
                let t = (k + 2) as f64 - age as f64;
                libm::sin((0.37 - 0.09 * input as f64) * t) + libm::cos((0.11 + 0.04 * input as f64) * t)
            });
            moments.add(&z, 0.2, y(&z, k));
        }
        moments
    }

    const ONE_INPUT: [f64; STATE_COUNT] = [0.3, -0.2, 0.1, 0.4, 0.2, -0.03, 0.01];
    const TWO_INPUTS: [f64; state_count(2)] = [0.3, -0.2, 0.1, 0.4, 0.2, -0.03, 0.01, 0.2, 0.1, -0.3, -0.02];

    fn check_derivatives<const I: usize, const S: usize, const M: usize>(state: [f64; S]) {
        let moments = block::<I, M>(|_, k| libm::sin(k as f64));
        let about = moments.local_model(&bases::<I>(), &state);
        assert!((about.energy - moments.residual_energy(&bases::<I>(), &state)).abs() < 1e-12);
        for i in 0..S {
            // E has degree four in the state but is quadratic in each number, so a difference quotient is exact.
            let at = |step: f64| {
                let mut moved = state;
                moved[i] += step;
                moments.residual_energy(&bases::<I>(), &moved)
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
    fn score_and_information_match_difference_quotients() {
        check_derivatives::<1, STATE_COUNT, SUM_COUNT>(ONE_INPUT);
        check_derivatives::<2, { state_count(2) }, { sum_count(2) }>(TWO_INPUTS);
    }

    fn check_true_state<const I: usize, const S: usize, const M: usize>(state: [f64; S]) {
        let w: Weights<M> = weights(&bases::<I>(), &state);
        let moments = block::<I, M>(|z, _| {
            let response: f64 = z.as_flattened().iter().zip(w).map(|(z, w)| w * z).sum();
            response + state[GAIN_COUNT] * 0.2
        });
        let about = moments.local_model(&bases::<I>(), &state);
        assert!(about.energy < 1e-12 && about.score.iter().all(|s| s.abs() < 1e-9));
        assert_eq!(Moments::<M>::EMPTY.local_model(&bases::<I>(), &state).energy, 0.0);
    }

    #[test]
    fn true_state_leaves_no_residual() {
        check_true_state::<1, STATE_COUNT, SUM_COUNT>(ONE_INPUT);
        check_true_state::<2, { state_count(2) }, { sum_count(2) }>(TWO_INPUTS);
    }
}
