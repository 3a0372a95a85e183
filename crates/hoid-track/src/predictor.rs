//! One-step prediction, sample by sample: the predictor of the kernel with a delay line, for methods that need no
//! gradient.
//!
//! The coefficients may change from sample to sample; the histories of w, v and eps keep the values that were computed
//! with earlier coefficients. After an overflow of a signal the filters are reset.

use hoid_core::state::{State, visit_all};
use hoid_core::{
    delay::DelayLine,
    predictor::{Predictor as Kernel, Regressor},
    shape::AnyShape,
};
use hoid_model::Orders;

use crate::history::limit_magnitude;

/// Maximum number of coefficients.
const MAX_COEFFICIENTS: usize = 64;

/// The predictor in direct form.
#[derive(Debug, Clone)]
pub struct Predictor {
    kernel: Box<Kernel<AnyShape, MAX_COEFFICIENTS, MAX_COEFFICIENTS>>,
    delay: DelayLine<Vec<f64>>,
    nk: usize,
}

impl State for Predictor {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(&mut [&mut *self.kernel, &mut self.delay], each);
    }
}

impl Predictor {
    /// Builds the predictor at rest. `None` for more than 64 coefficients.
    pub fn new(orders: Orders) -> Option<Self> {
        let shape = AnyShape {
            na: orders.na,
            nb: orders.nb,
            nc: orders.nc,
            nd: orders.nd,
            nf: orders.nf,
        };
        Some(Self {
            kernel: Box::new(Kernel::new(shape, Regressor::PseudoLinear)?),
            delay: DelayLine::new(vec![0.0; orders.nk]),
            nk: orders.nk,
        })
    }

    /// Takes a sample and returns its prediction error eps for theta, whose coefficients are in the order of
    /// [`Orders::parameter_names`].
    pub fn step(&mut self, theta: &[f64], e: f64, u: f64) -> f64 {
        let theta = padded(theta);
        let eps = self.predict(&theta, e, u);
        self.correct(&theta);
        eps
    }

    /// Takes a sample whose output is missing; returns the prediction that replaces it.
    pub fn bridge(&mut self, theta: &[f64], e: f64) -> f64 {
        let theta = padded(theta);
        // eps is the output minus its prediction, and the output here is zero.
        let prediction = -self.predict(&theta, e, 0.0);
        self.kernel.bridge(&theta);
        self.correct(&theta);
        prediction
    }

    fn predict(&mut self, theta: &[f64; MAX_COEFFICIENTS], e: f64, u: f64) -> f64 {
        let x = self.delay.step(e);
        limit_magnitude(self.kernel.predict(theta, x, u).1)
    }

    fn correct(&mut self, theta: &[f64; MAX_COEFFICIENTS]) {
        if !self.kernel.correct(theta).is_finite() {
            self.kernel.reset();
        }
    }

    /// Sets the filters to rest.
    pub fn reset(&mut self) {
        self.kernel.reset();
        self.delay = DelayLine::new(vec![0.0; self.nk]);
    }
}

fn padded(theta: &[f64]) -> [f64; MAX_COEFFICIENTS] {
    let mut padded = [0.0; MAX_COEFFICIENTS];
    padded[..theta.len()].copy_from_slice(theta);
    padded
}

#[cfg(test)]
mod tests {
    use super::*;
    use hoid_core::filter::{divide_in_place, fir, multiply};

    #[test]
    fn predictor_matches_the_filtered_residual() {
        let orders = Orders {
            na: 1,
            nb: 2,
            nc: 2,
            nd: 1,
            nf: 2,
            nk: 3,
        };
        let theta = [-0.4, 1.0, 0.5, 0.3, 0.1, -0.6, -1.5, 0.7];
        let wave = |t: usize, k: f64| (k * t as f64).sin() + 0.3 * (2.7 * k * t as f64).cos();
        let e: Vec<f64> = (0..300).map(|t| wave(t, 0.31)).collect();
        let u: Vec<f64> = (0..300).map(|t| wave(t, 0.17)).collect();
        // Reference: A u - (B/F) q^-nk e, filtered by D/C.
        let (a, b, c, d, f) = (&theta[..1], &theta[1..3], &theta[3..5], &theta[5..6], &theta[6..]);
        let (mut w, mut v, mut batch) = (vec![0.0; 300], vec![0.0; 300], vec![0.0; 300]);
        fir(b, orders.nk, &e, &mut w);
        divide_in_place(f, &mut w);
        multiply(a, &u, &mut v);
        for (v, w) in v.iter_mut().zip(&w) {
            *v -= w;
        }
        multiply(d, &v, &mut batch);
        divide_in_place(c, &mut batch);
        let mut predictor = Predictor::new(orders).unwrap();
        for (t, expected) in batch.iter().enumerate() {
            let eps = predictor.step(&theta, e[t], u[t]);
            // The tolerance allows for the rounding errors of 300 samples.
            assert!((eps - expected).abs() < 1e-11, "{t}: {eps} {expected}");
        }
        predictor.reset();
        assert!((predictor.step(&theta, e[0], u[0]) - batch[0]).abs() < 1e-15);
    }

    #[test]
    fn output_only_model_ignores_the_input() {
        let orders = Orders {
            na: 1,
            nc: 1,
            ..Orders::default()
        };
        let mut predictor = Predictor::new(orders).unwrap();
        let theta = [-0.5, 0.2];
        assert_eq!(predictor.step(&theta, 7.0, 1.0), 1.0);
        let second = 2.0 - 0.5 - 0.2;
        assert_eq!(predictor.step(&theta, 7.0, 2.0), second);
        let predicted = predictor.bridge(&theta, 7.0);
        assert!((predicted - (0.5 * 2.0 + 0.2 * second)).abs() < 1e-15);
    }
}
