//! Recordings before and during identification, with an account of their processing.

use hoid_ident::diagnostics::{machine_output_finding, recorded_element};
use hoid_io::{QualityIssue, Step, issues_of_channels};
use hoid_model::{Channel, ContinuousTransferFunction, Fault, Finding, Record, Verdict, uncertainty::Estimate};

use crate::reading::Source;

/// Kind of the note that the stick was at rest.
pub(crate) const RESTING_STICK: &str = "resting-stick";

/// Processing of a record, and the problems found in its file.
#[derive(Debug, Clone, Default)]
pub struct Account {
    /// Processing steps, in the order of application.
    pub steps: Vec<Step>,
    /// Problems of channels and of the time in the recorded data.
    pub quality_issues: Vec<QualityIssue>,
    /// Faults found by the fault search, and their treatment.
    pub faults: Vec<Fault>,
    /// Findings that concern all results of the recording.
    pub findings: Vec<Finding>,
    /// Constant level of u that was estimated with the fit.
    pub level: Option<Estimate>,
}

/// Records with their names and accounts, in the same order; a recording that is cut becomes several.
#[derive(Debug, Clone, Default)]
pub struct Recordings {
    /// Name of each record: its file, and its span if it is a segment of the recording.
    pub names: Vec<String>,
    /// The records.
    pub records: Vec<Record>,
    /// Processing of each record.
    pub accounts: Vec<Account>,
    /// For each record, index from 0 of the recording to which it belongs.
    pub origins: Vec<usize>,
    /// Files and options of the recordings, with which they can be read again in another way.
    pub(crate) source: Option<Source>,
}

impl Recordings {
    /// Creates recordings from records that were not read from files by this crate. They are named by their labels, or
    /// by their numbers if a label is empty, and their channels are checked for problems.
    pub fn from_records(records: impl IntoIterator<Item = Record>) -> Self {
        let mut all = Self::default();
        for record in records {
            let account = Account {
                quality_issues: issues_of_channels(&record),
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

    /// Adds a segment of a recording.
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

    /// True if there are no recordings.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// Returns the findings of all recordings, for the verdict on a result. A stick at rest is reported only once,
    /// since all recordings come from the same stick.
    pub fn findings(&self) -> Vec<Finding> {
        let several = self.names.len() > 1;
        let own = |account: &Account| account.findings.iter().filter(|f| f.kind == RESTING_STICK).count();
        let resting: usize = self.accounts.iter().map(own).sum();
        let mut is_noted = false;
        let mut all = Vec::new();
        for (name, account) in self.names.iter().zip(&self.accounts) {
            for finding in &account.findings {
                let of_stick = finding.kind == RESTING_STICK && resting > 1;
                if of_stick && std::mem::replace(&mut is_noted, true) {
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

    /// Returns warnings if the recorded signals are not those of the assumed loop: u is the output of the machine, the
    /// loop does not contain the given controlled element, or the display showed a channel that is not among the inputs
    /// of the model. `excitation` is the channel of a target or a disturbance; `inputs` are the inputs of the model
    /// other than the error.
    pub(crate) fn loop_findings(
        &self,
        element: Option<&ContinuousTransferFunction>,
        excitation: Option<&str>,
        inputs: &[&str],
    ) -> Vec<Finding> {
        let recorded = |given| recorded_element(&self.records, given, excitation)?.finding(given);
        let all = [
            machine_output_finding(&self.records),
            element.and_then(recorded),
            self.display_finding(inputs),
        ];
        all.into_iter().flatten().collect()
    }

    /// Returns a warning if the display showed a channel that is not an input of the model. `inputs` are the inputs of
    /// the model other than the error.
    fn display_finding(&self, inputs: &[&str]) -> Option<Finding> {
        let first = self.records.first()?;
        let own = [first.input_channel(), Some(first.output_channel())];
        let is_missing = |channel: &&Channel| {
            let used = own.into_iter().flatten().any(|signal| signal.name == channel.name);
            !(channel.role.is_empty() || used || inputs.contains(&channel.name.as_str()))
        };
        let all = self.records.iter().flat_map(Record::channels);
        let Channel { name, role, .. } = all.into_iter().find(is_missing)?;
        let error = first.input_channel().map_or("e", |error| error.name.as_str());
        let received = if role.starts_with("motion") {
            "the person felt"
        } else {
            "the display showed"
        };
        Some(Finding::warning(
            "displayed",
            format!(
                "{received} {name} ({role}), but the model lacks this input: the response to the error, the crossover \
                 and the margins do not describe the person; use hoid identify --input {error} --input {name} --role \
                 {name}={role}"
            ),
        ))
    }

    /// Adds the findings of the recordings to a verdict. They precede other findings, because faults of a recording may
    /// explain a wrong result.
    pub fn with_findings(&self, verdict: Verdict) -> Verdict {
        let more = self.findings();
        if more.is_empty() {
            verdict
        } else {
            verdict.prepend(more)
        }
    }
}
