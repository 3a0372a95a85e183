//! One filter of gains, level and corrections.
//!
//! Behind the whitening filter, `y = psi(s)' s + eps` with `s = [theta, level, c]`, c the corrections
//! of omega, zeta and tau at which the basis was made, and the prediction
//!
//! `h(s) = sum_i theta_i (x_i + sum_j c_j dx_i/dj) + level D(1)`,
//!
//! which is linear in either of theta and c. With its gradient psi at s the innovation has the
//! variance `S = psi' P psi + sigma^2` (A. H. Jazwinski, *Stochastic Processes and Filtering Theory*,
//! 1970, section 8.3), and with the Student distribution of nu degrees of freedom
//!
//! `w = min(1, (nu + 1)/(nu + eps^2/S))`, `g = P psi/(psi' P psi + sigma^2/w)`,
//! `s <- s + g eps`, `P <- P - g (P psi)'`
//!
//! with eps limited to some standard deviations (J. Meinhold and N. Singpurwalla, JASA 84 (1989)
//! 479-486): an outlier says little.

use super::{
    basis::{Point, Regressors},
    sizes::{GAINS, HELD, LINEAR, STATES},
};
use crate::adaptive::elementary::log1p;

/// Largest correction of omega and zeta, as a share of theirs, and of tau, s.
const FARTHEST: [[f64; 2]; HELD] = [[-0.5, 0.6], [-0.8, 1.5], [-0.1, 0.1]];

/// What a sample says to every filter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen<'a> {
    /// Output behind the whitening filter.
    pub y: f64,
    /// Responses behind it.
    pub regressors: &'a Regressors,
    /// D(1).
    pub level: f64,
    /// Variance of eps.
    pub variance: f64,
    /// Where the basis was made.
    pub point: Point,
    /// Degrees of freedom, and limit in standard deviations.
    pub tails: [f64; 2],
}

/// One filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Kalman {
    /// Gains, level, corrections.
    pub state: [f64; STATES],
    /// Their covariance.
    pub covariance: [[f64; STATES]; STATES],
    /// Logarithm of its weight among those of its form.
    pub log_weight: f64,
}

crate::state!([] Kalman { state, covariance, log_weight });

impl Kalman {
    /// Prediction and its gradient.
    #[inline(always)]
    pub fn predicted(&self, r: &Regressors, level: f64) -> (f64, [f64; STATES]) {
        let mut psi = [0.0; STATES];
        let mut sum = level * self.state[GAINS];
        psi[GAINS] = level;
        for i in 0..GAINS {
            let mut x = r.x[i];
            for j in 0..HELD {
                x += self.state[LINEAR + j] * r.by[j][i];
                psi[LINEAR + j] += self.state[i] * r.by[j][i];
            }
            psi[i] = x;
            sum += self.state[i] * x;
        }
        (sum, psi)
    }

    /// Takes a sample: innovation, and logarithm of its density.
    #[inline(always)]
    pub fn update(&mut self, seen: &Seen) -> (f64, f64) {
        let (predicted, psi) = self.predicted(seen.regressors, seen.level);
        let eps = seen.y - predicted;
        let (mut through, mut spread) = ([0.0; STATES], 0.0);
        for i in 0..STATES {
            for j in 0..STATES {
                through[i] += self.covariance[i][j] * psi[j];
            }
            spread += through[i] * psi[i];
        }
        // Rounding may leave a covariance that is not positive where almost nothing is open.
        let spread = spread.max(0.0);
        let [nu, limit] = seen.tails;
        let total = spread + seen.variance;
        let square = eps * eps / total;
        let weight = ((nu + 1.0) / (nu + square)).min(1.0);
        let log_density = -0.5 * (libm::log(total) + (nu + 1.0) * log1p(square / nu));
        let most = limit * libm::sqrt(total);
        let limited = eps.max(-most).min(most);
        let gain = 1.0 / (spread + seen.variance / weight);
        for i in 0..STATES {
            let g = through[i] * gain;
            self.state[i] += g * limited;
            for j in 0..STATES {
                self.covariance[i][j] -= g * through[j];
            }
        }
        let [omega, zeta, tau] = [seen.point.omega, seen.point.zeta, 1.0];
        for (i, of) in [omega, zeta, tau].into_iter().enumerate() {
            let [low, high] = FARTHEST[i];
            let correction = &mut self.state[LINEAR + i];
            *correction = correction.max(low * of).min(high * of);
        }
        (eps, log_density)
    }

    /// Adds a variance to the gains, of this shape.
    #[inline(always)]
    pub fn open_gains(&mut self, shape: &[[f64; GAINS]; GAINS], variance: f64) {
        for i in 0..GAINS {
            for j in 0..GAINS {
                self.covariance[i][j] += variance * shape[i][j];
            }
        }
    }

    /// Forgets how well gains and level are known, and all that was learnt of the corrections'
    /// covariance: they begin with these standard deviations.
    pub fn reopen(&mut self, shape: &[[f64; GAINS]; GAINS], gain: f64, level: f64, held: [f64; HELD]) {
        self.covariance = [[0.0; STATES]; STATES];
        self.open_gains(shape, gain * gain);
        self.covariance[GAINS][GAINS] = level * level;
        for (i, deviation) in held.into_iter().enumerate() {
            self.covariance[LINEAR + i][LINEAR + i] = deviation * deviation;
        }
    }
}
