//! Compares the zero-order hold of the operator with 60-digit reference values, checks that its branches agree at their
//! boundaries, and tests degenerate inputs.

use super::*;
use std::vec::Vec;

const TS: f64 = 0.01;
const ROW_NAMES: [&str; 5] = ["b0", "b1", "b2", "f1", "f2"];
const COLUMN_NAMES: [&str; 5] = ["K_e", "K_e_dot", "omega_nm", "zeta_nm", "tau"];

struct Case {
    parameters: [f64; 4],
    delta: f64,
    ts: f64,
    coefficients: [f64; 5],
    sum: f64,
    /// Derivatives with respect to omega and to zeta.
    sum_slopes: [f64; 2],
    jacobian: [[f64; 5]; 5],
}

/// Returns the cases of fixtures/hold/make.py, computed with 60 digits.
fn cases() -> Vec<Case> {
    include_str!("../../../../fixtures/hold/held_operator.csv")
        .lines()
        .skip(1)
        .map(|line| {
            let v: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
            Case {
                parameters: [v[0], v[1], v[2], v[3]],
                delta: v[4],
                ts: v[5],
                coefficients: core::array::from_fn(|i| v[6 + i]),
                sum: v[11],
                sum_slopes: [v[12], v[13]],
                jacobian: core::array::from_fn(|i| core::array::from_fn(|j| v[14 + 5 * i + j])),
            }
        })
        .collect()
}

fn largest_magnitude(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, v| m.max(v.abs()))
}

fn column(jacobian: &[[f64; 5]; 5], j: usize) -> [f64; 5] {
    core::array::from_fn(|i| jacobian[i][j])
}

/// Returns the scales of a numerator, and of a denominator with its leading one.
fn scales(coefficients: &[f64; 5]) -> [f64; 5] {
    let (b, f) = (
        largest_magnitude(&coefficients[..3]),
        largest_magnitude(&coefficients[3..]).max(1.0),
    );
    [b, b, b, f, f]
}

/// Returns the largest pole times the sample time.
fn pole_size(omega: f64, zeta: f64, ts: f64) -> f64 {
    let zeta = zeta.abs().max(1.0);
    omega * ts * (zeta + (zeta * zeta - 1.0).sqrt())
}

fn assert_within(found: f64, expected: f64, bound: f64, what: std::fmt::Arguments<'_>) {
    let error = (found - expected).abs();
    assert!(
        error <= bound * f64::EPSILON,
        "{what}: {found} and {expected}, off by {:.2} of {:.2} bounds",
        error / f64::EPSILON,
        bound
    );
}

#[test]
fn coefficients_agree_with_60_digit_reference() {
    for case in cases() {
        let p = case.parameters;
        let (found, _) = zoh_operator_delayed(p, case.delta, case.ts);
        let scales = scales(&case.coefficients);
        for i in 0..5 {
            // One ulp each from the divided differences, the products of gain and time, and the two sums in b1. The
            // largest errors are 3.92 for b and 0.64 for f.
            let what = format_args!("{p:?} {} {}: {}", case.delta, case.ts, ROW_NAMES[i]);
            assert_within(found[i], case.coefficients[i], 4.0 * scales[i], what);
        }
    }
}

#[test]
fn sum_of_coefficients_keeps_its_relative_precision() {
    for case in cases() {
        let [_, _, omega, zeta] = case.parameters;
        let ts = case.ts;
        let at_ts = DividedDifferences::at(-2.0 * zeta * omega * ts, omega * omega * ts * ts);
        let poles = Poles::new(&at_ts, ts, omega, zeta);
        let found = [poles.sum, poles.sum_omega, poles.sum_zeta];
        let expected = [case.sum, case.sum_slopes[0], case.sum_slopes[1]];
        for (i, name) in ["sum", "by omega", "by zeta"].into_iter().enumerate() {
            // The errors are relative: 1 + f1 + f2 of the rounded coefficients would lose 1/(omega Ts)^2, up to 1e12
            // here. Four products are added to the divided differences; the largest errors are 1.94, 3.13 and 2.77.
            let what = format_args!("omega {omega} zeta {zeta} Ts {ts}: {name}");
            assert_within(found[i], expected[i], 8.0 * expected[i].abs(), what);
        }
    }
}

#[test]
fn jacobian_agrees_with_60_digit_reference() {
    for case in cases() {
        let p = case.parameters;
        let (_, found) = zoh_operator_delayed(p, case.delta, case.ts);
        // A pole times Ts is rounded, and its exponential has |z| times that error. The bound is constant for |z| <= 2
        // (the largest error is 2.7) and proportional to |z| beyond, where a column also becomes small as the sine
        // passes zero (14.2 at |z| = 4).
        let tolerance = 8.0 * (pole_size(p[2], p[3], case.ts) / 2.0).max(1.0);
        for j in 0..5 {
            let scale = largest_magnitude(&column(&case.jacobian, j));
            for i in 0..5 {
                let what = format_args!(
                    "{p:?} {} {}: {} by {}",
                    case.delta, case.ts, ROW_NAMES[i], COLUMN_NAMES[j]
                );
                assert_within(found[i][j], case.jacobian[i][j], tolerance * scale, what);
            }
        }
    }
}

#[test]
fn zero_fraction_equals_the_whole_sample_hold() {
    let mut count = 0;
    for case in cases().into_iter().filter(|c| c.delta == 0.0) {
        let (whole, by_whole) = zoh_operator(case.parameters, case.ts);
        let (any, by_any) = zoh_operator_delayed(case.parameters, 0.0, case.ts);
        assert_eq!(any[2], 0.0);
        assert_eq!(largest_magnitude(&by_any[2][..4]), 0.0);
        for (row, i) in [0, 1, 3, 4].into_iter().enumerate() {
            assert_eq!(whole[row], any[i]);
            assert_eq!(by_whole[row], by_any[i][..4]);
        }
        count += 1;
    }
    assert!(count > 20);
}

#[test]
fn fraction_of_one_sample_equals_a_whole_sample() {
    for case in cases() {
        let p = case.parameters;
        let (whole, by_whole) = zoh_operator(p, case.ts);
        let (any, by_any) = zoh_operator_delayed(p, case.ts, case.ts);
        assert_eq!(any[0], 0.0);
        let scale = largest_magnitude(&whole[..2]);
        for i in 0..2 {
            // Both are within 4 eps of the exact value.
            assert_within(
                any[i + 1],
                whole[i],
                8.0 * scale,
                format_args!("{p:?} {}", ROW_NAMES[i + 1]),
            );
            let tolerance = 16.0 * (pole_size(p[2], p[3], case.ts) / 2.0).max(1.0);
            for j in 0..4 {
                let scale = largest_magnitude(&by_whole.map(|row| row[j]));
                let what = format_args!("{p:?} {} by {}", ROW_NAMES[i + 1], COLUMN_NAMES[j]);
                assert_within(by_any[i + 1][j], by_whole[i][j], tolerance * scale, what);
            }
        }
        assert_eq!(any[3..], whole[2..]);
        // The kink: b0 leaves zero with the slope of the step response.
        let slope = -p[2] * p[2] * p[1];
        assert_within(by_any[0][4], slope, slope.abs(), format_args!("{p:?} slope"));
    }
}

#[test]
fn jacobian_agrees_with_finite_differences() {
    for case in cases() {
        // For slower operators the changes are smaller than the rounding errors of the differences; the 60-digit
        // reference values cover them.
        if case.parameters[2] * case.ts < 0.01 {
            continue;
        }
        let [k_e, k_e_dot, omega, zeta] = case.parameters;
        let p = [k_e, k_e_dot, omega, zeta, case.delta];
        let at = |p: [f64; 5]| zoh_operator_delayed([p[0], p[1], p[2], p[3]], p[4], case.ts);
        let (_, exact) = at(p);
        for j in 0..5 {
            // A delta beyond the sample is continued analytically.
            let h = [1e-2, 1e-2, 1e-4 * omega, 1e-4 * zeta.abs(), 1e-4 * case.ts][j];
            let (mut up, mut down) = (p, p);
            up[j] += h;
            down[j] -= h;
            let ((up, _), (down, _)) = (at(up), at(down));
            let scale = largest_magnitude(&column(&exact, j));
            for i in 0..5 {
                let difference = (up[i] - down[i]) / (2.0 * h);
                // Truncation error: h^2/6 of a third derivative, 1e-8 times the cubed size of the poles. Rounding
                // error: 1e-16/1e-4.
                assert!(
                    (exact[i][j] - difference).abs() < 1e-7 * scale,
                    "{p:?} Ts {}: {} by {}: {} and {difference}",
                    case.ts,
                    ROW_NAMES[i],
                    COLUMN_NAMES[j],
                    exact[i][j]
                );
            }
        }
    }
}

#[test]
fn coefficients_are_continuous_in_the_fraction() {
    const STEPS: usize = 2000;
    // For all operators except the first, the way of evaluating the divided differences changes within the sample.
    for (omega, zeta) in [
        (11.25, 0.35),
        (20.0, 1.0),
        (60.0, 0.35),
        (60.0, 1.7),
        (200.0, 0.35),
        (90.0, -0.2),
    ] {
        let p = [0.09, 0.036, omega, zeta];
        let at = |k: usize| zoh_operator_delayed(p, TS * k as f64 / STEPS as f64, TS);
        let step = TS / STEPS as f64;
        // The third derivative of R is omega^2 times the divided difference of z^3 e^{zt}, at most (3 + |z|
        // t) |z|^2 |e^{zt}|; for A it is smaller by |z|.
        let fastest = pole_size(omega, zeta, TS) / TS;
        let growth = (-2.0 * zeta * omega * TS).exp().max(1.0);
        let third = omega * omega * (3.0 + fastest * TS) * fastest * (p[0] + p[1] * fastest) * growth;
        let (mut before, mut slopes_before) = at(0);
        for k in 1..=STEPS {
            let (now, slopes) = at(k);
            for i in 0..3 {
                // Trapezoidal rule: step^3/12 of the third derivative, of two responses in b1, and 4 eps for each
                // coefficient.
                let change = step * (slopes[i][4] + slopes_before[i][4]) / 2.0;
                let bound = step.powi(3) / 12.0 * 2.0 * third + 8.0 * f64::EPSILON * largest_magnitude(&now[..3]);
                assert!(
                    (now[i] - before[i] - change).abs() < bound,
                    "{p:?} step {k}: {} moves by {:e}, not {change:e}, bound {bound:e}",
                    ROW_NAMES[i],
                    now[i] - before[i]
                );
            }
            (before, slopes_before) = (now, slopes);
        }
    }
}

#[test]
fn poles_at_the_origin_and_zero_sample_time() {
    let (double_integrator, _) = zoh_operator_delayed([0.09, 0.036, 0.0, 0.35], 0.003, TS);
    assert_eq!(double_integrator, [0.0, 0.0, 0.0, -2.0, 1.0]);
    let (at_once, _) = zoh_operator_delayed([0.09, 0.036, 11.25, 0.35], 0.0, 0.0);
    assert_eq!(at_once, [0.0, 0.0, 0.0, -2.0, 1.0]);
}

#[test]
fn non_finite_arguments_give_non_finite_coefficients() {
    let good = [0.09, 0.036, 11.25, 0.35, 0.0037, TS];
    let finite = |v: [f64; 6]| {
        let p = [v[0], v[1], v[2], v[3]];
        let whole = zoh_operator(p, v[5]).0.iter().all(|c| c.is_finite());
        let any = zoh_operator_delayed(p, v[4], v[5]).0.iter().all(|c| c.is_finite());
        (whole, any)
    };
    assert_eq!(finite(good), (true, true));
    for j in 0..6 {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut v = good;
            v[j] = bad;
            // The hold of whole samples has no delta.
            assert_eq!(finite(v), (j == 4, false), "{j}: {bad}");
        }
    }
    // An exponential that overflows.
    assert_eq!(finite([0.09, 0.036, 300.0, -1e4, 0.0037, TS]), (false, false));
}
