//! The recursive prediction-error method compared with its plain implementation in Python
//! (`fixtures/recursive/make.py`), while theta changes: only then does the order of the filters matter.

#![allow(clippy::unwrap_used)]

use hoid_core::{
    adaptation::Forgetting,
    covariance::Covariance,
    error_bars::ErrorBars,
    innovation_variance::InnovationVariance,
    predictor::{Predictor, Regressor},
    recursion::StablePolynomials,
    rpem::Rpem,
    shape::{AnyShape, FixedShape, Shape},
    ud_covariance::UdCovariance,
};

const N: usize = 8;
const LAMBDA: f64 = 1.0 - 1.0 / 256.0;
const P0: f64 = 0.1;

struct Row {
    name: String,
    shape: AnyShape,
    x: f64,
    u: f64,
    innovation: f64,
    theta: Vec<f64>,
}

fn rows() -> Vec<Row> {
    include_str!("../../../fixtures/recursive/rpem.csv")
        .lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            let order = |i: usize| cells[i].parse().unwrap();
            let number = |i: usize| cells[i].parse().unwrap();
            Row {
                name: cells[0].to_owned(),
                shape: AnyShape {
                    na: order(1),
                    nb: order(2),
                    nc: order(3),
                    nd: order(4),
                    nf: order(5),
                },
                x: number(6),
                u: number(7),
                innovation: number(8),
                theta: cells[9].split(' ').map(|v| v.parse().unwrap()).collect(),
            }
        })
        .collect()
}

fn recursion(shape: AnyShape, regressor: Regressor) -> Rpem<AnyShape, N, 8, Covariance<N>> {
    let mut theta = [0.0; N];
    let mut at = 0;
    for (n, values) in [
        (shape.na, [-0.4, 0.0]),
        (shape.nb, [0.02, 0.0]),
        (shape.nc, [0.0, 0.0]),
        (shape.nd, [-0.4, 0.0]),
        (shape.nf, [-1.6, 0.7]),
    ] {
        theta[at..at + n].copy_from_slice(&values[..n]);
        at += n;
    }
    let forgetting = Forgetting::Exponential { lambda: [LAMBDA; N] };
    let covariance = Covariance::new(UdCovariance::diagonal([P0; N]), forgetting, [f64::INFINITY; N]);
    let mut unit = [[0.0; N]; N];
    (0..N).for_each(|i| unit[i][i] = P0);
    let bars = ErrorBars::new(&unit, InnovationVariance::new(0.0, 0.0, 1.0), f64::INFINITY);
    Rpem::new(shape, regressor, StablePolynomials::Predictor, theta, covariance, bars).unwrap()
}

/// Returns, for each shape, the largest difference of theta from the Python implementation, relative to the largest
/// parameter.
fn differences(regressor: Regressor) -> Vec<(String, f64)> {
    let mut found: Vec<(String, f64)> = Vec::new();
    let mut running = None;
    for row in rows() {
        if found.last().is_none_or(|(name, _)| *name != row.name) {
            found.push((row.name.clone(), 0.0));
            running = Some(recursion(row.shape, regressor));
        }
        let recursion = running.as_mut().unwrap();
        let step = recursion.step(row.x, row.u);
        let scale = row.theta.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let worst = &mut found.last_mut().unwrap().1;
        for (ours, theirs) in recursion.theta().iter().zip(&row.theta) {
            *worst = worst.max((ours - theirs).abs() / scale);
        }
        let size = 1.0_f64.max(row.innovation.abs());
        *worst = worst.max((step.innovation - row.innovation).abs() / size);
        assert_eq!(row.theta.len(), row.shape.parameter_count());
    }
    found
}

#[test]
fn gradient_is_one_direct_form_filter_for_varying_theta() {
    let found = differences(Regressor::Gradient);
    assert_eq!(found.len(), 6);
    for (name, difference) in found {
        assert!(difference < 1e-9, "{name}: {difference:e}");
    }
}

/// Shows that the test can fail: a cascade of 1/F and D/C is a different recursion if the model has F together with C
/// or D.
#[test]
fn cascade_differs_from_the_direct_form() {
    for (name, difference) in differences(Regressor::Cascade) {
        let same = ["armax", "oe", "ararx"].contains(&name.as_str());
        assert_eq!(difference < 1e-9, same, "{name}: {difference:e}");
    }
}

/// Effect of the order of the two filters while theta changes, from the page on recursive identification: with one pole
/// and one zero the difference between the cascade and the direct form is
/// `Delta(t) = -f(t) Delta(t-1) + [f(t) d(t-1) - d(t) f(t-1)] z(t-2)`, `z = x/F`.
#[test]
fn filter_order_matters_only_while_theta_changes() {
    let shape = FixedShape::<0, 1, 0, 1, 1>;
    let [mut direct, mut cascade] =
        [Regressor::Gradient, Regressor::Cascade].map(|regressor| Predictor::<_, 3, 3>::new(shape, regressor).unwrap());
    let (mut difference, mut largest) = (0.0, 0.0_f64);
    let (mut z, mut before) = ([0.0; 2], [0.0; 2]);
    for t in 0..400 {
        let time = f64::from(t);
        let (x, u) = ((0.3 * time).sin() + (0.7 * time).cos(), (0.2 * time).sin());
        // d is constant in the first half, and so is f.
        let moving = (time - 200.0).max(0.0);
        let (d, f) = (-0.8 + 0.1 * (0.3 * moving).sin(), -0.95 + 0.04 * (0.3 * moving).sin());
        let theta = [0.1, d, f];
        let [psi, psi_c] = [&mut direct, &mut cascade].map(|predictor| {
            let (psi, _) = predictor.predict(&theta, x, u);
            predictor.correct(&theta);
            psi
        });
        difference = -f * difference + (f * before[0] - d * before[1]) * z[1];
        assert!((psi_c[0] - psi[0] - difference).abs() < 1e-11, "{t}: {difference}");
        assert!(t > 200 || difference.abs() < 1e-12, "theta stays: {difference}");
        largest = largest.max(difference.abs() / psi[0].abs().max(1.0));
        z = [x - f * z[0], z[0]];
        before = [d, f];
    }
    assert!(largest > 0.1, "the order matters: {largest}");
}
