//! Each recursion compared with a reference implementation.

#![allow(clippy::unwrap_used)]

mod common;

use common::{
    Noise, PlainCovariance, box_jenkins, covariance, diagonal, error_bars, relative_difference, shapes,
    start_coefficients,
};
use hoid_core::{
    adaptation::{Adaptation, Forgetting},
    covariance::Covariance,
    error_bars::{ErrorBars, ErrorPropagation, NoErrorBars},
    innovation_variance::InnovationVariance,
    predictor::Regressor,
    recursion::StablePolynomials,
    rls::Rls,
    rpem::Rpem,
    sensitivities::{ErrorLayout, Sensitivities},
    shape::{AnyShape, FixedShape},
    ud_covariance::UdCovariance,
    window::Window,
};

const LAMBDA: f64 = 1.0 - 1.0 / 256.0;

fn forgetting_rules<const N: usize>() -> Vec<Forgetting<N>> {
    vec![
        Forgetting::Exponential { lambda: [1.0; N] },
        Forgetting::Exponential { lambda: [LAMBDA; N] },
        Forgetting::Exponential {
            lambda: std::array::from_fn(|i| if i % 2 == 0 { LAMBDA } else { 1.0 }),
        },
        Forgetting::RandomWalk {
            drift: std::array::from_fn(|i| 1e-4 * i as f64),
        },
        Forgetting::Variable {
            memory: 256.0,
            smallest: 0.9,
        },
        Forgetting::Directional { lambda: LAMBDA },
        Forgetting::Gradient { rate: 0.5 },
    ]
}

#[test]
fn factored_covariance_matches_the_plain_form() {
    let data = box_jenkins(20_000, 1, 0.02);
    let shape = shapes()[4];
    for forgetting in forgetting_rules::<5>() {
        let mut recursion = Rpem::new(
            shape,
            Regressor::Gradient,
            StablePolynomials::Predictor,
            start_coefficients(&shape),
            covariance::<5>(1.0, forgetting.clone()),
            error_bars::<5, 2>(1.0),
        )
        .unwrap();
        let mut plain = PlainCovariance {
            p: diagonal(1.0),
            power: 0.0,
            largest: 0.0,
        };
        let (mut worst, mut worst_gain) = (0.0_f64, 0.0_f64);
        for &(x, u) in &data {
            let before = *recursion.theta();
            let variance = recursion.innovation_variance();
            let step = recursion.step(x, u);
            let limit = 5.0 * variance.sqrt();
            let limited = if limit > 0.0 {
                step.innovation.clamp(-limit, limit)
            } else {
                step.innovation
            };
            let gain = plain.update(&forgetting, recursion.psi(), limited, variance);
            if !step.shortened {
                for i in 0..5 {
                    // The difference is in units of the standard error, so parameters of any size have the same weight.
                    let difference = recursion.theta()[i] - before[i] - gain[i] * limited;
                    worst_gain = worst_gain.max(difference.abs() / plain.p[i][i].sqrt());
                }
            }
            worst = worst.max(relative_difference(&plain.p, &recursion.adaptation().matrix()));
        }
        // Rounding error of the plain form: 20 000 samples of a matrix with a condition number of 1e6.
        assert!(worst < 1e-9, "{forgetting:?}: {worst:e}");
        assert!(worst_gain < 1e-9, "{forgetting:?}: {worst_gain:e}");
    }
}

#[test]
fn rpem_without_c_d_f_is_bit_identical_to_rls() {
    let data = box_jenkins(3000, 2, 0.02);
    let shape = shapes()[0];
    for forgetting in forgetting_rules::<4>() {
        let adaptation = covariance::<4>(0.1, forgetting);
        let mut rls = Rls::new(
            shapes()[0],
            start_coefficients(&shape),
            adaptation.clone(),
            error_bars::<4, 0>(0.1),
        )
        .unwrap();
        let mut rpem = Rpem::new(
            shape,
            Regressor::Gradient,
            StablePolynomials::Predictor,
            start_coefficients(&shape),
            adaptation,
            error_bars::<4, 0>(0.1),
        )
        .unwrap();
        for &(x, u) in &data {
            assert_eq!(rls.step(x, u), rpem.step(x, u));
            assert_eq!(rls.theta(), rpem.theta());
        }
        assert_eq!(rls.adaptation(), rpem.adaptation());
        assert_eq!(rls.normalised_covariance(), rpem.normalised_covariance());
        assert_eq!(rls.innovation_variance(), rpem.innovation_variance());
    }
    let window = || Window::<4, Vec<f64>>::new(vec![0.0; Window::<4, Vec<f64>>::memory_length(100)], 4).unwrap();
    let mut rls = Rls::new(
        shapes()[0],
        start_coefficients(&shape),
        window(),
        error_bars::<4, 0>(0.1),
    )
    .unwrap();
    let mut rpem = Rpem::new(
        shape,
        Regressor::Gradient,
        StablePolynomials::Predictor,
        start_coefficients(&shape),
        window(),
        error_bars::<4, 0>(0.1),
    )
    .unwrap();
    for &(x, u) in &data {
        rls.step(x, u);
        rpem.step(x, u);
        assert_eq!(rls.theta(), rpem.theta());
    }
}

#[test]
fn estimate_without_error_bars_is_bit_identical() {
    let data = box_jenkins(3000, 21, 0.02);
    let (arx, bj) = (shapes()[0], shapes()[4]);
    let unlimited = |p0: f64| {
        ErrorBars::new(
            &diagonal::<5>(p0),
            InnovationVariance::new(0.0, 0.0, 1.0),
            f64::INFINITY,
        )
    };
    for forgetting in forgetting_rules::<5>() {
        let needs_innovation_variance = matches!(forgetting, Forgetting::Variable { .. });
        let adaptation = || covariance::<5>(0.1, forgetting.clone());
        let rpem = |adaptation| {
            let (regressor, stable) = (Regressor::Gradient, StablePolynomials::Predictor);
            Rpem::<_, 5, 0, _, _>::new(bj, regressor, stable, start_coefficients(&bj), adaptation, NoErrorBars)
        };
        // A rule that needs the innovation variance is rejected if it is not estimated.
        assert_eq!(rpem(adaptation()).is_none(), needs_innovation_variance);
        assert_eq!(
            Rls::new(arx, start_coefficients(&arx), adaptation(), NoErrorBars).is_none(),
            needs_innovation_variance
        );
        if needs_innovation_variance {
            continue;
        }
        let mut bare = rpem(adaptation()).unwrap();
        let (regressor, stable) = (Regressor::Gradient, StablePolynomials::Predictor);
        let mut full = Rpem::<_, 5, 0, _>::new(
            bj,
            regressor,
            stable,
            start_coefficients(&bj),
            adaptation(),
            unlimited(0.1),
        )
        .unwrap();
        let mut bare_rls = Rls::new(arx, start_coefficients(&arx), adaptation(), NoErrorBars).unwrap();
        let mut full_rls = Rls::new(arx, start_coefficients(&arx), adaptation(), unlimited(0.1)).unwrap();
        for &(x, u) in &data {
            assert_eq!(bare.step(x, u), full.step(x, u));
            assert_eq!(bare.theta(), full.theta());
            assert_eq!(bare_rls.step(x, u), full_rls.step(x, u));
            assert_eq!(bare_rls.theta(), full_rls.theta());
        }
    }
}

#[test]
fn fixed_and_dynamic_orders_are_bit_identical() {
    let data = box_jenkins(3000, 13, 0.02);
    let shape = shapes()[4];
    let adaptation = covariance::<5>(0.1, Forgetting::Exponential { lambda: [LAMBDA; 5] });
    let fixed = FixedShape::<0, 2, 0, 1, 2>;
    let mut any = Rpem::new(
        shape,
        Regressor::Gradient,
        StablePolynomials::Predictor,
        start_coefficients(&shape),
        adaptation.clone(),
        error_bars::<5, 2>(0.1),
    )
    .unwrap();
    let mut typed = Rpem::new(
        fixed,
        Regressor::Gradient,
        StablePolynomials::Predictor,
        start_coefficients(&shape),
        adaptation,
        error_bars::<5, 2>(0.1),
    )
    .unwrap();
    for &(x, u) in &data {
        assert_eq!(any.step(x, u), typed.step(x, u));
        assert_eq!(any.theta(), typed.theta());
        assert_eq!(any.normalised_covariance(), typed.normalised_covariance());
    }
}

#[test]
fn equal_forgetting_matrix_matches_the_scalar_factor() {
    let data = box_jenkins(8192, 3, 0.02);
    let shape = shapes()[4];
    let make = |lambda: [f64; 5]| {
        let adaptation = covariance::<5>(0.1, Forgetting::Exponential { lambda });
        Rpem::new(
            shape,
            Regressor::Gradient,
            StablePolynomials::Predictor,
            start_coefficients(&shape),
            adaptation,
            error_bars::<5, 2>(0.1),
        )
        .unwrap()
    };
    let mut scalar = make([LAMBDA; 5]);
    // One entry differs in its last bit, so the path for a matrix is taken.
    let mut matrix = make([LAMBDA, LAMBDA, LAMBDA, LAMBDA, LAMBDA.next_up()]);
    for &(x, u) in &data {
        scalar.step(x, u);
        matrix.step(x, u);
    }
    let difference = relative_difference(&scalar.adaptation().matrix(), &matrix.adaptation().matrix());
    assert!(difference < 1e-9, "{difference:e}");
    for i in 0..5 {
        assert!((scalar.theta()[i] - matrix.theta()[i]).abs() < 1e-9);
    }
}

#[test]
fn window_matches_least_squares_over_its_samples() {
    const W: usize = 300;
    // Large samples come first: their rounding errors must be gone after two windows.
    let mut data = box_jenkins(2000, 4, 0.02);
    for (x, u) in &mut data[..700] {
        *x *= 1e6;
        *u *= 1e6;
    }
    let memory = vec![0.0; Window::<4, Vec<f64>>::memory_length(W)];
    let window = Window::<4, Vec<f64>>::new(memory, 4).unwrap();
    let unlimited = ErrorBars::new(
        &diagonal::<4>(1.0),
        InnovationVariance::new(0.0, 0.0, 1.0),
        f64::INFINITY,
    );
    let mut rls = Rls::new(shapes()[0], [0.0; 4], window, unlimited).unwrap();
    let regressor = |t: usize| {
        let at = |lag: usize| if t >= lag { data[t - lag] } else { (0.0, 0.0) };
        [-at(1).1, -at(2).1, at(0).0, at(1).0]
    };
    for t in 0..data.len() {
        rls.step(data[t].0, data[t].1);
        if t % 37 != 0 || t < 20 || (640..1210).contains(&t) {
            continue;
        }
        // Reference: modified Gram-Schmidt on the window.
        let rows: Vec<([f64; 4], f64)> = ((t + 1).saturating_sub(W)..=t)
            .map(|s| (regressor(s), data[s].1))
            .collect();
        let theta = gram_schmidt(&rows);
        for i in 0..4 {
            let difference = (rls.theta()[i] - theta[i]).abs();
            // Normal equations: the squared condition number of the regressors (1e4 squared) times rounding.
            assert!(
                difference < 1e-8 * (1.0 + theta[i].abs()),
                "{t}: {} and {}",
                rls.theta()[i],
                theta[i]
            );
        }
    }
}

/// Returns the least-squares solution by modified Gram-Schmidt.
fn gram_schmidt(rows: &[([f64; 4], f64)]) -> [f64; 4] {
    let mut columns: Vec<Vec<f64>> = (0..4).map(|j| rows.iter().map(|r| r.0[j]).collect()).collect();
    let mut y: Vec<f64> = rows.iter().map(|r| r.1).collect();
    let mut r = [[0.0; 4]; 4];
    let mut q_y = [0.0; 4];
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    for j in 0..4 {
        r[j][j] = dot(&columns[j], &columns[j]).sqrt();
        let q: Vec<f64> = columns[j].iter().map(|v| v / r[j][j]).collect();
        for k in j + 1..4 {
            r[j][k] = dot(&q, &columns[k]);
            let rjk = r[j][k];
            columns[k].iter_mut().zip(&q).for_each(|(v, q)| *v -= rjk * q);
        }
        q_y[j] = dot(&q, &y);
        let share = q_y[j];
        y.iter_mut().zip(&q).for_each(|(v, q)| *v -= share * q);
    }
    let mut theta = [0.0; 4];
    for j in (0..4).rev() {
        let known: f64 = (j + 1..4).map(|k| r[j][k] * theta[k]).sum();
        theta[j] = (q_y[j] - known) / r[j][j];
    }
    theta
}

#[test]
fn error_bars_match_the_covariance_and_its_forgetting_limit() {
    let data = box_jenkins(30_000, 9, 0.02);
    let shape = shapes()[0];
    let spread_of = |lambda: f64| {
        let adaptation = covariance::<4>(1.0, Forgetting::Exponential { lambda: [lambda; 4] });
        let mut rls = Rls::new(
            shapes()[0],
            start_coefficients(&shape),
            adaptation,
            error_bars::<4, 0>(1.0),
        )
        .unwrap();
        data.iter().for_each(|&(x, u)| {
            rls.step(x, u);
        });
        (rls.normalised_covariance(), rls.adaptation().matrix())
    };
    let (spread, p) = spread_of(1.0);
    assert!(relative_difference(&p, &spread) < 1e-9);
    let lambda = 1.0 - 1.0 / 4096.0;
    let (spread, p) = spread_of(lambda);
    for i in 0..4 {
        // The limit holds for a stationary regressor; over 4096 samples its power scatters.
        let ratio = spread[i][i] / (p[i][i] / (1.0 + lambda));
        assert!((ratio - 1.0).abs() < 0.1, "{i}: {ratio}");
    }
}

#[test]
fn guard_keeps_every_variance_within_its_bound() {
    const BOUND: f64 = 50.0;
    let mut noise = Noise(10);
    for forgetting in forgetting_rules::<5>().into_iter().skip(1) {
        // Forgetting during one round of the guard: e^{1/4}, or five samples with the smallest variable factor.
        let slack = if matches!(forgetting, Forgetting::Variable { .. }) {
            0.9_f64.powi(-5)
        } else {
            1.3
        };
        let mut adaptation = Covariance::new(UdCovariance::diagonal([1.0; 5]), forgetting.clone(), [BOUND; 5]);
        let mut bars: ErrorBars<5, 0> =
            ErrorBars::new(&diagonal::<5>(1.0), InnovationVariance::new(1.0, 100.0, 0.99), 5.0);
        for t in 0..200_000 {
            // First one direction is excited, then none, then all.
            let psi: [f64; 5] = match t % 60_000 {
                0..20_000 => [1.0, -2.0, 0.5, 0.0, 1.0].map(|v| v * noise.next()),
                20_000..50_000 => [0.0; 5],
                _ => std::array::from_fn(|_| noise.next()),
            };
            let eps = noise.next();
            let moved = adaptation.update(&psi, eps, &[0.0; 5], bars.innovation_variance());
            bars.update(
                &ErrorLayout::NO_FILTER_ERRORS,
                &Sensitivities::from_gradient(&psi),
                &moved.gain,
                eps,
            );
            adaptation.add_drift_to(&mut bars);
            let (p, spread) = (adaptation.matrix(), bars.normalised_covariance());
            for i in 0..5 {
                assert!(
                    p[i][i] <= slack * BOUND && p[i][i] >= 0.0,
                    "{forgetting:?} at {t}: {}",
                    p[i][i]
                );
                assert!(
                    spread[i][i] <= slack * BOUND && spread[i][i] >= 0.0,
                    "{forgetting:?} at {t}: {}",
                    spread[i][i]
                );
            }
            assert!(adaptation.is_valid() && bars.is_valid());
        }
    }
}

#[test]
fn pseudo_linear_regression_finds_a_model_with_coloured_noise() {
    let data = box_jenkins(60_000, 11, 0.05);
    let shape = AnyShape {
        na: 2,
        nb: 2,
        nc: 2,
        ..AnyShape::default()
    };
    // ARMAX data: system and noise share the poles.
    let mut noise = Noise(12);
    let (mut past, mut eps1, mut x1) = ([0.0; 2], 0.0, 0.0);
    let armax: Vec<(f64, f64)> = data
        .iter()
        .map(|&(x, _)| {
            let eps = 0.1 * noise.next();
            let u = 1.5 * past[0] - 0.7 * past[1] + 0.5 * x - 0.2 * x1 + eps + 0.4 * eps1;
            (past, eps1, x1) = ([u, past[0]], eps, x);
            (x, u)
        })
        .collect();
    let adaptation = covariance::<6>(100.0, Forgetting::Exponential { lambda: [1.0; 6] });
    let mut recursion = Rpem::new(
        shape,
        Regressor::PseudoLinear,
        StablePolynomials::Predictor,
        [0.0; 6],
        adaptation,
        error_bars::<6, 2>(100.0),
    )
    .unwrap();
    for &(x, u) in &armax {
        recursion.step(x, u);
    }
    for (found, truth) in recursion.theta().iter().zip([-1.5, 0.7, 0.5, -0.2, 0.4, 0.0]) {
        assert!((found - truth).abs() < 0.03, "{:?}", recursion.theta());
    }
}

#[test]
fn mismatched_shapes_and_unstable_starts_are_refused() {
    let make = |shape: AnyShape, theta: [f64; 4]| {
        let adaptation = covariance::<4>(1.0, Forgetting::Exponential { lambda: [1.0; 4] });
        Rpem::new(
            shape,
            Regressor::Gradient,
            StablePolynomials::Predictor,
            theta,
            adaptation,
            error_bars::<4, 4>(1.0),
        )
    };
    assert!(make(shapes()[5], [0.0; 4]).is_none());
    assert!(make(AnyShape::default(), [0.0; 4]).is_none());
    let oe = shapes()[2];
    assert!(make(oe, [0.1, 0.1, -2.1, 1.1]).is_none());
    assert!(make(oe, [0.1, 0.1, -1.8, 0.9]).is_some());
    assert!(Window::<4, Vec<f64>>::new(vec![0.0; 3], 4).is_none());
    assert!(
        Rls::new(
            AnyShape::default(),
            [0.0; 4],
            covariance::<4>(1.0, Forgetting::Exponential { lambda: [1.0; 4] }),
            error_bars::<4, 0>(1.0)
        )
        .is_none()
    );
}
