use hoid_model::Orders;

use super::*;
use crate::criterion::Workspace;
use crate::criterion::{Criterion, Data, InitialState, first_residual};

fn signals(n: usize, noise: f64) -> (Vec<f64>, Vec<f64>) {
    let mut state = 99_u64;
    let mut draw = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let e: Vec<f64> = (0..n).map(|_| draw()).collect();
    let (mut w, mut u, mut colour) = (vec![0.0; 3], vec![0.0; 3], 0.0);
    for t in 3..n {
        w.push(1.5 * w[t - 1] - 0.7 * w[t - 2] + 0.5 * e[t - 1] + 0.2 * e[t - 2]);
        colour = 0.8 * colour + noise * draw();
        u.push(w[t] + colour);
    }
    (e, u)
}

fn orders() -> Orders {
    Orders {
        nb: 2,
        nd: 1,
        nf: 2,
        nk: 1,
        ..Orders::default()
    }
}

fn run(e: &[f64], u: &[f64], start: &[f64]) -> Option<Minimum> {
    run_with(e, u, start, &SearchOptions::default())
}

fn run_with(e: &[f64], u: &[f64], start: &[f64], options: &SearchOptions) -> Option<Minimum> {
    let criterion = Criterion {
        orders: orders(),
        data: vec![Data::new(e, u)],
        initial: InitialState::Estimate,
        first: first_residual(&orders(), InitialState::Estimate),
        weights: None,
        further: Vec::new(),
    };
    minimise(&criterion, start.to_vec(), options, None, &mut Workspace::default())
}

#[test]
fn noise_free_parameters_are_found_exactly() {
    let (e, u) = signals(500, 0.0);
    let end = run(&e, &u, &[0.1, 0.1, 0.0, -1.0, 0.3]).unwrap();
    assert_eq!(end.termination.reason, Reason::ExactFit);
    // d1 is undetermined without noise; the system is determined.
    for (a, b) in [0, 1, 3, 4].map(|i| end.theta[i]).iter().zip([0.5, 0.2, -1.5, 0.7]) {
        assert!((a - b).abs() < 1e-10);
    }
}

#[test]
fn gradient_is_zero_at_convergence() {
    let (e, u) = signals(2000, 0.1);
    // At convergence with this tolerance, the cosines are at most sqrt(tolerance), 1e-6 by default.
    for (tolerance, left) in [(1e-12, 1e-6), (1e-15, 3.2e-8)] {
        let options = SearchOptions {
            tolerance,
            ..SearchOptions::default()
        };
        let end = run_with(&e, &u, &[0.1, 0.1, 0.0, -1.0, 0.3], &options).unwrap();
        assert!(end.termination.converged(), "{:?}", end.termination);
        let p = end.theta.len();
        for i in 0..p {
            let cosine = end.linearisation.descent[i]
                / (end.linearisation.gram[i * p + i] * end.linearisation.sum_of_squares).sqrt();
            assert!(cosine.abs() < left, "{i}: {cosine}");
        }
    }
}

/// Rosenbrock's valley as a sum of squares: `(10 (y - x^2))^2 + (1 - x)^2`, with limits.
struct Valley {
    limits: Option<Vec<(f64, f64)>>,
}

impl Objective for Valley {
    fn is_feasible(&self, theta: &[f64]) -> bool {
        theta.iter().all(|t| t.is_finite())
    }

    fn linearise(&self, theta: &[f64], _: &mut Workspace) -> Linearisation {
        let (x, y) = (theta[0], theta[1]);
        let eps = [10.0 * (y - x * x), 1.0 - x];
        // Negative derivatives, one row for each element of eps.
        let psi = [[20.0 * x, -10.0], [1.0, 0.0]];
        let product = |i: usize, j: usize| psi[0][i] * psi[0][j] + psi[1][i] * psi[1][j];
        Linearisation {
            sum_of_squares: eps[0] * eps[0] + eps[1] * eps[1],
            descent: (0..2).map(|i| psi[0][i] * eps[0] + psi[1][i] * eps[1]).collect(),
            gram: vec![product(0, 0), product(0, 1), product(1, 0), product(1, 1)],
        }
    }

    fn output_power(&self) -> f64 {
        1.0
    }

    fn limits(&self) -> Option<&[(f64, f64)]> {
        self.limits.as_deref()
    }
}

fn descend(valley: &Valley, method: SearchMethod, max_iterations: usize) -> Minimum {
    let options = SearchOptions {
        method,
        max_iterations,
        ..SearchOptions::default()
    };
    minimise(valley, vec![-1.2, 1.0], &options, None, &mut Workspace::default()).unwrap()
}

#[test]
fn every_method_descends_the_valley() {
    let open = Valley { limits: None };
    for method in [
        SearchMethod::Automatic,
        SearchMethod::LevenbergMarquardt,
        SearchMethod::GaussNewton,
    ] {
        let end = descend(&open, method, 100);
        assert!(end.termination.converged(), "{method:?}");
        assert!(end.theta.iter().all(|t| (t - 1.0).abs() < 1e-8), "{method:?}");
    }
    // Steepest descent is slow in a valley, but the loss decreases.
    let slow = descend(&open, SearchMethod::SteepestDescent, 2000);
    assert!(
        slow.linearisation.sum_of_squares < 0.1,
        "{}",
        slow.linearisation.sum_of_squares
    );
    assert!(slow.termination.iterations > 100);
}

#[test]
fn limits_and_fixed_parameters_are_respected() {
    let bounded = Valley {
        limits: Some(vec![(-2.0, 0.5), (f64::NEG_INFINITY, f64::INFINITY)]),
    };
    for method in [
        SearchMethod::Automatic,
        SearchMethod::LevenbergMarquardt,
        SearchMethod::GaussNewton,
    ] {
        let end = descend(&bounded, method, 200);
        assert!(end.termination.converged(), "{method:?}: {:?}", end.termination);
        assert!((end.theta[0] - 0.5).abs() < 1e-12 && (end.theta[1] - 0.25).abs() < 1e-8);
        assert_eq!(free_parameters(&bounded, &end.theta, &end.linearisation.descent), [1]);
    }
    let fixed = Valley {
        limits: Some(vec![(f64::NEG_INFINITY, f64::INFINITY), (4.0, 4.0)]),
    };
    let end = descend(&fixed, SearchMethod::Automatic, 200);
    assert_eq!(end.theta[1], 4.0);
    // The loss is stationary in x for y = 4 if 200 x (x^2 - 4) = 1 - x; this root is on the same side as the start.
    assert!((end.theta[0] + 1.99812).abs() < 1e-4, "{}", end.theta[0]);
    let slope = end.linearisation.descent[0] / end.linearisation.gram[0].sqrt();
    assert!(slope.abs() < 1e-6);
}

#[test]
fn unstable_starts_and_the_iteration_limit_are_reported() {
    let (e, u) = signals(500, 0.1);
    assert!(run(&e, &u, &[0.1, 0.1, 0.0, -2.1, 1.2]).is_none());
    assert!(run(&e, &u, &[f64::NAN, 0.1, 0.0, -1.0, 0.3]).is_none());
    let criterion = Criterion {
        orders: orders(),
        data: vec![Data::new(&e, &u)],
        initial: InitialState::Zero,
        first: 0,
        weights: None,
        further: Vec::new(),
    };
    let limited = SearchOptions {
        max_iterations: 1,
        ..SearchOptions::default()
    };
    let end = minimise(
        &criterion,
        vec![0.1, 0.1, 0.0, -1.0, 0.3],
        &limited,
        None,
        &mut Workspace::default(),
    )
    .unwrap();
    assert_eq!(
        end.termination,
        Termination {
            reason: Reason::IterationLimit,
            iterations: 1
        }
    );
    assert!(!end.termination.converged());
}

#[test]
fn secant_saves_steps_for_a_wrong_model() {
    let (e, u) = signals(3000, 0.4);
    // The model has one pole instead of the two that are needed, and white noise instead of coloured noise.
    let orders = Orders {
        nb: 2,
        nf: 1,
        nk: 3,
        ..Orders::default()
    };
    let criterion = Criterion {
        orders,
        data: vec![Data::new(&e, &u)],
        initial: InitialState::Estimate,
        first: first_residual(&orders, InitialState::Estimate),
        weights: None,
        further: Vec::new(),
    };
    let by = |method| {
        let options = SearchOptions {
            method,
            ..SearchOptions::default()
        };
        minimise(
            &criterion,
            vec![0.1, 0.1, -0.3],
            &options,
            None,
            &mut Workspace::default(),
        )
        .unwrap()
    };
    let (with, without) = (by(SearchMethod::Automatic), by(SearchMethod::LevenbergMarquardt));
    assert!(with.termination.converged() && without.termination.converged());
    let (few, many) = (with.termination.iterations, without.termination.iterations);
    assert!(3 * few <= 2 * many, "{few} steps with the secant, {many} without");
    // A remaining relative decrease of 1e-12 corresponds to 1e-6 of the length of theta in units of the residuals.
    for i in 0..3 {
        let error = (without.linearisation.sum_of_squares / (3000.0 * without.linearisation.gram[4 * i])).sqrt();
        assert!((with.theta[i] - without.theta[i]).abs() < 1e-4 * error);
    }
}
