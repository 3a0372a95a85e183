//! The methods of discretisation in Table 5.2; some of them are substitutions `s = c (z - 1) / q(z)`.

use super::hold::zoh_equivalent;
use super::matched::matched_pole_zero;
use crate::{ContinuousTransferFunction, DiscreteTransferFunction, ModelError, SampleTime, polynomial};

/// Method of discretisation of a continuous transfer function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Rectangle rule with the value at the start of each sample.
    ForwardEuler,
    /// Rectangle rule with the value at the end of each sample.
    BackwardEuler,
    /// Trapezoid rule (bilinear transformation).
    Tustin,
    /// Trapezoid rule scaled to be exact at one frequency.
    TustinPrewarped {
        /// Frequency omega_p in rad/s, between 0 and pi/Ts.
        omega_rad_s: f64,
    },
    /// Exact for an input that is held over each sample.
    ZeroOrderHold,
    /// Exact for an input that is linear over each sample.
    FirstOrderHold,
    /// Poles and zeros are mapped by `z = e^{s Ts}`.
    Matched,
}

/// Longest delay, in samples, that is represented by leading zeros of a numerator.
const LONGEST_DELAY_SAMPLES: f64 = 1e6;

/// Returns the discrete transfer function of `h` by one of the methods of Table 5.2. The numerator starts with one zero
/// coefficient for each sample of delay.
///
/// # Errors
/// [`ModelError::OutOfRange`] if the delay is not an integer number of samples (the two holds accept any delay) or the
/// prewarping frequency is not between 0 and pi/Ts; [`ModelError::TransferFunction`] if the method maps a pole to
/// infinity or a coefficient of the result is not finite.
pub fn discretise(
    h: &ContinuousTransferFunction,
    sample_time: SampleTime,
    method: Method,
) -> Result<DiscreteTransferFunction, ModelError> {
    let ts = sample_time.s();
    if h.delay_s() / ts > LONGEST_DELAY_SAMPLES {
        return Err(ModelError::OutOfRange {
            quantity: "delay tau in s",
            found: h.delay_s(),
            expected: "at most a million samples; check the units of the delay and the sample time",
        });
    }
    let held = matches!(method, Method::ZeroOrderHold | Method::FirstOrderHold);
    let (whole, fraction) = match sample_time.whole_samples(h.delay_s()) {
        Some(samples) => (samples, 0.0),
        None if held => ((h.delay_s() / ts).floor() as usize, (h.delay_s() / ts).fract()),
        None => {
            return Err(ModelError::OutOfRange {
                quantity: "delay tau in s",
                found: h.delay_s(),
                expected: "a whole number of samples for this method: round it, change the sample time, or use the \
                           zero-order or first-order hold, which accept any delay",
            });
        }
    };
    let (num, den) = match method {
        Method::ForwardEuler => substitute(h, 1.0 / ts, [0.0, 1.0])?,
        Method::BackwardEuler => substitute(h, 1.0 / ts, [1.0, 0.0])?,
        Method::Tustin => substitute(h, 2.0 / ts, [1.0, 1.0])?,
        Method::TustinPrewarped { omega_rad_s } => {
            if !(omega_rad_s > 0.0 && omega_rad_s < sample_time.nyquist_rad_s()) {
                return Err(ModelError::OutOfRange {
                    quantity: "prewarping frequency omega_p in rad/s",
                    found: omega_rad_s,
                    expected: "a frequency between 0 and pi/Ts",
                });
            }
            substitute(h, omega_rad_s / (omega_rad_s * ts / 2.0).tan(), [1.0, 1.0])?
        }
        Method::ZeroOrderHold | Method::FirstOrderHold => {
            zoh_equivalent(h, ts, fraction, method == Method::FirstOrderHold)
                .ok_or_else(|| non_finite_result_error(h))?
        }
        Method::Matched => matched_pole_zero(h, ts).ok_or_else(|| non_finite_result_error(h))?,
    };
    if num.iter().chain(&den).any(|c| !c.is_finite()) {
        return Err(non_finite_result_error(h));
    }
    let delayed: Vec<f64> = std::iter::repeat_n(0.0, whole).chain(num).collect();
    DiscreteTransferFunction::new(&delayed, &den, sample_time)
}

fn non_finite_result_error(h: &ContinuousTransferFunction) -> ModelError {
    ModelError::TransferFunction {
        found: format!("{:?} / {:?}", h.num(), h.den()),
        expected: "expected poles with a finite e^{s Ts}; use a shorter sample time or slower unstable poles"
            .to_owned(),
    }
}

/// Returns the numerator and the denominator in descending powers of z after the substitution `s = c (z - 1) / q(z)`.
fn substitute(h: &ContinuousTransferFunction, c: f64, q: [f64; 2]) -> Result<(Vec<f64>, Vec<f64>), ModelError> {
    let order = h.den().len() - 1;
    let den = substitute_in_polynomial(h.den(), order, c, q);
    let powers = (0..=order).rev().map(|k| c.powi(k as i32));
    let size: f64 = h.den().iter().zip(powers).map(|(a, c)| (a * c).abs()).sum();
    // With backward Euler and Tustin, the leading coefficient is the value of the denominator at s = c, which is zero
    // if a pole is at s = c.
    if q[0] != 0.0 && den[0].abs() <= 1e-13 * size {
        return Err(ModelError::TransferFunction {
            found: format!("{:?} / {:?}", h.num(), h.den()),
            expected: format!(
                "the pole at s = {c} 1/s becomes infinite with this method; use a shorter sample time or a hold"
            ),
        });
    }
    Ok((substitute_in_polynomial(h.num(), order, c, q), den))
}

/// Returns `q(z)^order p(c (z - 1) / q(z))` in descending powers of z, for p in descending powers of s, of degree
/// `order` or less.
fn substitute_in_polynomial(p: &[f64], order: usize, c: f64, q: [f64; 2]) -> Vec<f64> {
    let mut result = vec![p[0]];
    let mut q_power = vec![1.0];
    for &coefficient in &p[1..] {
        result = polynomial::product(&result, &[c, -c]);
        q_power = polynomial::product(&q_power, &q);
        for (r, q) in result.iter_mut().zip(&q_power) {
            *r += coefficient * q;
        }
    }
    for _ in p.len()..=order {
        result = polynomial::product(&result, &q);
    }
    result
}
