//! The manifest of a group, in TOML: which files belong to whom, and what is done with them.
//!
//! ```toml
//! name = "tracking"
//!
//! [read]                                  # as in hoid identify
//! input = "r-y"
//! output = "u"
//! from_s = 5.0
//! to_s = 45.0
//!
//! [prepare]                               # as in hoid identify; see `preparing`
//! offset = { u = 1 }
//!
//! [analysis]
//! windows_s = [[5.0, 25.0], [25.0, 45.0]] # sub-batches; default: the first and the last three eighths of each record
//! nd = [1, 4]                             # least and greatest order of the noise model, chosen by BIC; default [1, 1]
//! methods = ["rls", "rpem"]               # recursions; default rls, rpem, physical
//!
//! [conditions.fo]
//! controlled_element = "1/1,0"
//! excitation = "d"
//!
//! [[runs]]
//! file = "P03_fo_03.csv"
//! subject = "P03"
//! condition = "fo"
//! run = "3"
//! counts = true
//! ```

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use hoid_io::Preparation;
use hoid_track::Method;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::StudyError;

use super::{frequency::transfer_function, pattern::Pattern, preparing::Preparing};

/// A group of recorded runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Name of the experiment.
    pub name: String,
    /// How the files are read.
    #[serde(default)]
    pub read: Reading,
    /// What is done to the runs before they are analysed.
    #[serde(default, skip_serializing_if = "Preparing::is_empty")]
    pub prepare: Preparing,
    /// What is done with each run.
    #[serde(default)]
    pub analysis: Analysis,
    /// What is known of the conditions, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub conditions: BTreeMap<String, ConditionFacts>,
    /// The runs.
    pub runs: Vec<RunEntry>,
}

/// How files are read, as in `hoid identify`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Reading {
    /// Column of the input, or a difference such as `r-y`.
    pub input: String,
    /// Column of the output.
    pub output: String,
    /// Sampling frequency, Hz; that of the column t where it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sampling_hz: Option<f64>,
    /// Begin of the span that counts, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_s: Option<f64>,
    /// End of the span that counts, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to_s: Option<f64>,
    /// Interpolate an uneven t.
    pub resample: bool,
    /// Bridge missing values.
    pub fill: bool,
    /// What is taken out of e and u: none, mean or linear.
    pub detrend: Detrending,
}

/// What is taken out of e and u.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Detrending {
    /// Nothing.
    #[default]
    None,
    /// The mean.
    Mean,
    /// A straight line.
    Linear,
}

impl Default for Reading {
    fn default() -> Self {
        Self {
            input: "e".to_owned(),
            output: "u".to_owned(),
            sampling_hz: None,
            from_s: None,
            to_s: None,
            resample: false,
            fill: false,
            detrend: Detrending::None,
        }
    }
}

/// What is done with each run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Analysis {
    /// The two sub-batches, s; the first and the last three eighths of each record where they are left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub windows_s: Option<[(f64, f64); 2]>,
    /// Least and greatest order of the noise model; BIC chooses on each sub-batch, the greater one is taken.
    pub nd: (usize, usize),
    /// Range of the delay, s.
    pub delay_s: (f64, f64),
    /// Recursions: rls, rpem, physical.
    pub methods: Vec<MethodName>,
    /// Samples from one kept point of a trace to the next.
    pub trace_every: usize,
    /// Whether the grey box is fitted too.
    pub grey_box: bool,
    /// Frequencies at which the response of the recursions is kept, rad/s.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub response_at_rad_s: Vec<f64>,
}

/// A recursion by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MethodName {
    /// Recursive least squares.
    Rls,
    /// Recursive prediction-error method.
    Rpem,
    /// The same in physical parameters.
    Physical,
}

impl From<MethodName> for Method {
    fn from(name: MethodName) -> Self {
        match name {
            MethodName::Rls => Self::rls(),
            MethodName::Rpem => Self::rpem(),
            MethodName::Physical => Self::physical(),
        }
    }
}

impl Default for Analysis {
    fn default() -> Self {
        Self {
            windows_s: None,
            nd: (1, 1),
            delay_s: (0.05, 0.6),
            methods: vec![MethodName::Rls, MethodName::Rpem, MethodName::Physical],
            trace_every: 16,
            grey_box: false,
            response_at_rad_s: Vec::new(),
        }
    }
}

/// What is known of a condition.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ConditionFacts {
    /// Controlled element as `numerator/denominator`, by falling powers of s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub controlled_element: Option<String>,
    /// Channel whose lines excite the loop: f_t or a disturbance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub excitation: Option<String>,
    /// Period of the excitation, s; the longest that all its lines are harmonics of where it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub period_s: Option<f64>,
    /// Samples by which u is recorded later than the e that it answers: `e[k]` belongs to `u[k + offset]`.
    pub offset_samples: f64,
    /// Whether the describing function is fitted with a lead.
    pub lead: bool,
    /// Time at which the task changes, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub change_s: Option<f64>,
    /// What is done to its runs before they are analysed; what it names wins over that of the group.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prepare: Option<Preparing>,
}

impl Default for ConditionFacts {
    fn default() -> Self {
        Self {
            controlled_element: None,
            excitation: None,
            period_s: None,
            offset_samples: 0.0,
            lead: true,
            change_s: None,
            prepare: None,
        }
    }
}

/// One run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunEntry {
    /// Its file, from the directory of the manifest.
    pub file: PathBuf,
    /// A second file that is joined behind the first, from the next sample on: what the person controls changes at the seam.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub then: Option<PathBuf>,
    /// Who it is.
    pub subject: String,
    /// What was controlled.
    #[serde(default)]
    pub condition: String,
    /// Which run.
    pub run: String,
    /// Whether it counts: training runs are listed and left out.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub counts: bool,
}

fn yes() -> bool {
    true
}

#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_yes(counts: &bool) -> bool {
    *counts
}

impl Manifest {
    /// Reads and checks a manifest.
    ///
    /// # Errors
    /// [`StudyError::Plan`] with the file, the line where there is one, and the remedy; [`StudyError::Io`].
    pub fn read(path: &Path) -> Result<Self, StudyError> {
        Self::parse(&hoid_io::read_text(path)?, &path.display().to_string())
    }

    /// A manifest from its text; `path` is for messages.
    ///
    /// # Errors
    /// As [`Manifest::read`].
    pub fn parse(text: &str, path: &str) -> Result<Self, StudyError> {
        let bad = |line: Option<usize>, reason: String| StudyError::Plan {
            path: path.to_owned(),
            line,
            reason,
        };
        let manifest: Self = toml::from_str(text).map_err(|error| {
            let line = error.span().map(|span| crate::plan::line_at(text, span.start));
            bad(line, error.message().trim_end().to_owned())
        })?;
        manifest.check().map_err(|reason| bad(None, reason))?;
        Ok(manifest)
    }

    fn check(&self) -> Result<(), String> {
        if !self.runs.iter().any(|run| run.counts) {
            return Err("no run counts, expected at least one table [[runs]] with counts = true".to_owned());
        }
        let mut known = std::collections::BTreeSet::new();
        for run in &self.runs {
            if run.subject.is_empty() || run.run.is_empty() {
                return Err(format!("{} has no subject or no run: name both", run.file.display()));
            }
            if !known.insert((&run.subject, &run.condition, &run.run)) {
                return Err(format!(
                    "run {} of {} in {:?} is there twice, the second time as {}: give each its own run",
                    run.run,
                    run.subject,
                    run.condition,
                    run.file.display()
                ));
            }
        }
        for name in self.conditions.keys() {
            if !self.runs.iter().any(|run| run.condition == *name) {
                return Err(format!("[conditions.{name}]: no run has this condition"));
            }
        }
        for run in self.runs.iter().filter(|run| run.then.is_some()) {
            if let Some(facts) = self.conditions.get(&run.condition)
                && (facts.excitation.is_some() || facts.change_s.is_some())
            {
                return Err(format!(
                    "run {} of {} is joined of two files, but [conditions.{}] names an excitation or change_s: leave them out, the change is at the seam",
                    run.run, run.subject, run.condition
                ));
            }
        }
        for (name, facts) in &self.conditions {
            if let Some(element) = &facts.controlled_element {
                transfer_function(element)
                    .map_err(|reason| format!("[conditions.{name}]: controlled_element {reason}"))?;
            }
        }
        self.prepare
            .preparation(None)
            .map_err(|reason| format!("[prepare]: {reason}"))?;
        for name in self.conditions.keys() {
            self.preparation(name)
                .map_err(|reason| format!("[conditions.{name}.prepare]: {reason}"))?;
        }
        let a = &self.analysis;
        if a.nd.0 == 0 || a.nd.0 > a.nd.1 || a.nd.1 > 20 {
            return Err(format!(
                "analysis.nd is {:?}, expected two orders from 1 to 20, the smaller first",
                a.nd
            ));
        }
        if !(a.delay_s.0 >= 0.0 && a.delay_s.0 < a.delay_s.1 && a.delay_s.1.is_finite()) {
            return Err(format!(
                "analysis.delay_s is {:?}, expected two times, the smaller first",
                a.delay_s
            ));
        }
        if let Some(omega) = a
            .response_at_rad_s
            .iter()
            .find(|omega| !(**omega > 0.0 && omega.is_finite()))
        {
            return Err(format!(
                "analysis.response_at_rad_s has {omega}, expected positive frequencies in rad/s"
            ));
        }
        if a.trace_every == 0 {
            return Err("analysis.trace_every is 0, expected 1 or more".to_owned());
        }
        for (from, to) in a.windows_s.iter().flatten() {
            if !(from < to && from.is_finite() && to.is_finite()) {
                return Err(format!(
                    "analysis.windows_s has [{from}, {to}], expected a beginning before its end"
                ));
            }
        }
        Ok(())
    }

    /// A manifest of the files in a directory that match a pattern, in the order of their names; and the names of those that do not.
    ///
    /// # Errors
    /// [`StudyError::Io`] when the directory cannot be read, [`StudyError::NoRuns`] when nothing matches.
    pub fn of_directory(directory: &Path, pattern: &Pattern) -> Result<(Self, Vec<String>), StudyError> {
        let mut names = hoid_io::file_names(directory)?;
        names.sort();
        let (mut runs, mut others) = (Vec::new(), Vec::new());
        for name in names {
            match pattern.matches(&name) {
                Some(found) => runs.push(RunEntry {
                    file: PathBuf::from(&name),
                    then: None,
                    subject: if found.subject.is_empty() {
                        "1".to_owned()
                    } else {
                        found.subject
                    },
                    condition: found.condition,
                    run: found.run,
                    counts: true,
                }),
                None => others.push(name),
            }
        }
        if runs.is_empty() {
            return Err(StudyError::NoRuns {
                directory: directory.display().to_string(),
            });
        }
        let name = directory
            .canonicalize()
            .ok()
            .and_then(|full| full.file_name().map(|name| name.to_string_lossy().into_owned()))
            .unwrap_or_else(|| "group".to_owned());
        let manifest = Self {
            name,
            read: Reading::default(),
            prepare: Preparing::default(),
            analysis: Analysis::default(),
            conditions: BTreeMap::new(),
            runs,
        };
        Ok((manifest, others))
    }

    /// What is done to the runs of a condition.
    ///
    /// # Errors
    /// The key that has no meaning, and why.
    pub fn preparation(&self, condition: &str) -> Result<Preparation, String> {
        let of_condition = self.conditions.get(condition).and_then(|facts| facts.prepare.as_ref());
        self.prepare.preparation(of_condition)
    }

    /// The manifest as TOML.
    pub fn text(&self) -> String {
        toml::to_string_pretty(self).unwrap_or_default()
    }
}
