//! The numbers of a file, traced back to their lines.

use hoid_model::{ModelError, SampleTime};
use toml::Spanned;

use super::error::ScenarioFileError;
use super::keys::Number;

/// Most samples of a run, so that a slip of the unit does not ask for all memory.
const MOST_SAMPLES: f64 = 1e7;

/// Line of a byte of a text, from 1.
pub(super) fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|b| *b == b'\n').count()
}

/// The text that values are traced back to.
pub(super) struct Source<'a> {
    pub(super) text: &'a str,
    pub(super) path: &'a str,
}

impl Source<'_> {
    /// A time that is `least` to ten million samples, a whole number of them. One that the file
    /// does not give can fail as well, when the file gives the sample time.
    pub(super) fn whole(
        &self,
        key: &str,
        given: Option<Number>,
        default: f64,
        sample_time: SampleTime,
        least: f64,
    ) -> Result<f64, ScenarioFileError> {
        let time_s = given.as_ref().map_or(default, |n| *n.get_ref());
        let whole = sample_time.whole_samples(time_s).map(|n| n as f64);
        if whole.is_some_and(|n| (least..=MOST_SAMPLES).contains(&n)) {
            return Ok(time_s);
        }
        let expected = format!(
            "{least} to 1e7 samples of {} s, a whole number of them: round it or change sample_time_s",
            sample_time.s()
        );
        Err(match given {
            Some(given) => self.value(key, given.span().start, &time_s, &expected),
            None => self.keys(&format!(
                "{key} is {time_s} where the file does not give it, expected {expected}"
            )),
        })
    }

    pub(super) fn positive(&self, key: &str, given: Option<Number>) -> Result<Option<f64>, ScenarioFileError> {
        self.within(key, given, |v| v > 0.0, "a positive finite number")
    }

    pub(super) fn not_negative(&self, key: &str, given: Option<Number>) -> Result<Option<f64>, ScenarioFileError> {
        self.within(key, given, |v| v >= 0.0, "a finite number, zero or more")
    }

    pub(super) fn finite(&self, key: &str, given: Option<Number>) -> Result<Option<f64>, ScenarioFileError> {
        self.within(key, given, |_| true, "a finite number")
    }

    pub(super) fn number(&self, key: &str, given: &Number) -> Result<f64, ScenarioFileError> {
        let value = *given.get_ref();
        if value.is_finite() {
            return Ok(value);
        }
        Err(self.value(key, given.span().start, &value, "a finite number"))
    }

    pub(super) fn within(
        &self,
        key: &str,
        given: Option<Number>,
        has_meaning: impl Fn(f64) -> bool,
        expected: &str,
    ) -> Result<Option<f64>, ScenarioFileError> {
        match given {
            Some(n) if !(n.get_ref().is_finite() && has_meaning(*n.get_ref())) => {
                Err(self.value(key, n.span().start, n.get_ref(), expected))
            }
            given => Ok(given.map(Spanned::into_inner)),
        }
    }

    pub(super) fn value(
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
            found: found.to_string(),
            expected: expected.to_owned(),
        }
    }

    pub(super) fn keys(&self, reason: &str) -> ScenarioFileError {
        ScenarioFileError::Keys {
            path: self.path.to_owned(),
            reason: reason.to_owned(),
        }
    }

    pub(super) fn model(&self, source: ModelError) -> ScenarioFileError {
        ScenarioFileError::Model {
            path: self.path.to_owned(),
            source,
        }
    }
}
