#![allow(clippy::unwrap_used)]
use super::{
    belief::{AugmentedState, ETA_START, Model, N},
    ekf,
    filter::sum_of_squares,
    ukf,
};
use crate::kernel::multiple_model::response::Response;

const MODEL: Model = Model {
    ts: 0.01,
    drift: [0.0, 1e-6, 1e-7, 1e-8, 1e-4, 1e-8],
    noise: 1e-3,
};
const X: [f64; N] = [0.4, -1.2, 0.09, 0.036, 11.25, 0.35];

#[test]
fn transition_matches_the_exact_hold() {
    let mut response = Response::new([X[4], X[5]], MODEL.ts);
    let mut x = [0.0, 0.0, X[2], X[3], X[4], X[5]];
    for t in 0..300 {
        let e = (0.13 * f64::from(t)).sin() + 0.3 * (0.7 * f64::from(t)).cos();
        let [x1, x2, ..] = response.step(e);
        x = MODEL.transition(&x, e);
        // The tolerance allows for the rounding errors of 300 samples.
        assert!((x[0] - x1).abs() < 1e-11 && (x[1] - x2).abs() < 1e-10, "{t}");
        assert!((Model::output(&x) - X[2] * x1 - X[3] * x2).abs() < 1e-11);
    }
}

#[test]
fn jacobian_and_gradient_agree_with_differences() {
    let e = 0.7;
    let by = MODEL.jacobian(&X, e);
    let gradient = Model::output_gradient(&X);
    for j in 0..N {
        let step = 1e-6 * X[j].abs();
        let at = |side: f64| {
            let mut x = X;
            x[j] += side * step;
            (MODEL.transition(&x, e), Model::output(&x))
        };
        let ((above, y_above), (below, y_below)) = (at(1.0), at(-1.0));
        for i in 0..N {
            let difference = (above[i] - below[i]) / (2.0 * step);
            // Central differences have a rounding error of 1e-16, divided by a step of at least 1e-6.
            assert!((difference - by[i][j]).abs() < 1e-8 * (1.0 + by[i][j].abs()), "{i} {j}");
        }
        assert!(((y_above - y_below) / (2.0 * step) - gradient[j]).abs() < 1e-8);
    }
}

/// If all parameters are known, the model is linear, and both filters are equal to the Kalman filter.
#[test]
fn both_filters_agree_on_a_linear_model() {
    let linear = Model {
        drift: [1e-5, 1e-4, 0.0, 0.0, 0.0, 0.0],
        ..MODEL
    };
    let mut p = [[0.0; N]; N];
    (p[0][0], p[1][1], p[0][1], p[1][0]) = (0.2, 3.0, 0.1, 0.1);
    let mut extended = AugmentedState { x: X, p };
    let mut unscented = extended;
    for t in 0..400 {
        let e = (0.11 * f64::from(t)).sin();
        let u = 0.1 * (0.05 * f64::from(t)).cos();
        let [a, s] = ekf::step(&linear, &mut extended, e, u);
        let [b, r] = ukf::step(&linear, &mut unscented, e, u);
        // The tolerance allows for rounding errors.
        assert!((a - b).abs() < 1e-11 && (s - r).abs() < 1e-12, "{t}");
    }
    for i in 0..2 {
        for j in 0..2 {
            assert!((extended.p[i][j] - unscented.p[i][j]).abs() < 1e-12);
        }
    }
}

/// Near the true values, with small variances, the sigma points stay in the range in which the model is nearly linear.
#[test]
fn both_filters_nearly_agree_for_small_covariance() {
    let mut p = [[0.0; N]; N];
    for (i, x) in X.iter().enumerate() {
        p[i][i] = (1e-4 * x).powi(2);
    }
    let small = Model {
        drift: MODEL.drift.map(|q| 1e-4 * q),
        ..MODEL
    };
    let mut extended = AugmentedState { x: X, p };
    let (mut unscented, mut truth) = (extended, X);
    for t in 0..200 {
        let e = (0.11 * f64::from(t)).sin();
        truth = small.transition(&truth, e);
        let u = Model::output(&truth) + 0.003 * (1.9 * f64::from(t)).sin();
        ekf::step(&small, &mut extended, e, u);
        ukf::step(&small, &mut unscented, e, u);
    }
    for i in ETA_START..N {
        let apart = (extended.x[i] - unscented.x[i]).abs();
        // The difference is due to second-order terms, for standard errors of about a thousandth.
        assert!(
            apart < 0.05 * extended.p[i][i].sqrt() && apart < 1e-4 * X[i],
            "{i}: {apart}"
        );
    }
}

#[test]
fn first_order_filter_power_matches_the_closed_form() {
    assert!((sum_of_squares(&[-0.8]) - 1.0 / (1.0 - 0.64)).abs() < 1e-12);
    assert_eq!(sum_of_squares(&[]), 1.0);
    assert_eq!(sum_of_squares(&[-3.0]), 1.0);
}
