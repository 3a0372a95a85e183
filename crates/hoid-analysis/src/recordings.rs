//! Recordings on their way to an estimator, with the account of their processing.

use hoid_ident::diagnostics::recorded_element;
use hoid_io::{QualityIssue, Step, quality_of_record};
use hoid_model::{Channel, ContinuousTransferFunction, Fault, Finding, Record, Verdict, uncertainty::Estimate};

use crate::reading::Source;

/// Kind of the note on a resting stick.
pub(crate) const RESTING: &str = "resting-stick";

/// Processing of a record, and the problems of the sampling of its file.
#[derive(Debug, Clone, Default)]
pub struct Account {
    /// Processing steps, in this order.
    pub steps: Vec<Step>,
    /// Problems of channels and of the time, as recorded.
    pub quality_issues: Vec<QualityIssue>,
    /// Faults that were searched for, and their treatment.
    pub faults: Vec<Fault>,
    /// Findings for any result.
    pub findings: Vec<Finding>,
    /// The constant of u that was estimated with the fit.
    pub level: Option<Estimate>,
}

/// Records with their names and accounts, in the same order; a file that is cut gives several.
#[derive(Debug, Clone, Default)]
pub struct Recordings {
    /// Name of each: its file, and the span if it is a part of it.
    pub names: Vec<String>,
    /// The records.
    pub records: Vec<Record>,
    /// Processing of each.
    pub accounts: Vec<Account>,
    /// Index of the original recording of which each is a part, from 0.
    pub origins: Vec<usize>,
    /// Their source, to read them in another way.
    pub(crate) source: Option<Source>,
}

impl Recordings {
    /// Makes recordings of records that were not read from files here, named by their labels, or else by their number.
    /// Problems of their channels are searched for.
    pub fn of_records(records: impl IntoIterator<Item = Record>) -> Self {
        let mut all = Self::default();
        for record in records {
            let account = Account {
                quality_issues: quality_of_record(&record),
                ..Account::default()
            };
            let name = match record.label() {
                "" => format!("record {}", all.len() + 1),
                label => label.to_owned(),
            };
            all.push(name, record, account);
        }
        all
    }

    /// Adds a recording.
    pub fn push(&mut self, name: String, record: Record, account: Account) {
        let origin = self.origins.last().map_or(0, |last| last + 1);
        self.push_part(origin, name, record, account);
    }

    /// Adds a part of a recording.
    pub(crate) fn push_part(&mut self, origin: usize, name: String, record: Record, account: Account) {
        self.origins.push(origin);
        self.names.push(name);
        self.records.push(record);
        self.accounts.push(account);
    }

    /// Returns the number of recordings.
    pub fn len(&self) -> usize {
        self.records.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// Returns the findings of all recordings, for the verdict on their result. A resting stick is reported once,
    /// since all recordings are of one stick.
    pub fn findings(&self) -> Vec<Finding> {
        let several = self.names.len() > 1;
        let own = |account: &Account| account.findings.iter().filter(|f| f.kind == RESTING).count();
        let resting: usize = self.accounts.iter().map(own).sum();
        let mut said = false;
        let mut all = Vec::new();
        for (name, account) in self.names.iter().zip(&self.accounts) {
            for finding in &account.findings {
                let of_stick = finding.kind == RESTING && resting > 1;
                if of_stick && std::mem::replace(&mut said, true) {
                    continue;
                }
                let message = match (several, of_stick) {
                    (true, true) => format!("{name} and {} more: {}", resting - 1, finding.message),
                    (true, false) => format!("{name}: {}", finding.message),
                    (false, _) => finding.message.clone(),
                };
                all.push(Finding {
                    message,
                    ..finding.clone()
                });
            }
        }
        all
    }

    /// Returns a doubt if the recorded loop does not have the given controlled element. `excitation` is the channel of
    /// a target or a disturbance.
    pub(crate) fn element_finding(
        &self,
        given: Option<&ContinuousTransferFunction>,
        excitation: Option<&str>,
    ) -> Option<Finding> {
        let given = given?;
        recorded_element(&self.records, given, excitation)?.finding(given)
    }

    /// Returns a doubt if the display showed a channel that is not an input of the model. `inputs` are the inputs besides
    /// the error.
    pub(crate) fn display_finding(&self, inputs: &[&str]) -> Option<Finding> {
        let first = self.records.first()?;
        let own = [first.input_channel(), Some(first.output_channel())];
        let is_missing = |channel: &&Channel| {
            let used = own.into_iter().flatten().any(|signal| signal.name == channel.name);
            !(channel.role.is_empty() || used || inputs.contains(&channel.name.as_str()))
        };
        let all = self.records.iter().flat_map(Record::channels);
        let Channel { name, role, .. } = all.into_iter().find(is_missing)?;
        let error = first.input_channel().map_or("e", |error| error.name.as_str());
        Some(Finding::doubt(
            "displayed",
            format!(
                "the display showed {name} ({role}), and the model does not have it as an input: the response to the \
                 error, crossover and margins are not those of the person; use hoid identify --input {error} --input \
                 {name} --role {name}={role}"
            ),
        ))
    }

    /// Adds the findings of the recordings to a verdict: first, since a faulty recording explains a wrong result.
    pub fn judged(&self, verdict: Verdict) -> Verdict {
        let more = self.findings();
        if more.is_empty() {
            verdict
        } else {
            verdict.prepend(more)
        }
    }
}
