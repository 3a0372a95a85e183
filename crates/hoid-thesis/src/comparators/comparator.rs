//! Interface of a comparator, which tracks the operator over a record and returns estimates at given times.

use hoid_ident::settings::Settings;
use hoid_model::{OperatorParameters, Record, SampleTime, delayed_operator};
use num_complex::Complex64;

use crate::ThesisError;

/// Description of a comparator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ComparatorDescription {
    /// Name of the comparator in a plan.
    pub name: &'static str,
    /// Short description.
    pub help: &'static str,
    /// Author and year of the publication.
    pub source: &'static str,
    /// Information that the comparator needs and a recursion does not, as text; empty if there is none.
    pub extra_information: &'static str,
}

/// Task for a comparator: a record, and the estimates that are requested.
#[derive(Debug, Clone, Copy)]
pub struct Task<'a> {
    /// The record.
    pub record: &'a Record,
    /// Samples after which an estimate is requested, in ascending order.
    pub requested_samples: &'a [usize],
    /// Frequencies of the lines of the forcing function, rad/s.
    pub lines_rad_s: &'a [f64],
    /// Frequencies at which the response is requested (rad/s); each is the frequency of a line.
    pub omega_rad_s: &'a [f64],
    /// Span of the start fit, s.
    pub start_s: (f64, f64),
    /// Delay of b0 in samples.
    pub nk: usize,
    /// A second run of the same person in the same task, if available.
    pub validation: Option<&'a Record>,
    /// Time (s) and rate (1/s) of the change in the controlled element; `None` if the element is constant.
    pub change: Option<(f64, f64)>,
}

/// Result of a comparator, one entry for each requested sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TrackingResult {
    /// Response at each requested frequency.
    pub response: Vec<Vec<Complex64>>,
    /// Operator; `None` if the method does not give a valid operator.
    pub operator: Vec<Option<OperatorParameters>>,
}

impl TrackingResult {
    /// Creates the result of a method that estimates only a response.
    pub fn without_operator(response: Vec<Vec<Complex64>>) -> Self {
        Self {
            operator: vec![None; response.len()],
            response,
        }
    }

    /// Adds the operator at the next requested sample and its response; the response is NaN if there is no operator.
    pub(super) fn push(&mut self, task: &Task<'_>, operator: Option<OperatorParameters>) -> Result<(), ThesisError> {
        self.response.push(match &operator {
            Some(operator) => delayed_response(operator, task.record.sample_time(), task.omega_rad_s)?,
            None => vec![Complex64::new(f64::NAN, f64::NAN); task.omega_rad_s.len()],
        });
        self.operator.push(operator);
        Ok(())
    }
}

/// A method that is included for comparison with others.
pub trait Comparator: Settings + Send + Sync {
    /// Returns the description of the method.
    fn description(&self) -> ComparatorDescription;

    /// Tracks the operator over a record.
    ///
    /// # Errors
    /// [`ThesisError`] if the record is unsuitable.
    fn track(&self, task: &Task<'_>) -> Result<TrackingResult, ThesisError>;
}

impl Task<'_> {
    /// Returns e and u, which must have more than `least` samples.
    pub(crate) fn signals(&self, method: &'static str, least: usize) -> Result<(&[f64], &[f64]), ThesisError> {
        let (e, u) = (self.record.input(), self.record.output());
        let unsuited = |quantity: &str, found: String, expected: &str| ThesisError::Unsuited {
            method,
            quantity: quantity.to_owned(),
            found,
            expected: expected.to_owned(),
        };
        if e.len() != u.len() {
            return Err(unsuited("the input", "missing".to_owned(), "a record with e and u"));
        }
        if e.len() <= least {
            let expected = format!("more than {least} for this method");
            return Err(unsuited("the number of samples", e.len().to_string(), &expected));
        }
        if e.iter().all(|value| *value == 0.0) {
            return Err(unsuited(
                "the input",
                "zero throughout".to_owned(),
                "an input that varies",
            ));
        }
        if let Some(k) = self.requested_samples.iter().find(|k| **k >= e.len()) {
            let expected = format!("a number below {}", e.len());
            return Err(unsuited("the index of a requested sample", k.to_string(), &expected));
        }
        Ok((e, u))
    }
}

/// The response at given frequencies of an operator with any delay, including the zero-order hold.
pub(crate) fn delayed_response(
    operator: &OperatorParameters,
    sample_time: SampleTime,
    omega_rad_s: &[f64],
) -> Result<Vec<Complex64>, ThesisError> {
    let parameters = delayed_operator::delayed_operator_parameters(operator);
    let held = delayed_operator::delayed_operator(parameters, sample_time)?;
    let of = |omega: &f64| {
        let z = |k: usize| Complex64::from_polar(1.0, -omega * sample_time.s() * k as f64);
        let b: Complex64 = held.b.iter().enumerate().map(|(i, b)| b * z(held.nk + i)).sum();
        b / (1.0 + held.f[0] * z(1) + held.f[1] * z(2))
    };
    Ok(omega_rad_s.iter().map(of).collect())
}
