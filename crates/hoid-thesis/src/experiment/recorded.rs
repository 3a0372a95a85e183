//! Recorded people: the runs in the manifest of a group ([`Manifest`]), read and prepared as by `hoid group`.
//!
//! For each person and condition the last five runs that count are evaluated, as in the thesis. Times are measured from
//! the start of the evaluated span, `from_s` in the manifest; the thesis omits a run-in of 8.08 s.
//!
//! A condition replaces the condition of the thesis in which the controlled element changes in the same way. The change
//! is determined from `controlled_element`, `changes_to`, `change_s` and `change_per_s` of the manifest. An element
//! counts as s1 or s2 of the thesis according to the slope of its logarithmic gain `d ln|H| / d ln w` at 2 rad/s, near
//! the crossover frequency of people; the slope is -1.1 for s1 and -2.0 for s2. A change is sudden if the duration of
//! its middle 80 %, `2 ln 9 / G`, is less than a second. If no element is given, the name of the condition (C1 to C6)
//! is used.

use std::path::{Path, PathBuf};

use hoid_model::{ContinuousTransferFunction, scenario::Condition};
use hoid_study::group::{ConditionSettings, Manifest, RecordedRun, RunEntry};

use super::{EXPERIMENT_PLAN, Experiment, ExperimentCondition, ExperimentPlan, MeasuredRun, RunKey};
use crate::ThesisError;

/// Frequency at which the slopes of elements are compared, rad/s.
const COMPARISON_OMEGA_RAD_S: f64 = 2.0;
/// Limit between the slopes of a single and a double integrator.
const SLOPE_LIMIT: f64 = -1.5;
/// Limit for the duration of the middle 80 % of a sudden change, s.
const MAX_SUDDEN_S: f64 = 1.0;

/// Recordings of people that are evaluated.
#[derive(Debug, Clone)]
pub struct RecordedPeople {
    manifest: Manifest,
    directory: PathBuf,
    evaluated_runs: Vec<RunEntry>,
    conditions: Vec<ExperimentCondition>,
    skipped_conditions: Vec<(String, String)>,
    delays: (usize, usize),
}

impl RecordedPeople {
    /// Opens the recordings of a manifest, given by its path or its directory.
    ///
    /// # Errors
    /// [`ThesisError::Study`] if the manifest is missing or invalid, or if no run can be read;
    /// [`ThesisError::Recordings`] if no condition corresponds to one of the thesis, or if no run counts.
    pub fn open(location: &Path) -> Result<Self, ThesisError> {
        let path = Manifest::manifest_path(location)?;
        let manifest = Manifest::read(&path)?;
        let base = path.parent().map_or_else(|| PathBuf::from("."), Path::to_path_buf);
        let (conditions, left_out) = conditions(&manifest);
        if conditions.is_empty() {
            let reasons: Vec<String> = left_out.iter().map(|(name, why)| format!("{name}: {why}")).collect();
            return Err(ThesisError::Recordings {
                subject: path.display().to_string(),
                reason: format!(
                    "no condition corresponds to a condition of the thesis; {}",
                    reasons.join("; ")
                ),
            });
        }
        let count = ExperimentPlan::parse(EXPERIMENT_PLAN)?.evaluated as usize;
        let evaluated: Vec<RunEntry> = conditions
            .iter()
            .flat_map(|condition| last_runs(&manifest, &condition.name, count))
            .collect();
        // The first readable run gives the sample time. If no run can be read, the error of the first run is returned.
        let mut failed = None;
        let read = evaluated.iter().find_map(|entry| {
            let read = RecordedRun::read(&manifest, &base, entry);
            read.map_err(|error| failed.get_or_insert(error).to_string()).ok()
        });
        let Some(read) = read else {
            return Err(failed.map_or_else(
                || ThesisError::Recordings {
                    subject: path.display().to_string(),
                    reason: "no run counts, expected at least one run with counts = true".to_owned(),
                },
                ThesisError::from,
            ));
        };
        let samples = |delay_s: f64| (delay_s / read.record.sample_time().s()).round() as usize + 1;
        let (least_s, most_s) = manifest.analysis.delay_s;
        Ok(Self {
            delays: (samples(least_s), samples(most_s)),
            directory: base,
            evaluated_runs: evaluated,
            conditions,
            skipped_conditions: left_out,
            manifest,
        })
    }

    /// Name of the group.
    pub fn name(&self) -> &str {
        &self.manifest.name
    }

    /// Conditions that correspond to no condition of the thesis, with the reason.
    pub fn omitted_conditions(&self) -> &[(String, String)] {
        &self.skipped_conditions
    }
}

impl Experiment for RecordedPeople {
    fn runs(&self) -> Vec<RunKey> {
        self.evaluated_runs.iter().map(key_of).collect()
    }

    fn conditions(&self) -> Vec<ExperimentCondition> {
        self.conditions.clone()
    }

    fn delays(&self) -> (usize, usize) {
        self.delays
    }

    fn read_run(&self, key: &RunKey) -> Result<MeasuredRun, ThesisError> {
        let entry = self.evaluated_runs.iter().find(|entry| key_of(entry) == *key);
        let entry = entry.ok_or_else(|| ThesisError::Recordings {
            subject: self.manifest.name.clone(),
            reason: format!(
                "there is no run {} of {} in condition {}",
                key.run, key.subject, key.condition
            ),
        })?;
        let read = RecordedRun::read(&self.manifest, &self.directory, entry)?;
        let start_s = read.record.time_s(0);
        Ok(MeasuredRun {
            change_s: read.change_s.map(|change_s| change_s - start_s),
            record: read.record.starting_at(0.0),
        })
    }
}

fn key_of(entry: &RunEntry) -> RunKey {
    RunKey {
        subject: entry.subject.clone(),
        condition: entry.condition.clone(),
        run: entry.run.clone(),
    }
}

/// Returns the last `count` runs of each person in a condition. The runs of a person are ordered by number if all of
/// them have one, otherwise as in the manifest.
fn last_runs(manifest: &Manifest, condition: &str, count: usize) -> Vec<RunEntry> {
    let own: Vec<&RunEntry> = (manifest.runs.iter())
        .filter(|run| run.counts && run.condition == condition)
        .collect();
    let mut subjects: Vec<&str> = own.iter().map(|run| run.subject.as_str()).collect();
    subjects.sort_unstable();
    subjects.dedup();
    let mut last = Vec::new();
    for subject in subjects {
        let mut runs: Vec<&RunEntry> = own.iter().copied().filter(|run| run.subject == subject).collect();
        if runs.iter().all(|run| run.run.parse::<u64>().is_ok()) {
            runs.sort_by_key(|run| run.run.parse::<u64>().unwrap_or(0));
        }
        last.extend(
            runs.iter()
                .skip(runs.len().saturating_sub(count))
                .map(|run| (*run).clone()),
        );
    }
    last
}

/// Returns the conditions with the corresponding conditions of the thesis, and the names of the other conditions with
/// the reason.
fn conditions(manifest: &Manifest) -> (Vec<ExperimentCondition>, Vec<(String, String)>) {
    let mut names: Vec<&str> = manifest.runs.iter().map(|run| run.condition.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let (mut found, mut others) = (Vec::new(), Vec::new());
    for name in names {
        let settings = manifest.conditions.get(name).cloned().unwrap_or_default();
        match matching_condition(name, &settings) {
            Ok(of_text) => found.push(ExperimentCondition {
                name: name.to_owned(),
                thesis_condition: of_text,
            }),
            Err(reason) => others.push((name.to_owned(), reason)),
        }
    }
    (found, others)
}

/// Returns the condition of the thesis in which the controlled element changes in the same way.
fn matching_condition(name: &str, settings: &ConditionSettings) -> Result<Condition, String> {
    let unknown = |what: &str| {
        format!(
            "{what}: set controlled_element in [conditions.{name}], with changes_to, change_s and change_per_s if it \
             changes, or give the condition its name in the thesis (C1 to C6)"
        )
    };
    let Some(before) = &settings.controlled_element else {
        return name.parse().map_err(|_| unknown("its controlled element is not known"));
    };
    let Some(after) = &settings.changes_to else {
        if settings.change_s.is_some() {
            return name
                .parse()
                .map_err(|_| unknown("the controlled element after the change is not known"));
        }
        return Ok(match is_double(before)? {
            false => Condition::C1,
            true => Condition::C2,
        });
    };
    let is_sudden = settings
        .change_per_s
        .is_none_or(|rate| 2.0 * 9.0_f64.ln() / rate < MAX_SUDDEN_S);
    match (is_double(before)?, is_double(after)?, is_sudden) {
        (false, true, false) => Ok(Condition::C3),
        (false, true, true) => Ok(Condition::C4),
        (true, false, false) => Ok(Condition::C5),
        (true, false, true) => Ok(Condition::C6),
        (same, _, _) => Err(format!(
            "its controlled element changes from {before} to {after}, and both resemble a {} integrator; in the \
             thesis it changes between a single and a double integrator",
            if same { "double" } else { "single" }
        )),
    }
}

/// True if an element resembles a double integrator near the crossover frequency, as s2 does.
fn is_double(element: &str) -> Result<bool, String> {
    let element: ContinuousTransferFunction = element.parse().map_err(|error| format!("{error}"))?;
    let step = 1e-3_f64;
    let log_gain = |shift: f64| element.response(COMPARISON_OMEGA_RAD_S * shift.exp()).norm().ln();
    Ok((log_gain(step) - log_gain(-step)) / (2.0 * step) < SLOPE_LIMIT)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn condition_settings(before: &str, after: Option<&str>, change_per_s: Option<f64>) -> ConditionSettings {
        ConditionSettings {
            controlled_element: Some(before.to_owned()),
            change_s: after.map(|_| 50.0),
            changes_to: after.map(str::to_owned),
            change_per_s,
            ..ConditionSettings::default()
        }
    }

    #[test]
    fn conditions_are_matched_by_elements_and_change() {
        let (s1, s2) = ("90/(s(s+6))", "30/(s(s+.2))");
        for (found, expected) in [
            (condition_settings(s1, None, None), Condition::C1),
            (condition_settings(s2, None, None), Condition::C2),
            (condition_settings(s1, Some(s2), Some(0.5)), Condition::C3),
            (condition_settings(s1, Some(s2), Some(100.0)), Condition::C4),
            (condition_settings(s1, Some(s2), None), Condition::C4),
            (condition_settings(s2, Some(s1), Some(0.5)), Condition::C5),
            (condition_settings("-5/s^2", Some("4/s"), None), Condition::C6),
        ] {
            // A known element takes precedence over the name.
            assert_eq!(matching_condition("C1", &found), Ok(expected), "{found:?}");
        }
        assert_eq!(
            matching_condition("C5", &ConditionSettings::default()),
            Ok(Condition::C5)
        );
        let unknown = matching_condition("slow", &ConditionSettings::default()).unwrap_err();
        assert!(unknown.contains("[conditions.slow]"), "{unknown}");
        let same = matching_condition("C3", &condition_settings(s1, Some("80/(s(s+5))"), None)).unwrap_err();
        assert!(same.contains("both resemble a single integrator"), "{same}");
    }

    #[test]
    fn last_runs_are_selected_by_number() {
        let run = |number: u64, counts: bool| {
            format!(
                "[[runs]]\nfile = \"{number}.csv\"\nsubject = \"a\"\ncondition = \"C1\"\nrun = \"{number}\"\ncounts = {counts}\n"
            )
        };
        let runs: String = [10, 9, 8, 11, 12].map(|number| run(number, number != 11)).join("");
        let manifest = Manifest::parse(&format!("name = \"x\"\n{runs}"), "group.toml").unwrap();
        let last: Vec<String> = last_runs(&manifest, "C1", 3).into_iter().map(|run| run.run).collect();
        assert_eq!(last, ["9", "10", "12"]);
    }

    #[test]
    fn directory_without_manifest_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let refused = RecordedPeople::open(directory.path()).unwrap_err().to_string();
        assert!(
            refused.contains("group.toml") && refused.contains("hoid group init"),
            "{refused}"
        );
    }
}
