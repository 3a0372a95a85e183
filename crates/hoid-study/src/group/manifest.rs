//! The manifest of a group, in TOML: it assigns files to subjects, conditions and runs, and contains the settings of
//! the analysis.
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
//! [prepare]                               # as in hoid identify; see [`PreparationSettings`]
//! offset = { u = 1 }
//!
//! [analysis]
//! windows_s = [[5.0, 25.0], [25.0, 45.0]] # sub-batches; default: the first and the last three eighths of each record
//! nd = [1, 4]                             # least and greatest order of the noise model, chosen by BIC; default [1, 1]
//! methods = ["rls", "rpem"]               # recursions; default adaptive, rls, rpem
//!
//! [conditions.fo]
//! controlled_element = "1/1,0"
//! excitation = "d"
//! roles = ["r=feedforward:0.25"]          # further inputs, as --role of hoid identify
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

use hoid_analysis::Setting;
use hoid_io::Preparation;
use hoid_model::Decimation;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::StudyError;

use super::{
    analysis_settings::AnalysisSettings, condition_settings::ConditionSettings, pattern::Pattern,
    preparation_settings::PreparationSettings, read_settings::ReadSettings,
};

/// Name of the copy of the manifest next to the results.
pub const MANIFEST_FILE: &str = "group.toml";

/// A group of recorded runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Name of the experiment.
    pub name: String,
    /// Settings for reading the files.
    #[serde(default)]
    pub read: ReadSettings,
    /// Preparation of the runs before they are analysed.
    #[serde(default, skip_serializing_if = "PreparationSettings::is_empty")]
    pub prepare: PreparationSettings,
    /// Settings of the analysis of each run.
    #[serde(default)]
    pub analysis: AnalysisSettings,
    /// Known properties of the conditions, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub conditions: BTreeMap<String, ConditionSettings>,
    /// The runs of the group.
    pub runs: Vec<RunEntry>,
}

/// A run of a group.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunEntry {
    /// Path of the file of the run, relative to the directory of the manifest.
    pub file: PathBuf,
    /// A second file, appended to the first at the next sample. The controlled element changes where the files are
    /// joined.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub then: Option<PathBuf>,
    /// Name of the subject.
    pub subject: String,
    /// Name of the condition, such as the controlled element.
    #[serde(default)]
    pub condition: String,
    /// Number or name of the run.
    pub run: String,
    /// Whether the run is analysed. Training runs are listed but not analysed.
    #[serde(default = "default_true", skip_serializing_if = "is_true")]
    pub counts: bool,
}

fn default_true() -> bool {
    true
}

#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_true(counts: &bool) -> bool {
    *counts
}

impl Manifest {
    /// Returns the path of the manifest: `named` itself, or the manifest in the directory `named`.
    ///
    /// # Errors
    /// [`StudyError::NoManifest`] if there is no manifest.
    pub fn manifest_path(named: &Path) -> Result<PathBuf, StudyError> {
        let path = if named.is_dir() {
            named.join(MANIFEST_FILE)
        } else {
            named.to_owned()
        };
        if path.exists() {
            return Ok(path);
        }
        Err(StudyError::NoManifest {
            path: path.display().to_string(),
        })
    }

    /// Reads and checks a manifest.
    ///
    /// # Errors
    /// [`StudyError::Plan`] with the file, the line if known, and the remedy; [`StudyError::Io`] if the file cannot be
    /// read.
    pub fn read(path: &Path) -> Result<Self, StudyError> {
        Self::parse(&hoid_io::read_settings(path)?, &path.display().to_string())
    }

    /// Parses the text of a manifest; `path` is used in messages.
    ///
    /// # Errors
    /// Same as [`Manifest::read`].
    pub fn parse(text: &str, path: &str) -> Result<Self, StudyError> {
        let bad = |line: Option<usize>, reason: String| StudyError::Plan {
            path: path.to_owned(),
            line,
            reason: hoid_io::escape_control_characters(&reason),
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
            return Err("no run is to be analysed: expected at least one table [[runs]] with counts = true".to_owned());
        }
        let mut known = std::collections::BTreeSet::new();
        for run in &self.runs {
            if run.subject.is_empty() || run.run.is_empty() {
                return Err(format!("{} has no subject or no run: name both", run.file.display()));
            }
            if !known.insert((&run.subject, &run.condition, &run.run)) {
                return Err(format!(
                    "run {} of {} in {:?} appears twice, the second time as {}: give each file its own run",
                    run.run,
                    run.subject,
                    run.condition,
                    run.file.display()
                ));
            }
        }
        for name in self.conditions.keys() {
            if !self.runs.iter().any(|run| run.condition == *name) {
                return Err(format!(
                    "[conditions.{name}]: no run has this condition; remove the table or correct its name"
                ));
            }
        }
        for run in self.runs.iter().filter(|run| run.then.is_some()) {
            if let Some(condition_settings) = self.conditions.get(&run.condition)
                && (condition_settings.excitation.is_some() || condition_settings.change_s.is_some())
            {
                return Err(format!(
                    "run {} of {} is joined from two files, but [conditions.{}] names an excitation or change_s: leave \
                     both out, since the task changes where the files are joined",
                    run.run, run.subject, run.condition
                ));
            }
        }
        for (name, condition_settings) in &self.conditions {
            condition_settings
                .check_elements()
                .and_then(|()| condition_settings.channels().map(|_| ()))
                .map_err(|reason| format!("[conditions.{name}]: {reason}"))?;
        }
        self.prepare
            .preparation(None)
            .map_err(|reason| format!("[prepare]: {reason}"))?;
        for name in self.conditions.keys() {
            self.preparation(name)
                .map_err(|reason| format!("[conditions.{name}.prepare]: {reason}"))?;
        }
        self.analysis.check()
    }

    /// Creates a manifest of the files in a directory whose names match a pattern, sorted by name. Also returns the
    /// names that do not match.
    ///
    /// # Errors
    /// [`StudyError::Io`] if the directory cannot be read, [`StudyError::NoRuns`] if no name matches.
    pub fn from_directory(directory: &Path, pattern: &Pattern) -> Result<(Self, Vec<String>), StudyError> {
        let mut names = hoid_io::file_names(directory)?;
        names.sort();
        let (mut runs, mut others) = (Vec::new(), Vec::new());
        for name in names {
            match pattern.matches(&name) {
                Some(found) => runs.push(RunEntry {
                    file: PathBuf::from(&name),
                    then: None,
                    condition: found.condition_with_axis(),
                    subject: if found.subject.is_empty() {
                        "1".to_owned()
                    } else {
                        found.subject
                    },
                    run: found.run,
                    counts: true,
                }),
                None => others.push(name),
            }
        }
        if runs.is_empty() {
            let shown: Vec<&str> = others.iter().take(3).map(String::as_str).collect();
            return Err(StudyError::NoRuns {
                directory: directory.display().to_string(),
                pattern: pattern.to_string(),
                found: match (shown.as_slice(), others.len() - shown.len()) {
                    ([], _) => "no files".to_owned(),
                    (shown, 0) => shown.join(", "),
                    (shown, more) => format!("{} and {more} more", shown.join(", ")),
                },
            });
        }
        let name = directory
            .canonicalize()
            .ok()
            .and_then(|full| full.file_name().map(|name| name.to_string_lossy().into_owned()))
            .unwrap_or_else(|| "group".to_owned());
        let manifest = Self {
            name,
            read: ReadSettings::default(),
            prepare: PreparationSettings::default(),
            analysis: AnalysisSettings::default(),
            conditions: BTreeMap::new(),
            runs,
        };
        Ok((manifest, others))
    }

    /// Returns the preparation of the runs of a condition.
    ///
    /// # Errors
    /// The invalid key, and the reason.
    pub fn preparation(&self, condition: &str) -> Result<Preparation, String> {
        let of_condition = self
            .conditions
            .get(condition)
            .and_then(|condition_settings| condition_settings.prepare.as_ref());
        self.prepare.preparation(of_condition)
    }

    /// Returns the decimation by sampling frequency that applies to the runs of a condition.
    ///
    /// # Errors
    /// Same as [`Manifest::preparation`].
    pub fn rate_decimation(&self, condition: &str) -> Result<Decimation, String> {
        let of_condition = self
            .conditions
            .get(condition)
            .and_then(|condition_settings| condition_settings.prepare.as_ref());
        self.prepare.rate_decimation(of_condition)
    }

    /// Sets the further inputs of all conditions.
    ///
    /// # Errors
    /// The invalid entry; a run without the name of a condition, which has no settings.
    pub fn set_roles(&mut self, roles: &[String]) -> Result<(), String> {
        if roles.is_empty() {
            return Ok(());
        }
        for run in &self.runs {
            if run.condition.is_empty() {
                let file = run.file.display();
                return Err(format!("{file} has no condition: include {{condition}} in --pattern"));
            }
            let condition_settings = self.conditions.entry(run.condition.clone()).or_default();
            condition_settings.roles = roles.to_vec();
            condition_settings.channels()?;
        }
        Ok(())
    }

    /// Returns the settings of the sections `[read]`, `[prepare]` and `[analysis]` and of the conditions, including
    /// defaults.
    pub fn settings(&self) -> Vec<Setting> {
        let default = Self {
            name: String::new(),
            read: ReadSettings::default(),
            prepare: PreparationSettings::default(),
            analysis: AnalysisSettings::default(),
            conditions: BTreeMap::new(),
            runs: Vec::new(),
        };
        Setting::mark_non_defaults(self.setting_rows(), &default.setting_rows())
    }

    fn setting_rows(&self) -> Vec<Setting> {
        let whole = toml::Table::try_from(self).unwrap_or_default();
        let mut rows = Vec::new();
        for section in ["read", "prepare", "analysis", "conditions"] {
            let keys = whole.get(section).and_then(toml::Value::as_table);
            rows.extend(keys.into_iter().flatten().map(|(key, value)| {
                let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
                Setting::new(format!("{section}.{key}"), text)
            }));
        }
        rows
    }

    /// Returns the manifest as TOML text.
    pub fn text(&self) -> String {
        toml::to_string_pretty(self).unwrap_or_default()
    }
}
