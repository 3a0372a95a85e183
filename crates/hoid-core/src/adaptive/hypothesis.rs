//! Hypothesis about the time of the last change: the operator changed when the hypothesis was born, and has since
//! drifted slowly or not at all.
//!
//! Each hypothesis is an extended Kalman filter for `x = [gains, level, corrections]` that processes one block of
//! samples at a time ([`super::moments`]). With the estimate x^ and its covariance P before the block, and the
//! innovation variance `sigma^2`,
//!
//! `P+ = (I + P A/sigma^2)^-1 P`, `x+ = x^ + P+ b/sigma^2`,
//! `ln Lambda = -1/2 ln det(I + P A/sigma^2) - (E - b' P+ b/sigma^2)/(2 sigma^2) + ..`
//!
//! (Y. Bar-Shalom, X. R. Li and T. Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 2001,
//! section 7.2, information form). `(I + P A/sigma^2)^-1 P` needs no inverse of P, which is singular if the three gains
//! are restricted to a gain with a lead.
//!
//! Each hypothesis has its own innovation variance, so a change in the remnant can be part of a change. Since this
//! variance is estimated, the part of the block energy common to all hypotheses has a Student density with the degrees
//! of freedom of the variance (A. Zellner, *An Introduction to Bayesian Inference in Econometrics*, 1971, section 3.2).

use hoid_numerics::elimination;

use super::{bases::Bases, moments::Moments, segments::Segment, sizes::MAX_SEGMENTS};

pub(super) type Covariance<const S: usize> = [[f64; S]; S];

/// Hypothesis about the last change in the operator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hypothesis<const S: usize> {
    pub state: [f64; S],
    pub covariance: Covariance<S>,
    /// Innovation variance, followed by its degrees of freedom.
    pub variance: f64,
    pub residuals: f64,
    pub log_weight: f64,
    /// Block at which the hypothesis was born; zero for the initial hypotheses.
    pub born: u64,
    pub class: usize,
    segments: [Segment<S>; MAX_SEGMENTS],
    changes: usize,
}

crate::state!([const S: usize] Hypothesis<S> { state, covariance, variance, residuals, log_weight, born, class, segments, changes });

/// Residual energy of a block for a hypothesis, with the other quantities in its likelihood.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockResidual {
    /// `E - b' P+ b/sigma^2`: the sum of the squared innovations, whitened by their covariance `S = H P H' + sigma^2`,
    /// times sigma^2.
    pub energy: f64,
    /// Number of samples of the block that the hypothesis skipped, and the residual energy charged for them.
    pub passed: [f64; 2],
    /// `ln det(I + P A/sigma^2)`.
    log_determinant: f64,
}

impl BlockResidual {
    pub const ZERO: Self = Self {
        energy: 0.0,
        passed: [0.0; 2],
        log_determinant: 0.0,
    };
}

impl<const S: usize> Hypothesis<S> {
    pub fn new(state: [f64; S], covariance: Covariance<S>, variance: f64, class: usize, log_weight: f64) -> Self {
        Self {
            state,
            covariance,
            variance,
            residuals: 20.0,
            log_weight,
            born: 0,
            class,
            segments: [Segment {
                until: 0,
                state: [0.0; S],
            }; MAX_SEGMENTS],
            changes: 0,
        }
    }

    pub fn weight(&self) -> f64 {
        libm::exp(self.log_weight)
    }

    /// Segments between earlier changes, the oldest first.
    pub fn segments(&self) -> &[Segment<S>] {
        &self.segments[..self.changes.min(MAX_SEGMENTS)]
    }

    /// Returns the child hypothesis, which assumes that the operator changed in the given block.
    pub fn child(&self, block: u64) -> Self {
        let mut child = *self;
        let changes = self.changes.min(MAX_SEGMENTS);
        if changes == MAX_SEGMENTS {
            child.segments.copy_within(1.., 0);
        }
        let last = changes.min(MAX_SEGMENTS - 1);
        child.segments[last] = Segment {
            until: block,
            state: self.state,
        };
        (child.changes, child.born) = (last + 1, block);
        child
    }

    /// Step 6: computes the gain and updates state and covariance with a block, in which each sample counts as
    /// `1/dispersion` of an independent sample.
    pub fn update<const I: usize, const M: usize>(
        &mut self,
        moments: &Moments<M>,
        bases: &Bases<I>,
        dispersion: f64,
    ) -> BlockResidual {
        // The block is linearised about the predicted state, since the response is bilinear in gains and corrections.
        let about = moments.local_model(bases, &self.state);
        let per = 1.0 / (self.variance * dispersion);
        let mut matrix: Covariance<S> = core::array::from_fn(|i| {
            core::array::from_fn(|j| {
                let product: f64 = (0..S).map(|k| self.covariance[i][k] * about.information[k][j]).sum();
                product * per
            })
        });
        (0..S).for_each(|i| matrix[i][i] += 1.0);
        // Solving (I + P A/sigma^2) P+ = P also gives the determinant of I + P A/sigma^2, which equals the determinant
        // of S/sigma^2.
        let mut after = self.covariance;
        let log_determinant = elimination::solve_general(&mut matrix, &mut after);
        // Rounding makes P+ slightly asymmetric, and without this correction the asymmetry would grow from block to
        // block.
        for i in 0..S {
            for j in 0..i {
                let mean = 0.5 * (after[i][j] + after[j][i]);
                (after[i][j], after[j][i]) = (mean, mean);
            }
        }
        let sound = after.iter().flatten().all(|p| p.is_finite()) && (0..S).all(|i| after[i][i] >= 0.0);
        if !sound {
            return BlockResidual {
                energy: about.energy,
                ..BlockResidual::ZERO
            };
        }
        // The step x+ - x^ = P+ b/sigma^2 is the sum of W_k nu_k over the samples of the block.
        let mut explained = 0.0;
        for i in 0..S {
            let step: f64 = (0..S).map(|k| after[i][k] * about.score[k]).sum();
            self.state[i] += per * step;
            explained += per * about.score[i] * step;
        }
        self.covariance = after;
        BlockResidual {
            energy: (about.energy - explained).max(0.0),
            log_determinant,
            ..BlockResidual::ZERO
        }
    }

    /// Step 7: adds `ln Lambda` to the log probability and updates the innovation variance. `common` is the smallest
    /// residual energy among all hypotheses.
    pub fn weigh(&mut self, residual: &BlockResidual, samples: f64, common: f64, dispersion: f64, memory: f64) {
        // n samples count as n/c, where c is the dispersion; nu is the number of degrees of freedom of sigma^2. The
        // energy `common` to all hypotheses enters through Student's density, and the excess of a hypothesis through
        // the normal density. A block that no hypothesis predicts (an outlier) then does not decide between the
        // hypotheses.
        let (n, nu) = (samples / dispersion, self.residuals);
        let over = common / (self.variance * dispersion);
        self.log_weight += libm::lgamma(0.5 * (nu + n))
            - libm::lgamma(0.5 * nu)
            - 0.5 * n * libm::log(nu * self.variance)
            - 0.5 * (nu + n) * libm::log1p(over / nu)
            - 0.5 * residual.log_determinant
            - 0.5 * (residual.energy - common) / (self.variance * dispersion);
        // Posterior mean of sigma^2 with nu degrees of freedom, where nu is limited by the memory. Skipped samples do
        // not count.
        let [passed, of_them] = residual.passed;
        let n = n - passed / dispersion;
        self.variance = (nu * self.variance + (residual.energy - of_them) / dispersion) / (nu + n);
        self.residuals = (nu + n).min(memory / dispersion);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::adaptive::{
        basis::Point,
        sizes::{GAIN_COUNT, LINEAR_COUNT, SIGNAL_COUNT, STATE_COUNT, SUM_COUNT},
    };

    fn bases() -> Bases<1> {
        let point = Point {
            tau: 0.2,
            omega: 10.0,
            zeta: 0.3,
            lag: 3.0,
        };
        Bases::new([point], 0.01).unwrap()
    }

    fn covariance(gains: f64) -> Covariance<STATE_COUNT> {
        let mut p = [[0.0; STATE_COUNT]; STATE_COUNT];
        for (i, row) in p.iter_mut().enumerate() {
            row[i] = if i < LINEAR_COUNT { gains } else { 1e-4 };
        }
        p
    }

    fn blocks(count: usize) -> Moments<SUM_COUNT> {
        let (mut bases, mut moments) = (bases(), Moments::EMPTY);
        for k in 0..32 * count {
            let e = |k: usize| libm::sin(0.05 * k as f64) + libm::cos(0.02 * k as f64);
            let z = bases.step(|_, age| e(k + 22 - age));
            moments.add(&z, 1.0, 0.3 * z[0][2] + 0.05 * libm::sin(0.7 * k as f64 * k as f64));
        }
        moments
    }

    #[test]
    fn update_satisfies_the_kalman_equations() {
        // A singular covariance: the gains are on a line.
        let mut p = covariance(0.0);
        for i in 0..GAIN_COUNT {
            for j in 0..GAIN_COUNT {
                p[i][j] = 0.3 * (1.0 + i as f64) * (1.0 + j as f64);
            }
        }
        p[GAIN_COUNT][GAIN_COUNT] = 0.2;
        let mut h = Hypothesis::new([0.0; STATE_COUNT], p, 0.01, 0, 0.0);
        let moments = blocks(2);
        let about = moments.local_model(&bases(), &h.state);
        h.update(&moments, &bases(), 1.0);
        // A is singular here, so P+ = P - P (A^-1 sigma^2 + P)^-1 P cannot be used; P+ (I + A P/sigma^2) = P is
        // equivalent.
        for i in 0..STATE_COUNT {
            for j in 0..STATE_COUNT {
                let back: f64 = (0..STATE_COUNT)
                    .map(|k| {
                        let of_k: f64 = (0..STATE_COUNT).map(|l| about.information[k][l] * p[l][j]).sum();
                        h.covariance[i][k] * (of_k / 0.01 + if k == j { 1.0 } else { 0.0 })
                    })
                    .sum();
                assert!((back - p[i][j]).abs() < 1e-9, "{i} {j}: {back} {}", p[i][j]);
            }
            let step: f64 = (0..STATE_COUNT)
                .map(|k| h.covariance[i][k] * about.score[k])
                .sum::<f64>()
                / 0.01;
            assert!((h.state[i] - step).abs() < 1e-12);
        }
        // The gains remain on this line.
        assert!((h.covariance[1][1] - 2.0 * h.covariance[0][1]).abs() < 1e-9);
    }

    #[test]
    fn empty_and_overflowing_blocks_change_nothing() {
        let mut h = Hypothesis::new([0.1; STATE_COUNT], covariance(1.0), 0.01, 0, 0.0);
        let before = h;
        let left = h.update(&Moments::<SUM_COUNT>::EMPTY, &bases(), 1.0);
        assert_eq!(
            (h.state, h.covariance, left.energy),
            (before.state, before.covariance, 0.0)
        );
        // A block that overflows does not change the estimate either.
        let mut huge = Moments::<SUM_COUNT>::EMPTY;
        huge.add(&[[1e200; SIGNAL_COUNT]], 1.0, 1.0);
        h.update(&huge, &bases(), 1.0);
        assert!(h.state.iter().all(|s| s.is_finite()));
    }

    #[test]
    fn child_keeps_earlier_segments() {
        let mut h = Hypothesis::new([0.1; STATE_COUNT], covariance(1.0), 0.01, 0, 0.0);
        for block in 1..=MAX_SEGMENTS as u64 + 2 {
            h.state[0] = block as f64;
            h = h.child(block);
        }
        let segments = h.segments();
        assert_eq!(segments.len(), MAX_SEGMENTS);
        assert_eq!((segments[0].until, segments[0].state[0]), (3, 3.0));
        assert_eq!(h.born, MAX_SEGMENTS as u64 + 2);
    }
}
