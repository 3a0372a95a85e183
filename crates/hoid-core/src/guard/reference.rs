//! A fixed model: how well the start of a recursion predicts the current u.
//!
//! The general model `A u = (B/F) q^-nk e + (C/D) eps` with the coefficients of the start gives the innovations eps_0,
//! which are compared with those of the recursion, eps. Over a block of n samples the estimate is worse than the fixed
//! model by
//!
//! `s = n log(mean |eps| / mean |eps_0|)`
//!
//! units of log likelihood: the ratio of the mean magnitudes is that of the standard deviations for every shape of the
//! distribution, and a few outliers have little weight. The innovations of a sound recursion are larger than those of
//! a fixed model by half of its effective number of parameters over its memory: .2 % for memories of 2 to 5 s and
//! white innovations, several per cent for seconds if the order of its noise model is too low for the remnant, and
//! more for an unsteady person. The part beyond [`DRIFT`] counts. The one-sided cumulative sum (E. S. Page,
//! *Biometrika* 41 (1954) 100-115) reports a diverged estimate when it reaches [`ASTRAY`].
//!
//! A changed person is predicted better by an estimate that has followed than by the start: the sum stays at zero.

/// Largest order of a polynomial.
pub const ROOM: usize = 16;
/// Relative increase of the innovations that does not count.
pub const DRIFT: f64 = 0.2;
/// Sum at which the estimate has diverged.
pub const ASTRAY: f64 = 40.0;
/// Largest contribution of one block to the sum.
const MOST: f64 = 15.0;

/// Orders of the model: na, nb, nc, nd, nf.
pub type Orders = [usize; 5];

/// The model and its signals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceModel {
    orders: Orders,
    coefficients: [[f64; ROOM]; 5],
    /// u, x, eps, v and w of the last samples, the newest first.
    past: [[f64; ROOM]; 5],
    sum: f64,
    samples: u32,
    score: f64,
}

crate::state!([] ReferenceModel { coefficients, past, sum, samples, score });

impl ReferenceModel {
    /// Builds the model of `theta = [a.., b.., c.., d.., f..]`. `None` if an order is above [`ROOM`] or theta has
    /// another length.
    pub fn new(orders: Orders, theta: &[f64]) -> Option<Self> {
        if orders.iter().any(|n| *n > ROOM) || orders.iter().sum::<usize>() != theta.len() {
            return None;
        }
        let (mut coefficients, mut first) = ([[0.0; ROOM]; 5], 0);
        for (place, n) in coefficients.iter_mut().zip(orders) {
            place[..n].copy_from_slice(&theta[first..first + n]);
            first += n;
        }
        Some(Self {
            orders,
            coefficients,
            past: [[0.0; ROOM]; 5],
            sum: 0.0,
            samples: 0,
            score: 0.0,
        })
    }

    /// Resets the filters and the sum.
    pub fn reset(&mut self) {
        (self.past, self.sum, self.samples, self.score) = ([[0.0; ROOM]; 5], 0.0, 0, 0.0);
    }

    /// Takes a sample `x(t) = e(t - nk)`, `u(t)`; returns eps_0.
    #[inline]
    pub fn step(&mut self, x: f64, u: f64) -> f64 {
        let [na, nb, nc, nd, nf] = self.orders;
        let [a, b, c, d, f] = &self.coefficients;
        let [us, xs, errors, vs, ws] = &self.past;
        let sum = |c: &[f64; ROOM], past: &[f64; ROOM], n: usize| -> f64 {
            c[..n].iter().zip(&past[..n]).map(|(c, x)| c * x).sum()
        };
        // b starts with x(t) itself.
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

    /// Drops the errors of the block so far.
    pub fn skip_block(&mut self) {
        (self.sum, self.samples) = (0.0, 0);
    }

    /// Ends a block in which the innovations of the recursion have this mean magnitude: true if its estimate has
    /// diverged.
    pub fn end_block(&mut self, innovation: f64) -> bool {
        let own = self.sum / f64::from(self.samples.max(1));
        let said = f64::from(self.samples) * (libm::log(innovation / own) - DRIFT);
        self.skip_block();
        // A comparison with NaN is false: zero over zero carries no information.
        if said.abs() <= f64::INFINITY {
            self.score = (self.score + said.clamp(-MOST, MOST)).max(0.0);
        }
        self.score >= ASTRAY
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
    fn innovations_are_those_of_the_predictor() {
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
    fn an_estimate_that_is_as_good_is_never_astray_and_a_worse_one_soon() {
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
        // 100 (log 1.4 - .2) = 13.6 a block.
        assert_eq!(blocks(1.4, 1000), Some(2));
        assert_eq!(blocks(1e9, 1000), Some(2));
        assert_eq!(blocks(f64::NAN, 10), None);
    }
}
