//! Errors of a method in one run.
//!
//! At each stored time `E(t) = sqrt(mean_i |H(j omega_i, t)/H_0(j omega_i, t) - 1|^2)` is computed over the third to
//! the ninth line of the forcing function, from 0.6 to 11 rad/s: the first two lines have only a few periods in the
//! whole run, and the last line has hardly any power. H_0 is the response of the operator at that time, including the
//! hold. The reported value is the root mean square of E over a span, in %:
//!
//! | span | interval |
//! |---|---|
//! | before | from 30.72 s, the end of the start span, to the change (or the middle) at 40.96 s |
//! | through | the 5.12 s after the change |
//! | after | the last 20.48 s of the run |
//!
//! For the operator's parameters, the reported value is the root mean square of the relative error from 10 s on, as in
//! the studies.

use std::ops::Range;

use hoid_model::{OperatorParameters, Record};
use num_complex::Complex64;

use crate::{ThesisError, comparators::TrackingResult, comparators::delayed_response};

/// Spans over which the error of the response is averaged, s.
const ERROR_SPANS_S: [(f64, f64); 3] = [(30.72, 40.96), (40.96, 46.08), (61.44, 81.93)];
/// Time from which parameters are evaluated, s.
const PARAMETER_START_S: f64 = 10.0;
/// Indices of the evaluated lines of the forcing function.
pub(super) const LINE_INDICES: Range<usize> = 2..9;

/// Errors of one run (%); NaN if there is no estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Errors of the response before, during and after the change.
    pub response: [f64; 3],
    /// Errors of K_e, T_L, K_e_dot, omega_nm and zeta_nm.
    pub operator: [f64; 5],
}

fn operator_values(operator: &OperatorParameters) -> [f64; 5] {
    let o = operator;
    [o.k_e, o.t_l_s, o.k_e_dot(), o.omega_nm_rad_s, o.zeta_nm]
}

/// The true operator at a sample of a simulated record.
fn truth(record: &Record, k: usize) -> OperatorParameters {
    let of = |name: &str| record.channel(name).map_or(f64::NAN, |values| values[k]);
    OperatorParameters {
        k_e: of("K_e"),
        t_l_s: of("T_L"),
        omega_nm_rad_s: of("omega_nm"),
        zeta_nm: of("zeta_nm"),
        tau_e_s: of("tau_e"),
    }
}

fn root_mean_square(squares: &[f64]) -> f64 {
    100.0 * (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// Computes the errors of the estimates after the samples `at`.
///
/// # Errors
/// [`ThesisError::Model`] if the record does not contain the true operator.
pub fn errors(
    record: &Record,
    at: &[usize],
    omega_rad_s: &[f64],
    found: &TrackingResult,
) -> Result<Errors, ThesisError> {
    let mut spans = [const { Vec::new() }; 3];
    let mut parameters = [const { Vec::new() }; 5];
    for (i, k) in at.iter().enumerate() {
        let (time_s, operator) = (record.time_s(*k), truth(record, *k));
        let expected = delayed_response(&operator, record.sample_time(), omega_rad_s)?;
        let off = |(h, h0): (&Complex64, &Complex64)| (h / h0 - 1.0).norm_sqr();
        let squares = found.response[i].iter().zip(&expected).map(off).sum::<f64>() / expected.len() as f64;
        for (span, (from_s, to_s)) in spans.iter_mut().zip(ERROR_SPANS_S) {
            if (from_s..to_s).contains(&time_s) {
                span.push(squares);
            }
        }
        if let Some(own) = found.operator[i].filter(|_| time_s >= PARAMETER_START_S) {
            for ((all, own), expected) in parameters
                .iter_mut()
                .zip(operator_values(&own))
                .zip(operator_values(&operator))
            {
                all.push((own / expected - 1.0).powi(2));
            }
        }
    }
    Ok(Errors {
        response: spans.each_ref().map(|squares| root_mean_square(squares)),
        operator: parameters.each_ref().map(|squares| root_mean_square(squares)),
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::scenario::{Condition, Scenario};
    use hoid_sim::{RunSeed, Simulator};

    use super::*;

    #[test]
    fn known_errors_are_measured() {
        let scenario = Scenario::condition(Condition::C4);
        let record = Simulator::new(&scenario)
            .unwrap()
            .run(RunSeed::default(), false)
            .unwrap();
        let at: Vec<usize> = (31..8192).step_by(32).collect();
        let omega = [1.0, 5.0];
        // The gain is exact before the change and 10 % too large after it.
        let operator = |k: usize| {
            let truth = truth(&record, k);
            let factor = if record.time_s(k) < 40.96 { 1.0 } else { 1.1 };
            OperatorParameters {
                k_e: factor * truth.k_e,
                ..truth
            }
        };
        let all: Vec<OperatorParameters> = at.iter().map(|k| operator(*k)).collect();
        let found = TrackingResult {
            response: all
                .iter()
                .map(|o| delayed_response(o, record.sample_time(), &omega).unwrap())
                .collect(),
            operator: all.into_iter().map(Some).collect(),
        };
        let errors = errors(&record, &at, &omega, &found).unwrap();
        let [before, through, after] = errors.response;
        assert!(before < 1e-10, "{before}");
        // K_e_dot = K_e T_L changes accordingly.
        assert!(
            (through - 10.0).abs() < 1e-9 && (after - 10.0).abs() < 1e-9,
            "{errors:?}"
        );
        let share = (81.92 - 40.96) / (81.92 - 10.0);
        assert!((errors.operator[0] - 10.0 * f64::sqrt(share)).abs() < 0.1, "{errors:?}");
        assert!(errors.operator[1] < 1e-10);
        // A missing estimate gives NaN.
        let none = TrackingResult {
            response: vec![vec![Complex64::new(f64::NAN, 0.0); 2]; at.len()],
            operator: vec![None; at.len()],
        };
        let errors = super::errors(&record, &at, &omega, &none).unwrap();
        assert!(errors.response.iter().chain(&errors.operator).all(|x| x.is_nan()));
    }
}
