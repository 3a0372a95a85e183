//! Fixed reference model, which shows how well the start of a recursion predicts the current u.
//!
//! The general model `A u = (B/F) q^-nk e + (C/D) eps` with the initial coefficients of the recursion gives the
//! innovations eps_0, which are compared with the innovations eps of the recursion. Over a block of n samples the
//! estimate is worse than the fixed model by
//!
//! `s = n log(mean |eps| / mean |eps_0|)`
//!
//! units of log likelihood. The mean magnitude is proportional to the standard deviation for every shape of the
//! distribution, and gives little weight to a few outliers. The innovations of a sound recursion exceed those of a
//! fixed model by half the effective number of parameters divided by the memory: .2 % for memories of 2 to 5 s and
//! white innovations. They are larger by several per cent for a few seconds at a time if the order of the noise model
//! is too low for the remnant, and by more for an unsteady person. Only the part of the logarithm beyond
//! [`TOLERATED_DRIFT`] counts. The one-sided cumulative sum (E. S. Page, *Biometrika* 41 (1954) 100-115) reports a
//! diverged estimate when it reaches [`DIVERGENCE_LIMIT`].
//!
//! After a change in the person, an estimate that has followed the change predicts u better than the initial model, and
//! the sum stays at zero.

/// Highest order of a polynomial of the model.
pub const MAX_ORDER: usize = 16;
/// Tolerated increase of the logarithm of the mean magnitude of the innovations, compared with the fixed model.
pub const TOLERATED_DRIFT: f64 = 0.2;
/// Cumulative sum above which the estimate is reported as diverged.
pub const DIVERGENCE_LIMIT: f64 = 40.0;
/// Largest contribution of one block to the cumulative sum.
const LARGEST_CONTRIBUTION: f64 = 15.0;

/// Orders of the model: na, nb, nc, nd, nf.
pub type Orders = [usize; 5];

/// Fixed model with its past signals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceModel {
    orders: Orders,
    coefficients: [[f64; MAX_ORDER]; 5],
    /// Last values of u, x, eps, v and w, the newest first.
    past: [[f64; MAX_ORDER]; 5],
    sum: f64,
    samples: u32,
    score: f64,
}

crate::state!([] ReferenceModel { coefficients, past, sum, samples, score });

impl ReferenceModel {
    /// Builds the model from `theta = [a.., b.., c.., d.., f..]`. Returns `None` if an order is above [`MAX_ORDER`] or
    /// if the length of theta does not match the orders.
    pub fn new(orders: Orders, theta: &[f64]) -> Option<Self> {
        if orders.iter().any(|n| *n > MAX_ORDER) || orders.iter().sum::<usize>() != theta.len() {
            return None;
        }
        let (mut coefficients, mut first) = ([[0.0; MAX_ORDER]; 5], 0);
        for (place, n) in coefficients.iter_mut().zip(orders) {
            place[..n].copy_from_slice(&theta[first..first + n]);
            first += n;
        }
        Some(Self {
            orders,
            coefficients,
            past: [[0.0; MAX_ORDER]; 5],
            sum: 0.0,
            samples: 0,
            score: 0.0,
        })
    }

    /// Resets the filters, the current block and the cumulative sum.
    pub fn reset(&mut self) {
        (self.past, self.sum, self.samples, self.score) = ([[0.0; MAX_ORDER]; 5], 0.0, 0, 0.0);
    }

    /// Takes a sample `x(t) = e(t - nk)`, `u(t)` and returns its innovation eps_0.
    #[inline]
    pub fn step(&mut self, x: f64, u: f64) -> f64 {
        let [na, nb, nc, nd, nf] = self.orders;
        let [a, b, c, d, f] = &self.coefficients;
        let [us, xs, errors, vs, ws] = &self.past;
        let sum = |c: &[f64; MAX_ORDER], past: &[f64; MAX_ORDER], n: usize| -> f64 {
            c[..n].iter().zip(&past[..n]).map(|(c, x)| c * x).sum()
        };
        // The first coefficient of B multiplies x(t) itself, the others multiply past values.
        let mut w = -sum(f, ws, nf);
        if nb > 0 {
            w += b[0] * x;
            w += b[1..nb].iter().zip(&xs[..nb - 1]).map(|(b, x)| b * x).sum::<f64>();
        }
        let v = u + sum(a, us, na) - w;
        let eps = v + sum(d, vs, nd) - sum(c, errors, nc);
        for ((past, newest), n) in self.past.iter_mut().zip([u, x, eps, v, w]).zip([na, nb, nc, nd, nf]) {
            if n > 0 {
                past.copy_within(0..n - 1, 1);
                past[0] = newest;
            }
        }
        self.sum += eps.abs();
        self.samples += 1;
        eps
    }

    /// Discards the innovations of the current block.
    pub fn skip_block(&mut self) {
        (self.sum, self.samples) = (0.0, 0);
    }

    /// Ends a block, given the mean magnitude of the innovations of the recursion. Returns true if the estimate of the
    /// recursion has diverged.
    pub fn end_block(&mut self, innovation: f64) -> bool {
        let own = self.sum / f64::from(self.samples.max(1));
        let score = f64::from(self.samples) * (libm::log(innovation / own) - TOLERATED_DRIFT);
        self.skip_block();
        // A comparison with NaN is false; zero divided by zero carries no information.
        if score.abs() <= f64::INFINITY {
            self.score = (self.score + score.clamp(-LARGEST_CONTRIBUTION, LARGEST_CONTRIBUTION)).max(0.0);
        }
        self.score >= DIVERGENCE_LIMIT
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        predictor::{Predictor, Regressor},
        shape::AnyShape,
    };

    /// Comparison with the predictor of the recursions.
    #[test]
    fn innovations_match_the_predictor() {
        let orders = [1, 2, 1, 2, 2];
        let theta = [-0.3, 1.0, -0.4, 0.2, -0.8, 0.1, -1.5, 0.6];
        let shape = AnyShape {
            na: 1,
            nb: 2,
            nc: 1,
            nd: 2,
            nf: 2,
        };
        let mut twin: Predictor<AnyShape, 8, 8> = Predictor::new(shape, Regressor::PseudoLinear).unwrap();
        let mut model = ReferenceModel::new(orders, &theta).unwrap();
        for t in 0..300 {
            let t = f64::from(t);
            let (x, u) = (libm::sin(0.31 * t), libm::cos(0.77 * t) + 0.2 * libm::sin(2.9 * t));
            let expected = twin.predict(&theta, x, u).1;
            twin.correct(&theta);
            assert!((model.step(x, u) - expected).abs() < 1e-10, "{t}");
        }
        assert!(ReferenceModel::new(orders, &theta[1..]).is_none());
        assert!(ReferenceModel::new([0, 17, 0, 0, 0], &[0.0; 17]).is_none());
    }

    #[test]
    fn only_a_worse_estimate_is_reported_as_diverged() {
        let mut model = ReferenceModel::new([0, 1, 0, 0, 0], &[0.0]).unwrap();
        let mut blocks = |worse: f64, n: usize| {
            model.reset();
            (0..n).find(|_| {
                (0..100).for_each(|k| {
                    model.step(0.0, if k % 2 == 0 { 1.0 } else { -1.0 });
                });
                model.end_block(worse)
            })
        };
        assert_eq!(blocks(1.15, 1000), None);
        assert_eq!(blocks(0.5, 1000), None);
        // 100 (log 1.4 - .2) = 13.6 per block.
        assert_eq!(blocks(1.4, 1000), Some(2));
        assert_eq!(blocks(1e9, 1000), Some(2));
        assert_eq!(blocks(f64::NAN, 10), None);
    }
}
