#![allow(clippy::unwrap_used)]

use hoid_model::{
    Orders,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};

use super::{regress, solve_normal_equations};
use crate::criterion::Data;

fn orders(na: usize, nb: usize, nk: usize) -> Orders {
    Orders {
        na,
        nb,
        nk,
        ..Orders::default()
    }
}

/// Returns the solution by QR, without normal equations. The residuals start at sample `first`, and the regressors use
/// the samples before it.
fn solve_by_qr(orders: &Orders, data: &[Data<'_>], first: usize) -> (Vec<f64>, f64, Vec<f64>) {
    let p = orders.na + orders.nb;
    let mut columns: Vec<f64> = Vec::new();
    for lag in 1..=orders.na {
        data.iter()
            .for_each(|d| columns.extend(d.u[first - lag..d.u.len() - lag].iter().map(|u| -u)));
    }
    for j in 0..orders.nb {
        let lag = orders.nk + j;
        data.iter()
            .for_each(|d| columns.extend(&d.e[first - lag..d.e.len() - lag]));
    }
    let mut y: Vec<f64> = data.iter().flat_map(|d| &d.u[first..]).copied().collect();
    let solved = crate::linalg::least_squares::LeastSquares::factor(&mut columns, &mut y);
    assert_eq!(solved.rank, p);
    (solved.solution(), solved.residual_sum_of_squares, solved.inverse_gram())
}

#[test]
fn normal_equations_match_qr() {
    let cases = [
        (Condition::C1, orders(2, 2, 29), true),
        (Condition::C4, orders(2, 2, 40), true),
        // More lags of slow signals are nearly linearly dependent, so QR is used.
        (Condition::C2, orders(5, 4, 20), false),
        (Condition::C1, orders(0, 3, 29), false),
    ];
    for (condition, orders, by_products) in cases {
        let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
        let records = [0, 1].map(|replication| {
            let run_seed = RunSeed {
                replication,
                ..RunSeed::default()
            };
            simulator.run(run_seed, false).unwrap()
        });
        let data = Data::of(&records);
        assert_eq!(
            solve_normal_equations(&orders, &data, 50).is_some(),
            by_products,
            "{condition}"
        );
        let found = regress(&orders, &data, 50).unwrap();
        let (theta, squares, inverse) = solve_by_qr(&orders, &data, 50);
        // The two solutions differ by rounding; the scaled normal matrix has a condition number of up to 1e7.
        for (a, b) in found.theta.iter().zip(&theta) {
            assert!((a - b).abs() < 1e-11 * b.abs(), "{condition}: {a} and {b}");
        }
        assert!((found.sum_of_squares - squares).abs() < 1e-12 * squares);
        for (a, b) in found.inverse_gram.iter().zip(&inverse) {
            assert!((a - b).abs() < 1e-9 * b.abs(), "{condition}: {a} and {b}");
        }
    }
}

#[test]
fn ill_conditioned_problems_are_solved_by_qr() {
    let n = 400;
    let e: Vec<f64> = (0..n)
        .map(|t| (0.11 * f64::from(t)).sin() + (1.9 * f64::from(t)).cos())
        .collect();
    let u: Vec<f64> = (0..n)
        .map(|t| (0.07 * f64::from(t)).sin() + 0.3 * (2.3 * f64::from(t)).cos())
        .collect();
    let decide =
        |o: &Orders, e: &[f64], u: &[f64], first| solve_normal_equations(o, &[Data::new(e, u)], first).is_some();
    let two = orders(1, 1, 1);
    assert!(decide(&two, &e, &u, 2));
    // QR is required for zeros before the record, a constant input, dependent columns, and an exact fit.
    assert!(!decide(&two, &e, &u, 0));
    assert!(!decide(&two, &vec![0.0; e.len()], &u, 2));
    assert!(!decide(
        &orders(0, 5, 1),
        &e[..].iter().map(|_| 1.0).collect::<Vec<_>>(),
        &u,
        6
    ));
    let exact: Vec<f64> = (0..e.len()).map(|t| if t > 0 { 0.5 * e[t - 1] } else { 0.0 }).collect();
    assert!(!decide(&orders(0, 1, 1), &e, &exact, 2));
    let solved = regress(&orders(0, 1, 1), &[Data::new(&e, &exact)], 2).unwrap();
    assert!((solved.theta[0] - 0.5).abs() < 1e-15 && solved.sum_of_squares < 1e-25);
    // Signals that are not finite are rejected as well.
    let mut broken = u.clone();
    broken[7] = f64::NAN;
    assert!(!decide(&two, &e, &broken, 2));
}
