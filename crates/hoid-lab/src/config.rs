//! Definition of an experiment in `lab.toml`.
//!
//! ```toml
//! name = "First try"
//! order = "latin"                  # or "given"
//!
//! [[condition]]
//! name = "rate"
//! controlled_element = "4/s"
//! display = "compensatory"         # or "pursuit", "preview"
//! target = { rms = 1.5 }
//! training = 1
//!
//! [[condition]]
//! name = "change"
//! scenario = "C4"                  # a condition of hoid, or a scenario file
//! ```

use std::path::Path;

use hoid_model::{
    family_scenario::{Display, Interleaved, MultiSine},
    scenario::Condition as Reference,
};
use serde::{Deserialize, Serialize};

use crate::{LabError, plant::MAX_STATES};

/// Configuration of an experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Name of the experiment.
    pub name: String,
    /// Consent text, which the person confirms before any measurement.
    pub consent: String,
    /// The order of the conditions.
    pub order: Order,
    /// Time at which the live estimate is shown to the person; the experimenter's window always shows it.
    pub live: LiveFor,
    /// Recursive method of the live estimate, as in `hoid track --method`.
    pub method: String,
    /// Limits above which a run is unverified.
    pub limits: Limits,
    /// Conditions of the experiment.
    pub condition: Vec<Condition>,
}

/// Order of the conditions in a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Each person has a row of a balanced Latin square.
    #[default]
    Latin,
    /// The order in the file is used.
    Given,
}

/// Time at which the live estimate is shown to the person.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LiveFor {
    /// After each run.
    #[default]
    After,
    /// Also during the run.
    During,
    /// Never.
    Never,
}

/// Limits above which a run is unverified.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// Longest permitted time between two frames, ms.
    pub frame_ms: f64,
    /// Longest permitted time from an input event to the tick at which it takes effect, ms.
    pub input_ms: f64,
}

impl Default for Limits {
    /// Returns limits of 100 ms, which is six frames at 60 Hz, or half of the delay of a typical operator.
    fn default() -> Self {
        Self {
            frame_ms: 100.0,
            input_ms: 100.0,
        }
    }
}

/// Condition of an experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Condition {
    /// Name of the condition: letters and digits, since it is part of file names.
    pub name: String,
    /// Instructions shown to the person before a run.
    pub text: String,
    /// A condition from C1 to C6, or a scenario file; it replaces the keys from `controlled_element` to `disturbance`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scenario: Option<String>,
    /// Text of the scenario file, stored with the session.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scenario_text: Option<String>,
    /// Controlled element, as a transfer function in s.
    pub controlled_element: String,
    /// The controlled element after the change.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last_element: Option<String>,
    /// Time of the change, s from the start of the measurement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub change_s: Option<f64>,
    /// Rate of the change, 1/s.
    pub rate_per_s: f64,
    /// Interval between changes back and forth, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interval_s: Option<f64>,
    /// Length of the measurement, s.
    pub measurement_s: f64,
    /// Length of the run-in before the measurement, s.
    pub run_in_s: f64,
    /// Target that the person tracks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<Signal>,
    /// Disturbance at the input of the controlled element.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub disturbance: Option<Signal>,
    /// Seed of the phases; different phases are drawn for each run.
    pub seed: u64,
    /// Half width of the display, in the unit of e.
    pub half_width: f64,
    /// Display of the task.
    pub display: Display,
    /// Length of the preview (s): the display shows the target up to this time ahead.
    pub preview_s: f64,
    /// u at full deflection of the device.
    pub full_deflection: f64,
    /// Number of training runs before the measured runs.
    pub training: usize,
    /// Number of measured runs.
    pub runs: usize,
    /// Rest after each run, s.
    pub break_s: f64,
}

/// A sum of sines at prime multiples of a base frequency, with phases drawn from the seed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Signal {
    /// Period in s; all sines are harmonics of this period.
    pub period_s: f64,
    /// Largest multiple of the base frequency.
    pub largest: u32,
    /// Root mean square of the signal.
    pub rms: f64,
    /// Choice of the prime multiples that the signal contains. If the display shows the target, the target and the
    /// disturbance need different lines: `even` for one of them and `odd` for the other.
    #[serde(skip_serializing_if = "is_all")]
    pub interleaved: Interleaved,
}

fn is_all(interleaved: &Interleaved) -> bool {
    *interleaved == Interleaved::All
}

impl Default for Signal {
    /// Returns a signal with a period of 20 s, multiples up to 31 and a root mean square of 1.5.
    fn default() -> Self {
        let default = MultiSine::default();
        Self {
            period_s: default.period_s,
            largest: default.largest,
            rms: 1.5,
            interleaved: default.interleaved,
        }
    }
}

impl Default for Condition {
    /// Returns a condition with compensatory tracking and rate control (4/s), with a measurement of 80 s after a run-in
    /// of 10 s.
    fn default() -> Self {
        Self {
            name: "rate".to_owned(),
            text: "Your hand sets the speed: the farther from the middle, the faster. In the middle, the motion stops."
                .to_owned(),
            scenario: None,
            scenario_text: None,
            controlled_element: "4/s".to_owned(),
            last_element: None,
            change_s: None,
            rate_per_s: 100.0,
            interval_s: None,
            measurement_s: 80.0,
            run_in_s: 10.0,
            target: None,
            disturbance: None,
            seed: 1,
            half_width: 6.0,
            display: Display::Compensatory,
            preview_s: 1.0,
            full_deflection: 3.0,
            training: 0,
            runs: 1,
            break_s: 10.0,
        }
    }
}

/// Default recursive method of the live estimate; since it needs no start fit, estimates are available after the first
/// few seconds.
const DEFAULT_METHOD: &str = "adaptive";

/// Default consent text.
const CONSENT: &str = "You will follow a moving target by hand for a few short runs. The program stores the \
movements of your hand and of the display, with their times, under a made-up name, on this computer only. It stores no \
real name, no picture and no sound. You may stop at any time with the Escape key or by closing the window; to delete \
the stored data, delete their folder. Do not take part if moving patterns make you unwell.";

impl Default for Config {
    /// Returns a configuration with a single run of about two minutes for trying out the lab.
    fn default() -> Self {
        Self {
            name: "First try".to_owned(),
            consent: CONSENT.to_owned(),
            order: Order::default(),
            live: LiveFor::default(),
            method: DEFAULT_METHOD.to_owned(),
            limits: Limits::default(),
            condition: vec![Condition {
                target: Some(Signal::default()),
                ..Condition::default()
            }],
        }
    }
}

impl Config {
    /// Reads and checks a configuration; the paths of scenario files are relative to its directory.
    ///
    /// # Errors
    /// [`LabError::Config`] with the place, the value found and the expected value.
    pub fn read(path: &Path) -> Result<Self, LabError> {
        let text = hoid_io::read_settings(path)?;
        let place = path.display().to_string();
        let mut config: Self = toml::from_str(&text).map_err(|error| {
            let line = error
                .span()
                .and_then(|span| text.get(..span.start))
                .map_or(1, |before| before.split('\n').count());
            LabError::Config {
                location: format!("{place}, line {line}"),
                reason: hoid_io::escape_control_characters(error.message().trim_end()),
            }
        })?;
        let directory = path.parent().unwrap_or_else(|| Path::new("."));
        for condition in &mut config.condition {
            condition.load_scenario(directory)?;
        }
        config.check(&place)?;
        Ok(config)
    }

    /// Checks everything that can be checked before an experiment.
    ///
    /// # Errors
    /// [`LabError::Config`].
    pub fn check(&self, place: &str) -> Result<(), LabError> {
        let wrong = |reason: String| {
            Err(LabError::Config {
                location: place.to_owned(),
                reason,
            })
        };
        if self.condition.is_empty() {
            return wrong("it has no [[condition]], expected at least one".to_owned());
        }
        if self.consent.trim().is_empty() {
            return wrong("consent is empty, expected the text that a person confirms".to_owned());
        }
        if let Err(error) = hoid_survey::method(&self.method) {
            return wrong(format!("method: {error}"));
        }
        for (name, ms) in [
            ("limits.frame_ms", self.limits.frame_ms),
            ("limits.input_ms", self.limits.input_ms),
        ] {
            if !(1.0..=10_000.0).contains(&ms) {
                return wrong(format!("{name} is {ms}, expected 1 to 10000 ms"));
            }
        }
        for (k, condition) in self.condition.iter().enumerate() {
            if self.condition.iter().take(k).any(|other| other.name == condition.name) {
                return wrong(format!(
                    "two conditions are called {:?}: give each its own name",
                    condition.name
                ));
            }
            condition.check().map_err(|error| LabError::Config {
                location: format!("{place}, condition {:?}", condition.name),
                reason: error.to_string(),
            })?;
        }
        Ok(())
    }

    /// Returns the configuration as TOML.
    ///
    /// # Errors
    /// [`LabError::Config`], which cannot occur for a configuration that was read.
    pub fn text(&self) -> Result<String, LabError> {
        toml::to_string(self).map_err(|error| LabError::Config {
            location: "the configuration".to_owned(),
            reason: error.to_string(),
        })
    }
}

/// Maximum length of a run, s.
const MAX_RUN_S: f64 = 1800.0;

impl Condition {
    /// Loads the text of the scenario file.
    fn load_scenario(&mut self, directory: &Path) -> Result<(), LabError> {
        let Some(name) = &self.scenario else { return Ok(()) };
        if self.scenario_text.is_some() {
            return Ok(());
        }
        self.scenario_text = Some(match name.parse::<Reference>() {
            Ok(condition) => format!("condition = {:?}\n", condition.name()),
            Err(_) => hoid_io::read_settings(&directory.join(name))?,
        });
        Ok(())
    }

    /// Checks that the numbers of the condition are valid and that it can be run.
    pub(crate) fn check(&self) -> Result<(), LabError> {
        let wrong = |reason: String| Err(LabError::Message(reason));
        let name = &self.name;
        if name.is_empty() || name.len() > 40 || !name.bytes().all(|b| b.is_ascii_alphanumeric()) {
            return wrong(format!(
                "name is {name:?}, expected 1 to 40 letters and digits: it is part of file names"
            ));
        }
        if !(1..=100).contains(&self.runs) || self.training > 100 {
            return wrong(format!(
                "runs = {} and training = {}, expected 1 to 100 runs and at most 100 for training",
                self.runs, self.training
            ));
        }
        for (key, value, least, most) in [
            ("half_width", self.half_width, 1e-6, 1e6),
            ("preview_s", self.preview_s, 0.05, 10.0),
            ("break_s", self.break_s, 0.0, 3600.0),
        ] {
            if !(least..=most).contains(&value) {
                return wrong(format!("{key} is {value}, expected {least} to {most}"));
            }
        }
        if !(self.full_deflection.is_finite() && self.full_deflection != 0.0) {
            return wrong(format!(
                "full_deflection is {}, expected a number other than zero",
                self.full_deflection
            ));
        }
        let course = self.task_definition()?;
        let (run_in, measured) = course.durations_s();
        if !(0.0..=MAX_RUN_S).contains(&(run_in + measured)) {
            return wrong(format!(
                "a run lasts {} s, expected at most {MAX_RUN_S}",
                run_in + measured
            ));
        }
        for (key, s) in [("run_in_s", run_in), ("measurement_s", measured)] {
            if ((s * 100.0).round() / 100.0 - s).abs() > 1e-9 {
                return wrong(format!("{key} is {s}, expected a multiple of 0.01 s"));
            }
        }
        let states = course.element_at(0.0)?.den().len().saturating_sub(1);
        if states > MAX_STATES {
            return wrong(format!(
                "the controlled element has {states} states, expected at most {MAX_STATES}"
            ));
        }
        if course.has_lines() == [false, false] {
            return wrong(
                "there is no target and no disturbance, so the person would have nothing to do; give at least one"
                    .to_owned(),
            );
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn default_config_is_valid_and_round_trips() {
        let config = Config::default();
        config.check("usual").unwrap();
        let again: Config = toml::from_str(&config.text().unwrap()).unwrap();
        assert_eq!(again, config);
    }

    #[test]
    fn invalid_configs_are_refused_by_key() {
        let refused = |change: fn(&mut Config)| {
            let mut config = Config::default();
            change(&mut config);
            config.check("lab.toml").unwrap_err().to_string()
        };
        assert!(refused(|c| c.condition.clear()).contains("no [[condition]]"));
        assert!(refused(|c| c.consent = " ".to_owned()).contains("consent"));
        assert!(refused(|c| c.method = "guess".to_owned()).contains("method"));
        assert!(refused(|c| c.condition[0].name = "a/b".to_owned()).contains("letters and digits"));
        assert!(refused(|c| c.condition[0].target = None).contains("nothing to do"));
        assert!(refused(|c| c.condition[0].measurement_s = 3000.0).contains("1800"));
        assert!(refused(|c| c.condition[0].full_deflection = 0.0).contains("full_deflection"));
        assert!(refused(|c| c.condition.push(c.condition[0].clone())).contains("two conditions"));
        assert!(refused(|c| c.condition[0].controlled_element = "4/s(s".to_owned()).contains("transfer function"));
        assert!(refused(|c| c.limits.frame_ms = f64::NAN).contains("frame_ms"));
    }

    #[test]
    fn named_scenarios_give_the_condition() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("lab.toml");
        std::fs::write(&path, "[[condition]]\nname = \"c4\"\nscenario = \"C4\"\n").unwrap();
        let config = Config::read(&path).unwrap();
        let course = config.condition[0].task_definition().unwrap();
        assert_eq!(course.durations_s(), (10.0, 81.92));
        assert_eq!(course.change_s(), Some(40.96));
        std::fs::write(&path, "nme = \"x\"\n").unwrap();
        let message = Config::read(&path).unwrap_err().to_string();
        assert!(message.contains("line 1") && message.contains("nme"), "{message}");
    }
}
