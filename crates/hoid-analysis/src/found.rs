//! Findings in a recording in a common form: faults that were searched for, and problems of channels and of the time.
//! JSON and Python show this list.

use hoid_io::QualityIssue;
use hoid_model::Fault;
use serde::Serialize;

use crate::recordings::Account;

/// Something that was found in a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundFault {
    /// Name of its kind.
    pub kind: &'static str,
    /// The channel; empty for all channels and for the time.
    pub channel: String,
    /// Time of its first sample, s; `None` without a time.
    #[serde(rename = "from")]
    pub from_s: Option<f64>,
    /// Time of the sample after its last, s.
    #[serde(rename = "to")]
    pub to_s: Option<f64>,
    /// Number of samples.
    pub samples: usize,
    /// Size, in the unit of its kind.
    pub size: f64,
    /// Size in robust standard deviations, for kinds with a statistic.
    pub deviations: Option<f64>,
    /// The action taken.
    pub action: &'static str,
    /// Description: a sentence without a full stop.
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
    /// The fault spans the issue from its first occurrence to its last.
    fn from(issue: &QualityIssue) -> Self {
        Self {
            kind: issue.kind.name(),
            channel: issue.channel.clone(),
            from_s: issue.places.first().and_then(|place| place.from_s),
            to_s: issue.places.last().and_then(|place| place.to_s),
            samples: issue.rows,
            size: issue.size,
            deviations: None,
            action: "reported",
            words: issue.text.clone(),
        }
    }
}

impl Account {
    /// Returns everything that was found in the recording.
    pub fn found(&self) -> Vec<FoundFault> {
        let faults = self.faults.iter().map(FoundFault::from);
        faults.chain(self.quality_issues.iter().map(FoundFault::from)).collect()
    }
}
