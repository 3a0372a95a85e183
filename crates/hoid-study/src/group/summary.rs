//! Summary of a finished group: failures, people, and an overall verdict.
//!
//! | finding | level | condition |
//! |---|---|---|
//! | `nothing-read` | undetermined | no run could be read |
//! | `nothing-determined` | undetermined | operators were requested, but the data determine none of them |
//! | `run-failed` | doubt | a run could not be read |
//! | `condition-failed` | doubt | no operator could be fitted to a person in a condition |
//! | `person-not-determined`, `person-doubtful` | doubt | the operator of a person is not determined, or is doubtful |
//! | `fits-failed` | note | other fits failed; the table of estimates gives the reasons |
//! | `one-input-models` | note | models with one input are omitted, because the person also responds to other inputs |
//! | `condition-changes` | note | there is no operator, because the task changes within the runs |
//!
//! If the data of one person carry no information, the group is doubtful, not undetermined: the results of the other
//! people remain valid.

use std::path::Path;

use hoid_io::{OutputTable, read_table};
use hoid_model::{Finding, Verdict, VerdictLevel};

use super::{
    analysis::{PEOPLE_TABLE, READ_LABEL},
    manifest::Manifest,
    person::{Person, PersonStatus, cell_name, read_people},
    tables::{numbers, texts},
};
use crate::{StudyError, directory::table_path};

/// A run that could not be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunFailure {
    /// Subject.
    pub subject: String,
    /// Condition.
    pub condition: String,
    /// Run.
    pub run: String,
    /// Reason.
    pub reason: String,
}

/// Summary of a finished group.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupSummary {
    /// Number of runs that are analysed.
    pub runs: usize,
    /// The runs that could not be read.
    pub failures: Vec<RunFailure>,
    /// The people, in the order of their first runs in the manifest.
    pub people: Vec<Person>,
    /// Verdict on the group as a whole.
    pub verdict: Verdict,
    /// Faults of the recordings.
    pub faults: Vec<RunFault>,
}

/// A fault or a problem of the recording of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunFault {
    /// File of the run.
    pub file: String,
    /// Name of the kind of fault.
    pub kind: String,
    /// Channel; empty if the fault concerns all channels or the time.
    pub channel: String,
    /// Time of the first sample of the fault (in s); `None` if the fault has no location in time.
    pub from_s: Option<f64>,
    /// Size of the fault, in the unit that belongs to its kind.
    pub size: f64,
    /// Description as a sentence without a full stop.
    pub description: String,
}

impl GroupSummary {
    /// Reads the tables in the directory of a finished group.
    ///
    /// # Errors
    /// [`StudyError::Io`] if a table cannot be read.
    pub fn read(manifest: &Manifest, directory: &Path) -> Result<Self, StudyError> {
        let table = |name: &str| read_table(&table_path(directory, name, false));
        let (people, estimates) = (read_people(&table(PEOPLE_TABLE)?), table("estimates")?);
        let (failures, other) = failures(&estimates);
        let runs = manifest.runs.iter().filter(|run| run.counts).count();
        let verdict = Verdict::of(findings(runs, &failures, &people, other));
        Ok(Self {
            runs,
            failures,
            people,
            verdict,
            faults: run_faults(&table(FAULTS_TABLE)?),
        })
    }
}

/// Name of the table of faults.
const FAULTS_TABLE: &str = "trouble";

fn run_faults(table: &OutputTable) -> Vec<RunFault> {
    let [file, kind, channel, what] = ["file", "kind", "channel", "what"].map(|name| texts(table, name));
    let [from_s, size] = ["from_s", "size"].map(|name| numbers(table, name));
    let fault = |i: usize| RunFault {
        file: file[i].clone(),
        kind: kind[i].clone(),
        channel: channel[i].clone(),
        from_s: Some(from_s[i]).filter(|t| t.is_finite()),
        size: size[i],
        description: what[i].clone(),
    };
    (0..kind.len()).map(fault).collect()
}

/// Returns the runs that could not be read, and the number of other failed estimates.
fn failures(estimates: &OutputTable) -> (Vec<RunFailure>, usize) {
    let [subject, condition, run, estimator, status, reason] =
        ["subject", "condition", "run", "estimator", "status", "reason"].map(|name| texts(estimates, name));
    let failed: Vec<usize> = (0..status.len()).filter(|i| status[*i] == "failed").collect();
    let (unread, other): (Vec<usize>, Vec<usize>) = failed.into_iter().partition(|i| estimator[*i] == READ_LABEL);
    let failure = |i: usize| RunFailure {
        subject: subject[i].clone(),
        condition: condition[i].clone(),
        run: run[i].clone(),
        reason: reason[i].clone(),
    };
    (unread.into_iter().map(failure).collect(), other.len())
}

fn findings(runs: usize, failures: &[RunFailure], people: &[Person], other: usize) -> Vec<Finding> {
    let mut all = Vec::new();
    let sought = || people.iter().filter(|p| p.status != PersonStatus::Changes);
    let stands = |p: &Person| p.level().is_some_and(|level| level != VerdictLevel::NotDetermined);
    if failures.len() == runs {
        all.push(Finding::undetermined(
            "nothing-read",
            format!("none of the {runs} runs could be read"),
        ));
    } else if sought().next().is_some() && !sought().any(stands) {
        all.push(Finding::undetermined(
            "nothing-determined",
            "the data do not determine the operator of any person",
        ));
    }
    for f in failures {
        let name = cell_name(&f.subject, &f.condition);
        all.push(Finding::warning(
            "run-failed",
            format!("run {} of {name} could not be read: {}", f.run, f.reason),
        ));
    }
    for p in people {
        let name = p.name();
        let reasons: Vec<&str> = p.verdict.iter().flat_map(Verdict::reasons).collect();
        let reasons = reasons.join("; ");
        all.extend(match (p.status, p.level()) {
            (PersonStatus::Failed, _) => Some(Finding::warning(
                "condition-failed",
                format!("there is no operator for {name}: {}", p.reason),
            )),
            (PersonStatus::Changes, _) => Some(Finding::note(
                "condition-changes",
                format!("{name} has no operator for the whole run: {}", p.reason),
            )),
            (_, Some(VerdictLevel::NotDetermined)) => Some(Finding::warning(
                "person-not-determined",
                format!("the operator of {name} is not determined: {reasons}"),
            )),
            (_, Some(VerdictLevel::Doubtful)) => Some(Finding::warning(
                "person-doubtful",
                format!("the operator of {name} is doubtful: {reasons}"),
            )),
            _ => None,
        });
    }
    let seen = |p: &&Person| p.channels.iter().any(|channel| channel.form.is_some());
    let of_several: Vec<String> = people.iter().filter(seen).map(Person::name).collect();
    if !of_several.is_empty() {
        all.push(Finding::note(
            "one-input-models",
            format!(
                "single-input models and recursions are omitted for {}: u also responds to other inputs",
                of_several.join(", ")
            ),
        ));
    }
    if other > 0 {
        all.push(Finding::note(
            "fits-failed",
            format!("other fits failed ({other}); estimates.parquet gives the reasons"),
        ));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn person(level: VerdictLevel) -> Person {
        Person {
            verdict: Some(Verdict::of(match level {
                VerdictLevel::Trustworthy => Vec::new(),
                VerdictLevel::Doubtful => vec![Finding::warning("slow", "it is so")],
                VerdictLevel::NotDetermined => vec![Finding::undetermined("singular", "it is so")],
            })),
            ..Person::without_operator(("P", "c"), PersonStatus::Fitted, "")
        }
    }

    fn group_verdict(runs: usize, failed: usize, people: &[Person]) -> Verdict {
        let failure = RunFailure {
            subject: "P".to_owned(),
            condition: "c".to_owned(),
            run: "1".to_owned(),
            reason: "no such file".to_owned(),
        };
        Verdict::of(findings(runs, &vec![failure; failed], people, 0))
    }

    #[test]
    fn group_verdict_combines_people_and_failures() {
        use VerdictLevel::{Doubtful, NotDetermined, Trustworthy};
        assert_eq!(group_verdict(2, 0, &[person(Trustworthy)]).level, Trustworthy);
        assert_eq!(group_verdict(2, 1, &[person(Trustworthy)]).level, Doubtful);
        assert_eq!(group_verdict(2, 2, &[]).level, NotDetermined);
        // If the operator of only one of two people is determined, the group is doubtful.
        let both = [person(Trustworthy), person(NotDetermined)];
        let verdict = group_verdict(2, 0, &both);
        assert_eq!(verdict.level, Doubtful);
        assert_eq!(verdict.findings()[0].kind, "person-not-determined");
        assert_eq!(group_verdict(2, 0, &both[1..]).level, NotDetermined);
        let failed = Person::without_operator(("Q", "d"), PersonStatus::Failed, "too short");
        assert_eq!(group_verdict(2, 0, std::slice::from_ref(&failed)).level, NotDetermined);
        let verdict = group_verdict(2, 0, &[failed, person(Trustworthy)]);
        assert_eq!(
            (verdict.level, verdict.findings()[0].kind),
            (Doubtful, "condition-failed")
        );
        // If the task changes in all conditions, the family is not fitted.
        let changes = Person::without_operator(("Q", "d"), PersonStatus::Changes, "at 40 s");
        assert_eq!(group_verdict(2, 0, &[changes]).level, Trustworthy);
    }
}
