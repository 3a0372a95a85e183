//! Checks of the numbers in a scenario file; errors give the line.

use hoid_model::{ModelError, SampleTime};

use super::error::ScenarioFileError;
use super::keys::Number;
use crate::wording::escape_control_characters;

/// Maximum number of samples of a run, so that a wrong unit does not exhaust the memory.
const MAX_SAMPLES: f64 = 1e7;

/// Admissible range of a number of a scenario, so that a wrong unit is reported instead of simulated.
#[derive(Clone, Copy)]
pub(super) struct Limits(f64, f64);

impl Limits {
    /// Sample times: from 1 us (1 MHz) to 10 s.
    pub(super) const SAMPLE_TIME_S: Self = Self(1e-6, 10.0);
    pub(super) const RATE_HZ: Self = Self(0.1, 1e6);
    /// Gains of an operator, a controlled element or a remnant, and amplitudes.
    pub(super) const GAIN: Self = Self(-1e6, 1e6);
    pub(super) const NOISE_GAIN: Self = Self(0.0, 1e6);
    /// Lead times and other times of an operator.
    pub(super) const LEAD_S: Self = Self(-1e3, 1e3);
    /// Break frequencies of a controlled element; a negative frequency makes the element unstable.
    pub(super) const BREAK_RAD_S: Self = Self(-1e4, 1e4);
    /// Frequencies of an operator and of forcing functions.
    pub(super) const FREQUENCY_RAD_S: Self = Self(1e-6, 1e4);
    pub(super) const DAMPING: Self = Self(1e-6, 1e3);
    pub(super) const CYCLES: Self = Self(1e-6, 1e6);
    /// Time constants of a remnant.
    pub(super) const TIME_CONSTANT_S: Self = Self(1e-6, 1e4);
    /// Noise level: var(u_n)/var(u), or var(n)/var(u).
    pub(super) const NOISE_LEVEL: Self = Self(0.0, 100.0);
    pub(super) const PHASE_RAD: Self = Self(-1e6, 1e6);
    /// Rate of a change; 1e6 in 1/s is effectively a step.
    pub(super) const CHANGE_PER_S: Self = Self(1e-6, 1e9);
    pub(super) const INSTANT_S: Self = Self(-1e9, 1e9);
    pub(super) const INTERVAL_S: Self = Self(1e-6, 1e9);
    /// Coefficients of a transfer function, and all other numbers.
    pub(super) const ANY: Self = Self(-1e12, 1e12);

    pub(super) fn contains(self, value: f64) -> bool {
        (self.0..=self.1).contains(&value)
    }
}

impl std::fmt::Display for Limits {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let shown = |v: f64| {
            if v == 0.0 || (0.01..1e5).contains(&v.abs()) {
                v.to_string()
            } else {
                format!("{v:e}")
            }
        };
        if self.0 == 0.0 {
            return write!(f, "a finite number, zero or more, up to {}", shown(self.1));
        }
        let sign = if self.0 > 0.0 { "positive" } else { "finite" };
        write!(f, "a {sign} number from {} to {}", shown(self.0), shown(self.1))
    }
}

/// Formats a number, with an exponent if it would otherwise have many digits.
fn short_number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() || (1e-5..1e16).contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// Returns the line, counted from 1, of a byte offset in the text.
pub(super) fn line_of(text: &str, offset: usize) -> usize {
    let before = text.bytes().take(offset);
    before.filter(|b| *b == b'\n').count().saturating_add(1)
}

/// The text of a scenario file, in which the lines of values are located.
pub(super) struct Source<'a> {
    pub(super) text: &'a str,
    pub(super) path: &'a str,
}

impl Source<'_> {
    /// Returns a time in s, given or default, after checking that it is a whole number of samples, from `least` to ten
    /// million. A default time may also fail this check if the file gives the sample time.
    pub(super) fn whole_samples(
        &self,
        key: &str,
        given: Option<Number>,
        default: f64,
        sample_time: SampleTime,
        least: f64,
    ) -> Result<f64, ScenarioFileError> {
        let time_s = given.as_ref().map_or(default, |n| *n.get_ref());
        let whole = sample_time.whole_samples(time_s).map(|n| n as f64);
        if whole.is_some_and(|n| (least..=MAX_SAMPLES).contains(&n)) {
            return Ok(time_s);
        }
        let expected = format!(
            "a whole number of samples of {} s, from {least} to 1e7: round the value or change sample_time_s",
            sample_time.s()
        );
        Err(match given {
            Some(given) => self.value_error(key, given.span().start, &short_number(time_s), &expected),
            None => self.keys_error(&format!("{key} is {time_s} by default, expected {expected}")),
        })
    }

    /// Returns an optional number after checking that it is within its limits.
    pub(super) fn optional_number(
        &self,
        key: &str,
        given: Option<Number>,
        limits: Limits,
    ) -> Result<Option<f64>, ScenarioFileError> {
        given.map(|given| self.number(key, &given, limits)).transpose()
    }

    pub(super) fn number(&self, key: &str, given: &Number, limits: Limits) -> Result<f64, ScenarioFileError> {
        let value = *given.get_ref();
        if limits.contains(value) {
            return Ok(value);
        }
        Err(self.value_error(key, given.span().start, &short_number(value), &limits.to_string()))
    }

    /// Checks that a number, whose line in the file is unknown, is within its limits.
    pub(super) fn check(&self, key: &str, value: f64, limits: Limits) -> Result<(), ScenarioFileError> {
        if limits.contains(value) {
            return Ok(());
        }
        Err(self.keys_error(&format!("{key} is {}, expected {limits}", short_number(value))))
    }

    pub(super) fn value_error(
        &self,
        key: &str,
        offset: usize,
        found: &dyn std::fmt::Display,
        expected: &str,
    ) -> ScenarioFileError {
        ScenarioFileError::Value {
            path: self.path.to_owned(),
            line: line_of(self.text, offset),
            key: key.to_owned(),
            found: escape_control_characters(&found.to_string()),
            expected: expected.to_owned(),
        }
    }

    pub(super) fn keys_error(&self, reason: &str) -> ScenarioFileError {
        ScenarioFileError::Keys {
            path: self.path.to_owned(),
            reason: reason.to_owned(),
        }
    }

    pub(super) fn model_error(&self, source: ModelError) -> ScenarioFileError {
        ScenarioFileError::Model {
            path: self.path.to_owned(),
            source,
        }
    }
}
