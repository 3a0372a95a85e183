//! Recordings on their way to an estimator, with the account of the processing of them.

use hoid_io::{QualityIssue, Step, quality_of_record};
use hoid_model::{Fault, Finding, Record, Verdict, uncertainty::Estimate};

use crate::reading::Source;

/// Kind of the note on a stick that rests.
pub(crate) const RESTING: &str = "resting-stick";

/// Processing applied to a record, and the problems of the sampling of its file.
#[derive(Debug, Clone, Default)]
pub struct Account {
    /// Processing applied to the numbers, in this order.
    pub steps: Vec<Step>,
    /// Problems with channels and their time as they were recorded.
    pub quality_issues: Vec<QualityIssue>,
    /// Faults that were searched for, and the actions taken about them.
    pub faults: Vec<Fault>,
    /// The report about any result.
    pub findings: Vec<Finding>,
    /// The constant of u that was estimated with the fit.
    pub level: Option<Estimate>,
}

/// Records with their names and accounts, in the same order; a file that is cut gives several.
#[derive(Debug, Clone, Default)]
pub struct Recordings {
    /// Name of each: its file, and the span where it is a part of it.
    pub names: Vec<String>,
    /// The records.
    pub records: Vec<Record>,
    /// Processing applied to each.
    pub accounts: Vec<Account>,
    /// Which of the recordings that were given each is a part of, counted from 0.
    pub origins: Vec<usize>,
    /// Where they are from, to read them another way.
    pub(crate) source: Option<Source>,
}

impl Recordings {
    /// Records that were not read from files here, called by their labels, else by their number. Problems with their
    /// channels is searched for in them.
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

    /// One more.
    pub fn push(&mut self, name: String, record: Record, account: Account) {
        let origin = self.origins.last().map_or(0, |last| last + 1);
        self.push_part(origin, name, record, account);
    }

    /// One more part of a recording.
    pub(crate) fn push_part(&mut self, origin: usize, name: String, record: Record, account: Account) {
        self.origins.push(origin);
        self.names.push(name);
        self.records.push(record);
        self.accounts.push(account);
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.records.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// Findings in all of them, for the verdict of a result of them. One person has one stick: that it rests is
    /// reported once.
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

    /// A verdict with what the recordings show: first, since a wrong recording is why a result is wrong.
    pub fn judged(&self, verdict: Verdict) -> Verdict {
        let more = self.findings();
        if more.is_empty() {
            verdict
        } else {
            verdict.prepend(more)
        }
    }
}
