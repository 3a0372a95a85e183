//! Expected errors of the response of the person: at the lines, and of the operator between them.
//!
//! At a line the response is the ratio of the Fourier coefficients of u and e, `var H^ = 4 S_n/(T a^2)` (`information`),
//! half of it along the response and half across: gain and phase have the relative error
//! `sqrt(2 S_n/(T a^2))/|H|` each, times 8.7 dB and 57 deg. The operator has
//! fewer parameters than lines have numbers: its error, `dH/H = sum dH/dtheta_k dtheta_k/H` with the inverse of the
//! information, is smaller.
//!
//! In e the line exceeds the part of the remnant by `T a^2/(4 S_n |P S|^2)`.

use hoid_model::{Complex64, forcing::Sinusoid, uncertainty::Estimate};
use serde::{Deserialize, Serialize};

use super::{DesignError, information::Loop};

/// Response of a person at a frequency with its expected errors.
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
    /// Amplitude, frequency and phase.
    pub line: Sinusoid,
    /// The response at it, with the errors of the line alone.
    pub response: ExpectedResponse,
    /// Power in e divided by that of the remnant at this frequency, in one run.
    pub to_remnant: f64,
}

/// Number of frequencies of a response between lines.
const POINTS: usize = 120;
/// Decibels of a natural logarithm of a gain.
const DB: f64 = 20.0 / std::f64::consts::LN_10;

impl Loop<'_> {
    /// The lines with the errors of `runs` runs of a length in s.
    pub fn designed_lines(&self, lines: &[Sinusoid], period_s: f64, runs: usize) -> Vec<DesignedLine> {
        let gain = self.remnant_gain(lines);
        let line = |line: &Sinusoid| {
            let response = self.task.state.operator.response(line.omega_rad_s);
            let noise = gain * self.density(line.omega_rad_s);
            let power = line.amplitude_deg.powi(2) * self.error_by_power(line.omega_rad_s);
            let relative = (2.0 * noise / (period_s * runs as f64 * power)).sqrt() / response.norm();
            let (s, p) = self.sensitivity(line.omega_rad_s);
            DesignedLine {
                line: *line,
                response: expected(line.omega_rad_s, response, [relative; 2]),
                to_remnant: period_s * power / (4.0 * noise * (p * s).norm_sqr()),
            }
        };
        unwrapped(lines.iter().map(line).collect(), self.task.state.operator.tau_e_s())
    }

    /// The operator between the lines, with the errors of its parameters over `length_s`.
    ///
    /// # Errors
    /// [`DesignError::NotIdentifiable`].
    pub fn response(&self, lines: &[Sinusoid], length_s: f64) -> Result<Vec<ExpectedResponse>, DesignError> {
        let covariance: Vec<f64> = self.covariance(lines, length_s)?.iter().copied().collect();
        let ends = lines.first().zip(lines.last());
        let (low, high) = ends.map_or((0.1, 10.0), |(a, b)| (0.9 * a.omega_rad_s, 1.1 * b.omega_rad_s));
        let step = (high / low).ln() / (POINTS - 1) as f64;
        let at = |k: usize| {
            let omega = low * (step * k as f64).exp();
            let response = self.task.state.operator.response_and_gradient(omega);
            let [[gain, _], [_, phase]] = response.relative_covariance(&covariance);
            expected(omega, response.value, [gain.sqrt(), phase.sqrt()])
        };
        let delay = self.task.state.operator.tau_e_s();
        Ok(unwrapped((0..POINTS).map(at).collect(), delay))
    }
}

fn expected(omega_rad_s: f64, value: Complex64, [gain, phase]: [f64; 2]) -> ExpectedResponse {
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

/// A model with a frequency response.
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

/// Phases without jumps: without that of the delay, a phase of people stays within half a turn.
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
    use crate::experiment::{Designing, information::tests::task};

    #[test]
    fn a_line_knows_less_than_all_of_them() {
        let task = task(0.2);
        let all = Loop::of(&task).unwrap();
        let designing = Designing::default();
        let lines = designing.run(&task).unwrap().forcing.sinusoids().to_vec();
        let (one, four) = (
            all.designed_lines(&lines, designing.period_s, 1),
            all.designed_lines(&lines, designing.period_s, 4),
        );
        let curve = all.response(&lines, designing.period_s).unwrap();
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
