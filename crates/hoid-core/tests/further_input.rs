//! The recursive prediction-error method with further inputs compared with models with one input, its gradient with
//! finite differences, and its estimate with least squares over the whole record.

#![allow(clippy::unwrap_used)]

mod common;

use common::{Noise, box_jenkins, covariance, diagonal, error_bars};
use hoid_core::{
    adaptation::Forgetting,
    error_bars::ErrorBars,
    further_input::{FurtherInput, FurtherInputs},
    innovation_variance::InnovationVariance,
    predictor::{Predictor, Regressor},
    recursion::StablePolynomials,
    rpem::Rpem,
    shape::AnyShape,
};

const FORGETTING: Forgetting<7> = Forgetting::Exponential { lambda: [0.998; 7] };

/// Returns samples of the error, of a target and of the output `u = (B/F) e + (B_1/F_1) r + n`.
fn two_input_samples(samples: usize, seed: u64) -> Vec<[f64; 3]> {
    let mut noise = Noise(seed + 100);
    let (mut w, mut slow) = (0.0, 0.0);
    box_jenkins(samples, seed, 0.02)
        .into_iter()
        .map(|(e, u)| {
            slow = 0.9 * slow + 0.4 * noise.next();
            w = 0.8 * w + 0.05 * slow;
            [e, slow, u + w]
        })
        .collect()
}

#[test]
fn single_further_input_equals_the_first_input() {
    // theta of the model with one input is [b0, b1, c1, d1, f1, f2, -]; with the input as a further one it is [c1, d1,
    // b0, b1, f1, f2, -].
    let order = [2, 3, 0, 1, 4, 5, 6];
    let first = AnyShape {
        nb: 2,
        nc: 1,
        nd: 1,
        nf: 2,
        ..AnyShape::default()
    };
    let noise = AnyShape {
        nc: 1,
        nd: 1,
        ..AnyShape::default()
    };
    let theta = [0.04, -0.04, 0.1, -0.7, -1.9, 0.92, 0.0];
    for regressor in [Regressor::Gradient, Regressor::PseudoLinear] {
        let mut alone = Rpem::new(
            first,
            regressor,
            StablePolynomials::PredictorAndNoise,
            theta,
            covariance::<7>(0.1, FORGETTING),
            error_bars::<7, 0>(0.1),
        )
        .unwrap();
        let mut further = Rpem::with_further_inputs(
            noise,
            [FurtherInput::new(2, 2)],
            regressor,
            StablePolynomials::PredictorAndNoise,
            order.map(|i| theta[i]),
            covariance::<7>(0.1, FORGETTING),
            error_bars::<7, 0>(0.1),
        )
        .unwrap();
        let mut far: f64 = 0.0;
        for (k, (x, u)) in box_jenkins(4000, 5, 0.02).into_iter().enumerate() {
            further.further_inputs_mut().set(&[x]);
            // Some samples only advance the filters, and some lack the output.
            let (a, b) = match k % 50 {
                48 => (alone.step_without_update(x, u), further.step_without_update(0.0, u)),
                49 => {
                    alone.bridge(x);
                    further.bridge(0.0);
                    continue;
                }
                _ => (alone.step(x, u), further.step(0.0, u)),
            };
            far = far.max((a.innovation - b.innovation).abs());
            assert_eq!(a.shortened, b.shortened);
        }
        let (p, q) = (alone.normalised_covariance(), further.normalised_covariance());
        for (i, &of) in order.iter().enumerate() {
            far = far.max((further.theta()[i] - alone.theta()[of]).abs());
            for (j, &with) in order.iter().enumerate() {
                far = far.max((q[i][j] - p[of][with]).abs() / (1e-3 + p[of][of].sqrt() * p[with][with].sqrt()));
            }
        }
        assert!(far < 1e-9, "{regressor:?}: {far:e}");
        assert!((alone.theta()[4] - theta[4]).abs() > 1e-4, "the estimate does not move");
    }
}

#[test]
fn psi_is_the_negative_derivative_of_the_innovation() {
    let shape = AnyShape {
        na: 1,
        nb: 1,
        nc: 1,
        nd: 1,
        nf: 1,
    };
    // [a1, b0, c1, d1, f1], then [b0, b1, f1] and [b0] of two further inputs.
    let theta = [-0.3, 0.5, 0.2, -0.6, -0.8, 0.3, -0.1, -0.7, 0.2];
    let data = two_input_samples(300, 3);
    let run = |theta: [f64; 9]| {
        let inputs = [FurtherInput::new(2, 1), FurtherInput::new(1, 0)];
        let mut predictor = Predictor::<_, 9, 9, _>::with_further_inputs(shape, Regressor::Gradient, inputs).unwrap();
        let mut last = ([0.0; 9], 0.0);
        for [e, r, u] in &data {
            predictor.further_inputs_mut().set(&[*r, r * r]);
            last = predictor.predict(&theta, *e, *u);
            predictor.correct(&theta);
        }
        last
    };
    let psi = run(theta).0;
    for i in 0..9 {
        let at = |step: f64| {
            let mut moved = theta;
            moved[i] += step;
            run(moved).1
        };
        let step = 1e-5;
        let slope = -(at(step) - at(-step)) / (2.0 * step);
        assert!(
            (slope - psi[i]).abs() < 1e-7 * (1.0 + slope.abs()),
            "{i}: {slope} {}",
            psi[i]
        );
    }
}

#[test]
fn infinite_memory_gives_the_least_squares_estimate() {
    // ARX with two inputs: theta = [a1, b0, b1, b0 of r, b1 of r].
    let shape = AnyShape {
        na: 1,
        nb: 2,
        ..AnyShape::default()
    };
    let data = two_input_samples(2000, 9);
    let prior = 1e8;
    let mut recursion = Rpem::with_further_inputs(
        shape,
        [FurtherInput::new(2, 0)],
        Regressor::Gradient,
        StablePolynomials::Predictor,
        [0.0; 5],
        covariance::<5>(prior, Forgetting::Exponential { lambda: [1.0; 5] }),
        // There is no limit on innovations, since the first samples of an unknown model would exceed it.
        ErrorBars::<5, 0>::new(&diagonal(prior), InnovationVariance::new(0.0, 0.0, 1.0), f64::INFINITY),
    )
    .unwrap();
    let (mut gram, mut right, mut past) = ([[0.0; 5]; 5], [0.0; 5], [0.0; 3]);
    for &[e, r, u] in &data {
        recursion.further_inputs_mut().set(&[r]);
        recursion.step(e, u);
        let [before_e, before_r, before_u] = past;
        let row = [-before_u, e, before_e, r, before_r];
        for i in 0..5 {
            for j in 0..5 {
                gram[i][j] += row[i] * row[j];
            }
            right[i] += row[i] * u;
        }
        past = [e, r, u];
    }
    let expected = solve(gram, right);
    for i in 0..5 {
        let difference = recursion.theta()[i] - expected[i];
        assert!(difference.abs() < 1e-8, "{i}: {} {}", recursion.theta()[i], expected[i]);
    }
}

#[test]
fn unstable_or_too_large_further_input_is_refused() {
    let shape = AnyShape {
        nb: 1,
        nf: 1,
        ..AnyShape::default()
    };
    let build = |theta: [f64; 4], input: FurtherInput<4>| {
        Rpem::with_further_inputs(
            shape,
            [input],
            Regressor::Gradient,
            StablePolynomials::Predictor,
            theta,
            covariance::<4>(1.0, Forgetting::Exponential { lambda: [1.0; 4] }),
            error_bars::<4, 0>(1.0),
        )
        .is_some()
    };
    assert!(build([0.1, -0.5, 0.1, -0.5], FurtherInput::new(1, 1)));
    assert!(!build([0.1, -0.5, 0.1, -1.0], FurtherInput::new(1, 1)));
    assert!(!build([0.1, -0.5, 0.1, f64::NAN], FurtherInput::new(1, 1)));
    assert!(!build([0.1, -0.5, 0.1, -0.5], FurtherInput::new(2, 1)));
}

#[test]
fn reset_clears_the_filters_of_all_inputs() {
    let shape = AnyShape {
        nb: 1,
        ..AnyShape::default()
    };
    let inputs = [FurtherInput::new(1, 1)];
    let mut predictor = Predictor::<_, 3, 3, _>::with_further_inputs(shape, Regressor::Gradient, inputs).unwrap();
    let theta = [1.0, 1.0, -0.5];
    let first = predictor.predict(&theta, 1.0, 2.0);
    predictor.correct(&theta);
    predictor.further_inputs_mut().set(&[1e300]);
    predictor.predict(&theta, 0.0, 0.0);
    predictor.correct(&theta);
    predictor.reset();
    predictor.further_inputs_mut().set(&[0.0]);
    assert_eq!(predictor.predict(&theta, 1.0, 2.0), first);
    assert_eq!(predictor.further_inputs().parameter_count(), 2);
}

/// Solves a system of five equations by Gaussian elimination with pivoting.
fn solve(mut a: [[f64; 5]; 5], mut b: [f64; 5]) -> [f64; 5] {
    for k in 0..5 {
        let pivot = (k..5).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap();
        a.swap(k, pivot);
        b.swap(k, pivot);
        for i in k + 1..5 {
            let factor = a[i][k] / a[k][k];
            let row = a[k];
            for (left, right) in a[i].iter_mut().zip(row) {
                *left -= factor * right;
            }
            b[i] -= factor * b[k];
        }
    }
    for k in (0..5).rev() {
        let known: f64 = (k + 1..5).map(|j| a[k][j] * b[j]).sum();
        b[k] = (b[k] - known) / a[k][k];
    }
    b
}
