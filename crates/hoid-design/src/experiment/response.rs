//! Expected errors of the frequency response of a person: at the lines, and of the fitted operator between them.
//!
//! At a line the response is the ratio of the Fourier coefficients of u and e, with `var H^ = 4 S_n/(T a^2)`, where a
//! is the amplitude of e (`information`). Half of this variance is along the response and half across it, so the gain
//! and the phase each have the relative error `sqrt(2 S_n/(T a^2))/|H|`, times 8.7 dB and 57 deg. The operator has
//! fewer parameters than the lines give numbers; its error, `dH/H = sum dH/dtheta_k dtheta_k/H` with the inverse of the
//! information, is therefore smaller.
//!
//! In e, the power of a line exceeds that of the remnant by the factor `T a^2/(4 S_n |P S|^2)`.
//!
//! A line of a displayed target X determines the response to the target by `F = (U - B E)/X`, with B from all lines:
//! `dF/F = N/(F X) - (E B)/(X F) dB/B`. The two terms are independent, since the remnant at this line is independent of
//! the remnant at the other lines.

use hoid_model::{Complex64, FamilyOperator, forcing::Sinusoid, uncertainty::Estimate};
use serde::{Deserialize, Serialize};

use super::{
    DesignError, EntryPoint, Forcing,
    information::{LoopQuantities, preview_response},
};

/// Response of a person at one frequency, with its expected errors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ExpectedResponse {
    /// The frequency, rad/s.
    pub omega_rad_s: f64,
    /// Gain, dB.
    pub gain_db: Estimate,
    /// Phase, deg.
    pub phase_deg: Estimate,
}

/// A line of the designed forcing function.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DesignedLine {
    /// Point at which the line enters the loop.
    pub enters: EntryPoint,
    /// Amplitude, frequency and phase of the line.
    pub line: Sinusoid,
    /// The response that the line determines, with the errors from this line alone: the response to the error or, for a
    /// line of a displayed target, the response to the target.
    pub response: ExpectedResponse,
    /// Ratio of the power of the line to the power of the remnant at this frequency, in one run. The power of the line
    /// is measured in e or, for a line of a displayed target, in the part of u that responds to the target.
    pub to_remnant: f64,
}

/// Number of frequencies at which the response of the operator is evaluated.
const POINT_COUNT: usize = 120;
/// Factor from the natural logarithm of a gain to dB.
const DB: f64 = 20.0 / std::f64::consts::LN_10;

impl LoopQuantities<'_> {
    /// Returns the lines with the expected errors from `runs` runs of length `period_s`.
    ///
    /// # Errors
    /// [`DesignError::NotIdentifiable`] if the lines do not determine the parameters.
    pub fn designed_lines(
        &self,
        forcing: &Forcing,
        period_s: f64,
        runs: usize,
    ) -> Result<Vec<DesignedLine>, DesignError> {
        let gain = self.remnant_gain(forcing);
        let length_s = period_s * runs as f64;
        let feedback = &self.task.state.operator;
        let covariance = self.covariance(forcing, length_s)?;
        let of_feedback = self.joint.feedback_covariance(&covariance, feedback);
        let line = |(enters, line): &(EntryPoint, Sinusoid)| {
            let omega = line.omega_rad_s;
            let noise = gain * self.remnant_density(omega);
            let [error, target] = self.line_coefficients((*enters, omega)).map(|x| x * line.amplitude_deg);
            let (response, [gain, phase], to_remnant) =
                match self.task.feedforward.is_some() && *enters == EntryPoint::Target {
                    false => {
                        let response = feedback.response(omega);
                        let own = 2.0 * noise / (length_s * error.norm_sqr() * response.norm_sqr());
                        let (s, p) = self.sensitivity(omega);
                        let in_error = error.norm_sqr() / (p * s).norm_sqr();
                        (response, [own; 2], in_error)
                    }
                    true => {
                        let response = self.feedforward(omega);
                        let own = 2.0 * noise / (length_s * target.norm_sqr() * response.norm_sqr());
                        let known = feedback.response_and_gradient(omega);
                        let by_feedback = error * known.value / (target * response);
                        let of_known = rotated_variances(known.relative_covariance(&of_feedback), by_feedback);
                        (response, of_known.map(|v| v + own), (target * response).norm_sqr())
                    }
                };
            DesignedLine {
                enters: *enters,
                line: *line,
                response: expected_response(omega, response, [gain.sqrt(), phase.sqrt()]),
                to_remnant: period_s * to_remnant / (4.0 * noise),
            }
        };
        let (mut all, of_target): (Vec<_>, Vec<_>) = (forcing.lines().iter().map(line))
            .partition(|l| l.enters == EntryPoint::Disturbance || self.task.feedforward.is_none());
        all = unwrapped(all, feedback.tau_e_s());
        all.extend(unwrapped(of_target, self.delay_of_target_s()));
        all.sort_by(|a, b| a.line.omega_rad_s.total_cmp(&b.line.omega_rad_s));
        Ok(all)
    }

    fn delay_of_target_s(&self) -> f64 {
        let seen = self.task.feedforward.as_ref();
        seen.map_or(0.0, |seen| seen.operator.tau_e_s() - seen.preview_s)
    }

    /// Returns the responses of the operator to the error and to a displayed target over the band of the lines, with
    /// the errors that follow from those of the parameters after `length_s` seconds.
    ///
    /// # Errors
    /// [`DesignError::NotIdentifiable`] if the lines do not determine the parameters.
    pub fn responses(&self, forcing: &Forcing, length_s: f64) -> Result<[Vec<ExpectedResponse>; 2], DesignError> {
        let covariance = self.covariance(forcing, length_s)?;
        let of_line = |(_, line): &(EntryPoint, Sinusoid)| line.omega_rad_s;
        let all = forcing.lines().iter().map(of_line);
        let (low, high) = all.fold((f64::INFINITY, 0.0_f64), |(a, b), w| (a.min(w), b.max(w)));
        let curve = |operator: &FamilyOperator, preview_s: f64, covariance: &[f64]| {
            let at = |k: usize| {
                let omega = 0.9 * low * (1.1 / 0.9 * high / low).powf(k as f64 / (POINT_COUNT - 1) as f64);
                let response = operator.response_and_gradient(omega);
                let [[gain, _], [_, phase]] = response.relative_covariance(covariance);
                let value = response.value * preview_response(preview_s, omega);
                expected_response(omega, value, [gain.sqrt(), phase.sqrt()])
            };
            unwrapped((0..POINT_COUNT).map(at).collect(), operator.tau_e_s() - preview_s)
        };
        let feedback = &self.task.state.operator;
        let of_target = self.task.feedforward.as_ref().map(|seen| {
            let covariance = self.joint.feedforward_covariance(&covariance);
            curve(&seen.operator, seen.preview_s, &covariance)
        });
        let of_error = curve(feedback, 0.0, &self.joint.feedback_covariance(&covariance, feedback));
        Ok([of_error, of_target.unwrap_or_default()])
    }
}

/// Returns the variances of the real and imaginary parts of `c z`, from the covariance of the parts of z.
fn rotated_variances(covariance: [[f64; 2]; 2], c: Complex64) -> [f64; 2] {
    let [[aa, ab], [_, bb]] = covariance;
    let along = |x: f64, y: f64| x * x * aa + 2.0 * x * y * ab + y * y * bb;
    [along(c.re, -c.im), along(c.im, c.re)]
}

fn expected_response(omega_rad_s: f64, value: Complex64, [gain, phase]: [f64; 2]) -> ExpectedResponse {
    let estimate = |value: f64, error: f64| Estimate {
        value,
        standard_error: Some(error),
    };
    ExpectedResponse {
        omega_rad_s,
        gain_db: estimate(DB * value.norm().ln(), DB * gain),
        phase_deg: estimate(value.arg().to_degrees(), phase.to_degrees()),
    }
}

/// A value that contains a frequency response.
trait HasResponse {
    fn response(&mut self) -> &mut ExpectedResponse;
}

impl HasResponse for ExpectedResponse {
    fn response(&mut self) -> &mut ExpectedResponse {
        self
    }
}

impl HasResponse for DesignedLine {
    fn response(&mut self) -> &mut ExpectedResponse {
        &mut self.response
    }
}

/// Removes jumps of whole turns from the phases: apart from the phase of the delay, the phase of a person stays within
/// half a turn.
fn unwrapped<T: HasResponse>(mut all: Vec<T>, delay_s: f64) -> Vec<T> {
    for one in &mut all {
        let response = one.response();
        let of_delay = -(delay_s * response.omega_rad_s).to_degrees();
        let phase = &mut response.phase_deg.value;
        let rest = *phase - of_delay;
        *phase -= 360.0 * (rest / 360.0).round();
    }
    all
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::experiment::{DesignOptions, information::tests::task};

    #[test]
    fn all_lines_together_reduce_the_error_of_one_line() {
        let task = task(0.2);
        let all = LoopQuantities::of(&task).unwrap();
        let designing = DesignOptions::default();
        let lines = designing.run(&task, &[EntryPoint::Target]).unwrap().forcing;
        let of = |runs| all.designed_lines(&lines, designing.period_s, runs).unwrap();
        let (one, four) = (of(1), of(4));
        let [curve, none] = all.responses(&lines, designing.period_s).unwrap();
        assert!(none.is_empty());
        for (one, four) in one.iter().zip(&four) {
            let error = |line: &DesignedLine| line.response.gain_db.standard_error.unwrap();
            assert!((error(one) / error(four) - 2.0).abs() < 1e-9 && one.to_remnant == four.to_remnant);
            let near = curve
                .iter()
                .min_by(|a, b| {
                    let of = |r: &ExpectedResponse| (r.omega_rad_s / one.line.omega_rad_s).ln().abs();
                    of(a).total_cmp(&of(b))
                })
                .unwrap();
            assert!(
                near.gain_db.standard_error.unwrap() < 1.1 * error(one),
                "{one:?} {near:?}"
            );
            assert!((near.phase_deg.value - one.response.phase_deg.value).abs() < 15.0);
        }
    }
}
