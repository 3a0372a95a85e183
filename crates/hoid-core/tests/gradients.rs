//! psi of the predictor compared with finite differences.

#![allow(clippy::unwrap_used)]

mod common;

use common::{box_jenkins, shapes, start_coefficients};
use hoid_core::{
    predictor::{Predictor, Regressor},
    shape::{AnyShape, Shape},
};

#[test]
fn psi_is_the_negative_gradient_of_the_frozen_predictor() {
    let data = box_jenkins(400, 5, 0.02);
    const N: usize = 8;
    for shape in shapes() {
        let theta: [f64; N] = start_coefficients(&shape);
        let run = |theta: [f64; N]| {
            let mut predictor = Predictor::<AnyShape, N, N>::new(shape, Regressor::Gradient).unwrap();
            let mut all = Vec::new();
            for &(x, u) in &data {
                let (psi, eps) = predictor.predict(&theta, x, u);
                predictor.correct(&theta);
                all.push((eps, psi));
            }
            all
        };
        let at = run(theta);
        for i in 0..shape.parameter_count() {
            let step = 1e-6;
            let shifted = |sign: f64| {
                let mut moved = theta;
                moved[i] += sign * step;
                run(moved)
            };
            let (up, down) = (shifted(1.0), shifted(-1.0));
            let size = at.iter().map(|(_, psi)| psi[i].abs()).fold(0.0, f64::max);
            for t in 0..data.len() {
                let difference = -(up[t].0 - down[t].0) / (2.0 * step);
                assert!(
                    (at[t].1[i] - difference).abs() < 1e-6 * size,
                    "{shape:?} parameter {i} at {t}: {} and {difference}",
                    at[t].1[i]
                );
            }
        }
    }
}
