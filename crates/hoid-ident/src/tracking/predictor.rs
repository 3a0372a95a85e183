//! One-step prediction, sample by sample, of `A u = (B/F) q^-nk e + (C/D) eps`:
//!
//! `w = B e(t-nk) - (F - 1) w`,  `v = A u - w`,  `eps = v + (D - 1) v - (C - 1) eps`.
//!
//! The coefficients may change from sample to sample; the histories of w, v and eps keep the values that were right when they were
//! taken.

use hoid_model::Orders;

use super::past::{Past, bounded, weighted};

/// The predictor in direct form.
#[derive(Debug, Clone)]
pub(super) struct Predictor {
    orders: Orders,
    e: Past,
    u: Past,
    w: Past,
    v: Past,
    eps: Past,
}

impl Predictor {
    /// At rest.
    pub fn new(orders: Orders) -> Self {
        Self {
            orders,
            e: Past::new(orders.nk + orders.nb),
            u: Past::new(orders.na),
            w: Past::new(orders.nf),
            v: Past::new(orders.nd),
            eps: Past::new(orders.nc),
        }
    }

    /// Takes a sample and returns its prediction error eps under theta, in the order of [`Orders::parameter_names`].
    pub fn step(&mut self, theta: &[f64], e: f64, u: f64) -> f64 {
        self.take(theta, e, Some(u)).1
    }

    /// Takes a sample whose output is missing; returns the prediction that takes its place.
    pub fn bridge(&mut self, theta: &[f64], e: f64) -> f64 {
        self.take(theta, e, None).0
    }

    /// The output, and its prediction error.
    fn take(&mut self, theta: &[f64], e: f64, u: Option<f64>) -> (f64, f64) {
        let o = &self.orders;
        let (a, rest) = theta.split_at(o.na);
        let (b, rest) = rest.split_at(o.nb);
        let (c, rest) = rest.split_at(o.nc);
        let (d, f) = rest.split_at(o.nd);
        self.e.push(e);
        let w = if o.nb > 0 {
            weighted(b, &self.e.newest()[o.nk..]) - weighted(f, self.w.newest())
        } else {
            0.0
        };
        let feedback = weighted(a, self.u.newest()) - w;
        let coloured = weighted(d, self.v.newest()) - weighted(c, self.eps.newest());
        let u = bounded(u.unwrap_or(-feedback - coloured));
        let v = u + feedback;
        let eps = bounded(v + coloured);
        self.u.push(u);
        self.w.push(w);
        self.v.push(v);
        self.eps.push(eps);
        (u, eps)
    }

    /// At rest again.
    pub fn reset(&mut self) {
        for past in [&mut self.e, &mut self.u, &mut self.w, &mut self.v, &mut self.eps] {
            past.clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        InitialState,
        prediction_error::{Criterion, Data, Workspace},
    };

    #[test]
    fn equals_the_batch_residuals_of_the_general_model() {
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
        let criterion = Criterion {
            orders,
            data: vec![Data { e: &e, u: &u }],
            initial: InitialState::Zero,
            first: 0,
            weights: None,
        };
        let batch = criterion.residuals_of(&theta, 0, &mut Workspace::default());
        let mut predictor = Predictor::new(orders);
        for (t, expected) in batch.iter().enumerate() {
            let eps = predictor.step(&theta, e[t], u[t]);
            // Rounding of 300 samples.
            assert!((eps - expected).abs() < 1e-11, "{t}: {eps} {expected}");
        }
        predictor.reset();
        assert_eq!(predictor.step(&theta, e[0], u[0]), batch[0]);
    }

    #[test]
    fn an_output_alone_needs_no_input() {
        let orders = Orders {
            na: 1,
            nc: 1,
            ..Orders::default()
        };
        let mut predictor = Predictor::new(orders);
        let theta = [-0.5, 0.2];
        assert_eq!(predictor.step(&theta, 7.0, 1.0), 1.0);
        let second = 2.0 - 0.5 - 0.2;
        assert_eq!(predictor.step(&theta, 7.0, 2.0), second);
        let predicted = predictor.bridge(&theta, 7.0);
        assert!((predicted - (0.5 * 2.0 + 0.2 * second)).abs() < 1e-15);
    }
}
