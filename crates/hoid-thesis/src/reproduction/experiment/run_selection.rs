//! The runs of a subject in a condition, and their mean and median.

use hoid_numerics::statistics::mean;
use hoid_study::statistics::median;

use crate::experiment::EvaluatedRun;

/// Returns the runs of a subject in a condition.
pub(super) fn select<'a>(runs: &'a [EvaluatedRun], subject: &str, condition: &str) -> Vec<&'a EvaluatedRun> {
    let own = runs
        .iter()
        .filter(|run| run.key.subject == subject && run.key.condition == condition);
    own.collect()
}

/// Returns the subjects with runs in a condition, in the order of the runs.
pub(super) fn subjects<'a>(runs: &'a [EvaluatedRun], condition: &str) -> Vec<&'a str> {
    let mut all: Vec<&str> = Vec::new();
    for run in runs.iter().filter(|run| run.key.condition == condition) {
        if !all.contains(&run.key.subject.as_str()) {
            all.push(&run.key.subject);
        }
    }
    all
}

/// Mean and median of the finite values.
pub(super) fn mean_and_median(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let finite: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    if finite.is_empty() {
        return [f64::NAN; 2];
    }
    [mean(&finite), median(&finite)]
}
