//! Exact zero-order hold of the operator with a delay of any length, including fractions of a sample.
//!
//! After a zero-order hold, the operator `H(s) = (K_e + K_e_dot s) omega^2/(s^2 + 2 zeta omega s + omega^2) e^{-tau s}`
//! with `tau = l Ts + delta`, `0 <= delta < Ts`, is exactly `q^-nk (b0 + b1 q^-1 + b2 q^-2)/(1 + f1 q^-1 + f2 q^-2)`
//! with `nk = l + 1`. The formulas are those of [`hoid_core::zoh_operator`]. For delta = 0, b2 is zero and the model
//! is the same as in [`crate::operator`].
//!
//! The model is linear in K_e and K_e_dot. Its response is a continuous function of tau with a kink wherever tau is an
//! integer number of samples, because the step response starts with the slope `omega^2 K_e_dot`. If tau is an integer
//! number of samples, the derivatives are those for increasing tau.

use hoid_core::zoh_operator::zoh_operator_delayed;

use crate::{ModelError, OperatorParameters, SampleTime};

/// Operator with a delay of any length, after a zero-order hold:
/// `q^-nk (b0 + b1 q^-1 + b2 q^-2) / (1 + f1 q^-1 + f2 q^-2)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DelayedOperator {
    /// Delay of b0 in samples: the number of whole samples in tau_e plus the one-sample delay of the hold.
    pub nk: usize,
    /// `[b0, b1, b2]`; b2 = 0 if the delay is an integer number of samples.
    pub b: [f64; 3],
    /// `[f1, f2]`.
    pub f: [f64; 2],
}

/// Names of the five parameters, in the order of every array of parameters in this module. The units are deg/deg, s,
/// rad/s, 1 and s.
pub const DELAYED_PARAMETER_NAMES: [&str; 5] = ["K_e", "K_e_dot", "omega_nm", "zeta_nm", "tau_e"];

/// Largest distance from an integer number of samples, in samples, that is attributed to rounding; for example,
/// `0.29 / 0.01` is `28.999999999999996`.
const INTEGER_TOLERANCE: f64 = 1e-12;

/// Converts operator parameters to the array `[K_e, K_e_dot, omega_nm, zeta_nm, tau_e]`.
pub fn delayed_operator_parameters(operator: &OperatorParameters) -> [f64; 5] {
    [
        operator.k_e,
        operator.k_e_dot(),
        operator.omega_nm_rad_s,
        operator.zeta_nm,
        operator.tau_e_s,
    ]
}

/// Returns the exact discrete model of the operator with the parameters `[K_e, K_e_dot, omega_nm, zeta_nm, tau_e]`, for
/// an error held over each sample.
///
/// # Errors
/// [`ModelError::OutOfRange`] if a parameter is not finite, omega_nm is not positive, the delay is negative, or a
/// coefficient is not finite (because a pole is so fast that its exponential overflows).
pub fn delayed_operator(parameters: [f64; 5], sample_time: SampleTime) -> Result<DelayedOperator, ModelError> {
    let whole_samples = whole_samples(parameters[4], sample_time)?;
    delayed_operator_with_delay_samples(whole_samples, parameters, sample_time)
}

/// As [`delayed_operator`], for a given number l of whole samples in the delay. Both ends of the interval
/// `l Ts <= tau <= (l + 1) Ts` are included, and the model and its derivatives are smooth functions of tau over the
/// whole interval.
///
/// # Errors
/// As [`delayed_operator`]; also [`ModelError::OutOfRange`] if tau_e is outside this interval.
pub fn delayed_operator_with_delay_samples(
    whole_samples: usize,
    parameters: [f64; 5],
    sample_time: SampleTime,
) -> Result<DelayedOperator, ModelError> {
    Ok(delayed_operator_and_jacobian_with_delay_samples(whole_samples, parameters, sample_time)?.0)
}

/// Returns the Jacobian of `[b0, b1, b2, f1, f2]` (rows) with respect to `[K_e, K_e_dot, omega_nm, zeta_nm, tau_e]`
/// (columns) for a fixed nk.
///
/// # Errors
/// As [`delayed_operator`].
pub fn delayed_operator_jacobian(parameters: [f64; 5], sample_time: SampleTime) -> Result<[[f64; 5]; 5], ModelError> {
    let whole_samples = whole_samples(parameters[4], sample_time)?;
    delayed_operator_jacobian_with_delay_samples(whole_samples, parameters, sample_time)
}

/// Returns the Jacobian of [`delayed_operator_with_delay_samples`].
///
/// # Errors
/// As [`delayed_operator_with_delay_samples`].
pub fn delayed_operator_jacobian_with_delay_samples(
    whole_samples: usize,
    parameters: [f64; 5],
    sample_time: SampleTime,
) -> Result<[[f64; 5]; 5], ModelError> {
    Ok(delayed_operator_and_jacobian_with_delay_samples(whole_samples, parameters, sample_time)?.1)
}

/// Evaluates [`delayed_operator_with_delay_samples`] and [`delayed_operator_jacobian_with_delay_samples`] together.
///
/// # Errors
/// As [`delayed_operator_with_delay_samples`].
pub fn delayed_operator_and_jacobian_with_delay_samples(
    whole_samples: usize,
    parameters: [f64; 5],
    sample_time: SampleTime,
) -> Result<(DelayedOperator, [[f64; 5]; 5]), ModelError> {
    let delta = fractional_delay_s(whole_samples, parameters, sample_time)?;
    let [k_e, k_e_dot, omega, zeta, _] = parameters;
    let (coefficients, jacobian) = zoh_operator_delayed([k_e, k_e_dot, omega, zeta], delta, sample_time.s());
    let quantities = ["b0", "b1", "b2", "f1", "f2"];
    for (quantity, found) in quantities.into_iter().zip(coefficients) {
        if !found.is_finite() {
            return Err(ModelError::OutOfRange {
                quantity,
                found,
                expected: "a finite number; check the poles against the sample time",
            });
        }
    }
    let [b0, b1, b2, f1, f2] = coefficients;
    let operator = DelayedOperator {
        nk: whole_samples + 1,
        b: [b0, b1, b2],
        f: [f1, f2],
    };
    Ok((operator, jacobian))
}

/// Returns the number l of whole samples in a delay: the largest integer with `l Ts <= tau`, up to rounding.
///
/// # Errors
/// [`ModelError::OutOfRange`] if the delay is negative, not finite or longer than 1e9 samples.
pub fn whole_samples(tau_e_s: f64, sample_time: SampleTime) -> Result<usize, ModelError> {
    let samples = tau_e_s / sample_time.s();
    if !(0.0..=1e9).contains(&samples) {
        return Err(ModelError::OutOfRange {
            quantity: "delay tau_e in s",
            found: tau_e_s,
            expected: "zero or more, and fewer than 1e9 samples; check the units of the delay and the sample time",
        });
    }
    let nearest = samples.round();
    let near = (samples - nearest).abs() <= INTEGER_TOLERANCE * (1.0 + nearest);
    Ok(if near { nearest } else { samples.floor() } as usize)
}

/// Checks the parameters and returns `delta = tau - l Ts` in s; a delta that differs from 0 or Ts only by rounding is
/// set to that value.
fn fractional_delay_s(whole_samples: usize, parameters: [f64; 5], sample_time: SampleTime) -> Result<f64, ModelError> {
    let quantities = [
        "error gain K_e",
        "error-rate gain K_e_dot in s",
        "neuromuscular frequency omega_nm in rad/s",
        "neuromuscular damping zeta_nm",
        "delay tau_e in s",
    ];
    for (i, (&found, quantity)) in parameters.iter().zip(quantities).enumerate() {
        if !found.is_finite() || (i == 2 && found <= 0.0) {
            return Err(ModelError::OutOfRange {
                quantity,
                found,
                expected: "a finite number, positive for omega_nm",
            });
        }
    }
    let (tau, ts) = (parameters[4], sample_time.s());
    let whole = whole_samples as f64;
    let delta = tau - whole * ts;
    let rounding = INTEGER_TOLERANCE * (1.0 + whole) * ts;
    if delta < -rounding || delta > ts + rounding {
        return Err(ModelError::OutOfRange {
            quantity: "delay tau_e in s",
            found: tau,
            expected: "a delay between the given number of whole samples and one sample more",
        });
    }
    // If delta equals 0 or one sample up to rounding, it is set to that value.
    Ok(match delta {
        d if d <= rounding => 0.0,
        d if d >= ts - rounding => ts,
        d => d,
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::operator::discretisation_jacobian;

    fn ts() -> SampleTime {
        SampleTime::new(0.01).unwrap()
    }

    /// Returns parameters with complex, double, nearly double, real, fast, slow, lightly damped and unstable poles, and
    /// with both signs of each gain.
    fn cases() -> Vec<[f64; 5]> {
        let poles = [
            (11.25, 0.35),
            (11.25, 1.0),
            (11.25, 1.0 + 1e-9),
            (11.25, 1.7),
            (60.0, 0.1),
            (60.0, 3.0),
            (2.0, 0.05),
            (150.0, 0.6),
            (300.0, 0.2),
            (9.0, -0.1),
        ];
        let gains = [(0.09, 0.036), (-0.3, 0.05), (0.0, 0.04), (0.07, 0.0), (0.2, -0.03)];
        let delays = [0.0, 0.003, 0.0099, 0.28, 0.2837, 0.29, 0.295, 0.2999];
        let mut all = Vec::new();
        for (i, &(omega, zeta)) in poles.iter().enumerate() {
            for (j, &tau) in delays.iter().enumerate() {
                let (k_e, k_e_dot) = gains[(i + j) % gains.len()];
                all.push([k_e, k_e_dot, omega, zeta, tau]);
            }
        }
        all
    }

    /// Response of the discrete model to a pulse of one sample.
    fn response(operator: &DelayedOperator, n: usize) -> Vec<f64> {
        let mut y: Vec<f64> = Vec::with_capacity(n);
        for k in 0..n {
            let forced = k
                .checked_sub(operator.nk)
                .and_then(|j| operator.b.get(j))
                .unwrap_or(&0.0);
            let past = |lag: usize| if k >= lag { y[k - lag] } else { 0.0 };
            y.push(forced - operator.f[0] * past(1) - operator.f[1] * past(2));
        }
        y
    }

    /// The same response, computed by matrix exponentials in controllable canonical form.
    fn response_by_matrix_exponentials(p: [f64; 5], n: usize) -> Vec<f64> {
        let [k_e, k_e_dot, omega, zeta, tau] = p;
        let w2 = omega * omega;
        let extended = |t: f64| {
            let m = DMatrix::from_row_slice(3, 3, &[0.0, 1.0, 0.0, -w2, -2.0 * zeta * omega, 1.0, 0.0, 0.0, 0.0]) * t;
            let e = m.exp();
            (
                e.view((0, 0), (2, 2)).into_owned(),
                DVector::from_column_slice(e.view((0, 2), (2, 1)).into_owned().as_slice()),
            )
        };
        let l = (tau / 0.01 + 1e-9).floor();
        let delta = (tau - 0.01 * l).max(0.0);
        let (phi, _) = extended(0.01);
        let (phi_rest, gamma_rest) = extended(0.01 - delta);
        let (_, gamma_delta) = extended(delta);
        let pulse = |k: i64| if k == 0 { 1.0 } else { 0.0 };
        let mut x = DVector::zeros(2);
        let mut y = Vec::with_capacity(n);
        for k in 0..n as i64 {
            y.push(w2 * (k_e * x[0] + k_e_dot * x[1]));
            let lag = k - l as i64;
            x = &phi * x + &phi_rest * &gamma_delta * pulse(lag - 1) + &gamma_rest * pulse(lag);
        }
        y
    }

    #[test]
    fn response_agrees_with_matrix_exponentials() {
        for p in cases() {
            let ours = response(&delayed_operator(p, ts()).unwrap(), 80);
            let theirs = response_by_matrix_exponentials(p, 80);
            let size = theirs.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            for (k, (a, b)) in ours.iter().zip(&theirs).enumerate() {
                // The recursion of the difference equation amplifies rounding errors by at most 1/|1 + f1 + f2|,
                // here 2500.
                assert!((a - b).abs() < 2e-12 * size, "{p:?} sample {k}: {a} and {b}");
            }
        }
    }

    #[test]
    fn whole_sample_delay_matches_the_held_operator() {
        for tau in [0.0, 0.01, 0.28, 0.29, 0.57] {
            let operator = OperatorParameters {
                k_e: 0.09,
                t_l_s: 0.4,
                omega_nm_rad_s: 11.25,
                zeta_nm: 0.35,
                tau_e_s: tau,
            };
            let ours = delayed_operator(delayed_operator_parameters(&operator), ts()).unwrap();
            let known = operator.discretise(ts()).unwrap();
            assert_eq!((ours.nk, ours.b[2]), (known.nk, 0.0));
            // The same formulas, but the factors are multiplied in another order.
            assert!((ours.b[0] - known.zoh.b0).abs() < 1e-16 && (ours.b[1] - known.zoh.b1).abs() < 1e-16);
            assert_eq!(ours.f, [known.zoh.f1, known.zoh.f2]);
            let jacobian = delayed_operator_jacobian(delayed_operator_parameters(&operator), ts()).unwrap();
            let expected = discretisation_jacobian(&operator, ts());
            for (row, known) in [0, 1, 3, 4].into_iter().zip(expected) {
                for (a, b) in jacobian[row].iter().zip(known) {
                    // In both formulas the terms of 1 - E C + (s/2) E S cancel, which loses a factor of 100 in
                    // precision.
                    assert!((a - b).abs() < 1e-13 * (1.0 + b.abs()), "{row}: {a} and {b}");
                }
            }
        }
        // In the reference task, a delay of 0.28 s gives nk = 29.
        let s1 = delayed_operator([0.09, 0.036, 11.25, 0.35, 0.28], ts()).unwrap();
        assert_eq!(s1.nk, 29);
        assert!((s1.b[0] - 0.0442765923).abs() < 5e-11 && (s1.b[1] + 0.0431823806).abs() < 5e-11);
    }

    #[test]
    fn jacobian_agrees_with_finite_differences() {
        for p in cases() {
            let exact = delayed_operator_jacobian(p, ts()).unwrap();
            let at = |p: [f64; 5]| {
                let d = delayed_operator(p, ts()).unwrap();
                [d.b[0], d.b[1], d.b[2], d.f[0], d.f[1]]
            };
            for j in 0..5 {
                // Only delays within a sample are tested here: at a whole number of samples the derivatives are
                // one-sided, which the next test checks.
                if j == 4 && [0.0, 0.28, 0.29].contains(&p[4]) {
                    continue;
                }
                let h = match j {
                    0 | 1 => 1e-3,
                    4 => 1e-7,
                    _ => 1e-5 * p[j].abs(),
                };
                let (mut up, mut down) = (p, p);
                up[j] += h;
                down[j] -= h;
                let (up, down) = (at(up), at(down));
                let scale = (0..5).map(|k| exact[k][j].abs()).fold(0.0, f64::max);
                for i in 0..5 {
                    let difference = (up[i] - down[i]) / (2.0 * h);
                    // Central differences have a truncation error of order h^2 and a rounding error of order eps/h; the
                    // derivatives are at least 1e-3.
                    assert!(
                        (exact[i][j] - difference).abs() < 1e-7 * scale + 1e-10,
                        "{p:?} row {i} by {}: {} and {difference}",
                        DELAYED_PARAMETER_NAMES[j],
                        exact[i][j]
                    );
                }
            }
        }
    }

    #[test]
    fn derivatives_at_a_whole_sample_are_right_sided() {
        let p = [0.09, 0.036, 11.25, 0.35, 0.28];
        let exact = delayed_operator_jacobian(p, ts()).unwrap();
        let at = |h: f64| delayed_operator([p[0], p[1], p[2], p[3], p[4] + h], ts()).unwrap().b;
        for i in 0..3 {
            let h = 1e-5;
            // One-sided difference of second order.
            let difference = (-3.0 * at(0.0)[i] + 4.0 * at(h)[i] - at(2.0 * h)[i]) / (2.0 * h);
            assert!((exact[i][4] - difference).abs() < 1e-6 * exact[0][4].abs(), "{i}");
        }
    }

    #[test]
    fn response_is_continuous_across_whole_sample_delays() {
        for (omega, zeta) in [(11.25, 0.35), (60.0, 1.0), (40.0, 2.0)] {
            let at = |tau: f64| delayed_operator([0.09, 0.036, omega, zeta, tau], ts()).unwrap();
            let (before, there, after) = (at(0.28 - 1e-9), at(0.28), at(0.28 + 1e-9));
            assert_eq!([before.nk, there.nk, after.nk], [28, 29, 29]);
            let (a, b, c) = (response(&before, 90), response(&there, 90), response(&after, 90));
            for k in 0..90 {
                // The bound is twice the change in the delay, 1e-9 s, times the slope of the response, which is at most
                // omega^2 K_e_dot.
                let bound = 2e-9 * omega * omega * 0.036 + 1e-13;
                assert!(
                    (a[k] - b[k]).abs() < bound && (c[k] - b[k]).abs() < bound,
                    "{omega} {k}"
                );
            }
        }
    }

    #[test]
    fn adjacent_sample_models_agree_at_their_border() {
        let p = [0.09, 0.036, 11.25, 0.35, 0.28];
        let (above, below) = (
            delayed_operator_with_delay_samples(28, p, ts()).unwrap(),
            delayed_operator_with_delay_samples(27, p, ts()).unwrap(),
        );
        assert_eq!((above.nk, below.nk, below.b[0]), (29, 28, 0.0));
        for i in 0..2 {
            assert!((above.b[i] - below.b[i + 1]).abs() < 1e-15);
        }
        // For decreasing tau, the derivatives are those of the model with one whole sample less.
        let at = |h: f64| {
            delayed_operator_with_delay_samples(27, [p[0], p[1], p[2], p[3], p[4] - h], ts())
                .unwrap()
                .b
        };
        let exact = delayed_operator_jacobian_with_delay_samples(27, p, ts()).unwrap();
        let h = 1e-5;
        for i in 0..3 {
            let difference = (3.0 * at(0.0)[i] - 4.0 * at(h)[i] + at(2.0 * h)[i]) / (2.0 * h);
            assert!((exact[i][4] - difference).abs() < 1e-6 * exact[0][4].abs(), "{i}");
        }
        assert!(
            delayed_operator_with_delay_samples(29, p, ts()).is_err()
                && delayed_operator_with_delay_samples(26, p, ts()).is_err()
        );
    }

    #[test]
    fn coefficients_are_linear_in_both_gains() {
        let at = |k_e, k_e_dot| delayed_operator([k_e, k_e_dot, 11.25, 0.35, 0.2837], ts()).unwrap().b;
        let (a, b, both) = (at(1.0, 0.0), at(0.0, 1.0), at(0.09, 0.036));
        for i in 0..3 {
            assert!((0.09 * a[i] + 0.036 * b[i] - both[i]).abs() < 1e-15);
        }
    }

    #[test]
    fn bad_parameters_are_errors() {
        let good = [0.09, 0.036, 11.25, 0.35, 0.2837];
        for j in 0..5 {
            for bad in [f64::NAN, f64::INFINITY] {
                let mut p = good;
                p[j] = bad;
                assert!(delayed_operator(p, ts()).is_err() && delayed_operator_jacobian(p, ts()).is_err());
            }
        }
        for (j, bad) in [(2, 0.0), (2, -1.0), (4, -1e-9), (4, 1e9)] {
            let mut p = good;
            p[j] = bad;
            assert!(delayed_operator(p, ts()).is_err(), "{j} {bad}");
        }
        // An exponential that overflows is an error.
        assert!(delayed_operator([0.09, 0.036, 300.0, -1e4, 0.2837], ts()).is_err());
    }
}
