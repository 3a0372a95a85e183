//! Findings on a recording in a common form: faults found by the fault search, and problems of channels and of the
//! time. JSON and Python present this list.

use hoid_io::QualityIssue;
use hoid_model::Fault;
use serde::Serialize;

use crate::recordings::Account;

/// A fault or a problem found in a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundFault {
    /// Name of the kind of fault.
    pub kind: &'static str,
    /// Name of the channel; empty if the fault concerns all channels or the time.
    pub channel: String,
    /// Time of the first sample of the fault (in s); `None` if the fault has no location in time.
    #[serde(rename = "from")]
    pub from_s: Option<f64>,
    /// Time of the first sample after the fault, s.
    #[serde(rename = "to")]
    pub to_s: Option<f64>,
    /// Number of samples.
    pub samples: usize,
    /// Size of the fault, in the unit that belongs to its kind.
    pub size: f64,
    /// Size in robust standard deviations, for kinds that have a test statistic.
    pub deviations: Option<f64>,
    /// Action taken on the fault.
    pub action: &'static str,
    /// Description as a sentence without a full stop.
    pub words: String,
}

impl From<&Fault> for FoundFault {
    fn from(fault: &Fault) -> Self {
        Self {
            kind: fault.kind.name(),
            channel: fault.channel.clone(),
            from_s: Some(fault.from_s),
            to_s: Some(fault.to_s),
            samples: fault.samples,
            size: fault.size,
            deviations: fault.deviations,
            action: fault.action.name(),
            words: fault.to_string(),
        }
    }
}

impl From<&QualityIssue> for FoundFault {
    /// Creates a fault that extends from the first to the last location of the issue.
    fn from(issue: &QualityIssue) -> Self {
        Self {
            kind: issue.kind.name(),
            channel: issue.channel.clone(),
            from_s: issue.row_spans.first().and_then(|place| place.from_s),
            to_s: issue.row_spans.last().and_then(|place| place.to_s),
            samples: issue.rows,
            size: issue.size,
            deviations: None,
            action: "reported",
            words: issue.text.clone(),
        }
    }
}

impl Account {
    /// Returns all faults and problems found in the recording.
    pub fn found_faults(&self) -> Vec<FoundFault> {
        let faults = self.faults.iter().map(FoundFault::from);
        faults.chain(self.quality_issues.iter().map(FoundFault::from)).collect()
    }
}
