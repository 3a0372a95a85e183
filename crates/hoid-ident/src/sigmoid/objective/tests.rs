use hoid_model::Form;

use super::*;

/// Indices of a gain and a lead in theta.
const K_E: [usize; 2] = [0, 1];
const T_L: [usize; 2] = [2, 3];
const MIDPOINT_INDEX: usize = 4;
const OMEGA_INDEX: usize = 6;
const ZETA_INDEX: usize = 7;
const DELAY_INDEX: usize = 8;
const NOISE_INDEX: usize = 9;

/// Returns a record that does not start from rest: sums of sinusoids, with white noise on u.
pub(super) fn record(n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut state = 7_u64;
    let mut noise = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let (mut e, mut u) = (Vec::new(), Vec::new());
    for t in 0..n {
        let time = t as f64 * 0.01;
        e.push((1.3 * time).sin() + 0.6 * (3.1 * time + 1.0).cos() + 0.2 * (7.7 * time).sin());
        u.push(0.1 * (1.3 * time - 0.4).sin() + 0.05 * (3.1 * time).cos() + 0.02 * noise());
    }
    (e, u)
}

fn theta(nd: usize) -> Vec<f64> {
    let physical = [0.09, 0.07, 0.4, 1.2, 5.1, f64::ln(2.0), 11.25, 0.35, 0.1234];
    physical.into_iter().chain([-0.8, 0.1].into_iter().take(nd)).collect()
}

fn criterion<'a>(e: &'a [f64], u: &'a [f64], nd: usize) -> ChangeCriterion<'a> {
    ChangeCriterion {
        layout: Layout::new(Form::Lead, true, nd),
        data: vec![Data { e, u, start_s: -0.3 }],
        sample_time: SampleTime::AT_100_HZ,
        first: 20 + nd,
        limits: vec![(f64::NEG_INFINITY, f64::INFINITY); NOISE_INDEX + nd],
        piece: None,
        changes: true,
        weights: None,
        penalty: Vec::new(),
        level: false,
    }
}

#[test]
fn gradient_agrees_with_finite_differences() {
    let (e, u) = record(1000);
    for nd in [0, 1, 2] {
        for (weighted, level) in [(false, false), (true, false), (false, true), (true, true)] {
            let mut c = criterion(&e, &u, nd);
            c.level = level;
            if weighted {
                let rows = c.residual_count();
                c.weights = Some(vec![(0..rows).map(|t| if t < 500 { 1.3 } else { 0.7 }).collect()]);
            }
            let theta = theta(nd);
            let mut ws = Workspace::default();
            let exact = c.linearise(&theta, &mut ws);
            for i in 0..theta.len() {
                let h = 1e-4 * theta[i].abs();
                let mut at = |factor: f64| {
                    let mut moved = theta.clone();
                    moved[i] += factor * h;
                    c.linearise(&moved, &mut ws).sum_of_squares
                };
                let slope = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h);
                let scale = (exact.gram[i * theta.len() + i] * exact.sum_of_squares).sqrt();
                // The difference has a rounding error of 1e-16 of the loss divided by h, and a truncation error of
                // order h^4.
                assert!(
                    (slope + 2.0 * exact.descent[i]).abs() < 1e-8 * scale,
                    "nd {nd} weighted {weighted} level {level} parameter {i}: {slope} and {}",
                    -2.0 * exact.descent[i]
                );
            }
        }
    }
}

#[test]
fn columns_match_residual_derivatives_except_initial_states() {
    let (e, u) = record(1000);
    let c = criterion(&e, &u, 1);
    let theta = theta(1);
    let pass = c.pass(&theta, 0).unwrap();
    let columns = c.columns(&theta, 0, &pass);
    let project = |x: &mut Vec<f64>| {
        for q in &pass.basis {
            let part = dot(q, &x[..q.len()]);
            add_scaled(x, -part, q);
        }
    };
    for (i, column) in columns.into_iter().enumerate() {
        let h = 1e-5 * theta[i].abs();
        let at = |sign: f64| {
            let mut moved = theta.clone();
            moved[i] += sign * h;
            c.pass(&moved, 0).unwrap().eps
        };
        let (up, down) = (at(1.0), at(-1.0));
        let mut difference: Vec<f64> = up.iter().zip(&down).map(|(a, b)| (b - a) / (2.0 * h)).collect();
        let mut column = column;
        // The change in the basis of the initial states lies within this basis, except for the contribution of the
        // residual at the start.
        project(&mut difference);
        project(&mut column);
        let apart: Vec<f64> = difference.iter().zip(&column).map(|(a, b)| a - b).collect();
        let (size, error) = (dot(&column, &column).sqrt(), dot(&apart, &apart).sqrt());
        // Kaufman's approximation omits a term of the size of the residual's share in the changed basis.
        assert!(error < 0.05 * size, "parameter {i}: {error} of {size}");
        // After the initial transient no term is omitted.
        let late = |x: &[f64]| dot(&x[800..], &x[800..]).sqrt();
        assert!(late(&apart) < 1e-5 * size, "parameter {i}: {} of {size}", late(&apart));
    }
}

#[test]
fn initial_state_of_noise_free_data_is_fitted_exactly() {
    // A record cut out of a longer one has an unknown past, but is still fitted to rounding accuracy.
    let (e, _) = record(2000);
    let silence = vec![0.0; 2000];
    let whole = criterion(&e, &silence, 0);
    let theta = theta(0);
    // With u = 0 and rest before the record, the residual is -w.
    let unit = UnitOperator::of(&whole.layout, &theta, None, whole.sample_time).unwrap();
    let y = [unit.response(0, &e), unit.response(1, &e)];
    let u: Vec<f64> = (0..2000)
        .map(|t| {
            if t < unit.nk {
                return 0.0;
            }
            let g = SigmoidPoint::at(&whole.layout, &theta, -0.3 + 0.01 * t as f64 - theta[DELAY_INDEX]);
            g.numerator(0) * y[0][t - unit.nk] + g.numerator(1) * y[1][t - unit.nk]
        })
        .collect();
    let mut cut = criterion(&e[300..], &u[300..], 0);
    cut.data[0].start_s = -0.3 + 3.0;
    let eps = cut.pass(&theta, 0).unwrap().eps;
    assert!(
        eps.iter().all(|x| x.abs() < 1e-12),
        "{:e}",
        eps.iter().fold(0.0_f64, |m, x| m.max(x.abs()))
    );
    // The response to the initial state is far above rounding, so it must have been estimated.
    assert!(u[300].abs() > 1e-3);
}

#[test]
fn only_the_first_state_is_used_without_a_change() {
    let (e, u) = record(600);
    let c = ChangeCriterion {
        changes: false,
        ..criterion(&e, &u, 1)
    };
    let at = c.linearise(&theta(1), &mut Workspace::default());
    let mut other = theta(1);
    (other[K_E[1]], other[T_L[1]], other[MIDPOINT_INDEX]) = (0.5, 0.1, 1.0);
    let there = c.linearise(&other, &mut Workspace::default());
    assert_eq!(at.sum_of_squares, there.sum_of_squares);
    assert!(c.layout.change_indices().iter().all(|&i| at.descent[i] == 0.0));
}

#[test]
fn invalid_parameters_are_infeasible() {
    let (e, u) = record(600);
    let c = criterion(&e, &u, 1);
    assert!(c.is_feasible(&theta(1)));
    for (i, value) in [
        (ZETA_INDEX, -0.1),
        (OMEGA_INDEX, 0.0),
        (DELAY_INDEX, -0.01),
        (DELAY_INDEX, 0.5),
        (K_E[0], f64::NAN),
    ] {
        let mut wrong = theta(1);
        wrong[i] = value;
        assert!(!c.is_feasible(&wrong), "{i}");
    }
}
