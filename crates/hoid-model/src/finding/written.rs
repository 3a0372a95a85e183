//! Serialised form of a verdict: `{"level", "reasons", "notes", "of": {"response": {"level", "reasons"}, ...}}`, where
//! each reason and each note is `{"kind", "severity", "message", "from", "to"}`.
//!
//! Files of earlier versions are readable: there, reasons are sentences, `findings` contains all findings with their
//! kinds, and the message is called `words`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{AnswerVerdict, Finding, Severity, Verdict, VerdictLevel};
use crate::static_names::{self, Name};

/// Serialised form of a verdict.
#[derive(Serialize, Deserialize)]
pub(super) struct WrittenVerdict {
    level: VerdictLevel,
    #[serde(default)]
    reasons: Vec<Finding>,
    #[serde(default)]
    notes: Vec<Finding>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    of: BTreeMap<String, AnswerVerdict>,
    #[serde(default, skip_serializing)]
    findings: Vec<Finding>,
}

impl From<Verdict> for WrittenVerdict {
    fn from(verdict: Verdict) -> Self {
        let (reasons, notes) = verdict.findings.into_iter().partition(Finding::is_reason);
        Self {
            level: verdict.level,
            reasons,
            notes,
            of: verdict.answers,
            findings: Vec::new(),
        }
    }
}

impl From<WrittenVerdict> for Verdict {
    fn from(written: WrittenVerdict) -> Self {
        let of_level = match written.level {
            VerdictLevel::NotDetermined => Severity::Undetermined,
            _ => Severity::Doubt,
        };
        // A sentence from an earlier version has no kind; its severity follows from its place.
        let with = |severity: Severity| {
            move |one: Finding| Finding {
                severity: if one.kind.is_empty() { severity } else { one.severity },
                ..one
            }
        };
        let findings = if written.findings.is_empty() {
            let reasons = written.reasons.into_iter().map(with(of_level));
            reasons
                .chain(written.notes.into_iter().map(with(Severity::Note)))
                .collect()
        } else {
            written.findings
        };
        Self {
            level: written.level,
            answers: written.of,
            ..Self::of(findings)
        }
    }
}

/// A finding, or its sentence in a file of an earlier version.
#[derive(Deserialize)]
#[serde(untagged)]
pub(super) enum WrittenFinding {
    Sentence(String),
    Finding {
        #[serde(deserialize_with = "static_names::name")]
        kind: Name,
        severity: Severity,
        #[serde(default)]
        message: String,
        words: Option<String>,
        from: Option<f64>,
        to: Option<f64>,
    },
}

impl From<WrittenFinding> for Finding {
    fn from(written: WrittenFinding) -> Self {
        match written {
            WrittenFinding::Sentence(message) => Self::new("", Severity::Doubt, message),
            WrittenFinding::Finding {
                kind,
                severity,
                message,
                words,
                from,
                to,
            } => Self {
                kind,
                severity,
                message: words.unwrap_or(message),
                from_s: from,
                to_s: to,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn earlier_files_are_read() {
        let now = r#"{"level":"doubtful","reasons":[{"kind":"stretch","severity":"doubt","message":"it depends","from":2.0,"to":4.0}],"notes":[{"kind":"prior","severity":"note","message":"zeta_nm","from":null,"to":null}],"of":{"tau_e":{"level":"doubtful","reasons":[]}}}"#;
        let read = |text: &str| serde_json::from_str::<Verdict>(text).unwrap();
        let verdict = read(now);
        assert_eq!(serde_json::to_string(&verdict).unwrap(), now);
        assert_eq!(
            verdict.findings()[0],
            Finding::warning("stretch", "it depends").over(2.0, 4.0)
        );
        // With all findings next to the sentences, and in a saved state, which had only the findings.
        for (level, severities, reasons) in [
            (
                "doubtful",
                ["doubt", "note"],
                r#""reasons": ["it depends"], "notes": ["zeta_nm"], "#,
            ),
            ("Doubtful", ["Doubt", "Note"], ""),
        ] {
            let earlier = format!(
                r#"{{"level": "{level}", {reasons}"findings": [
                    {{"kind": "stretch", "severity": "{}", "message": "it depends", "words": "it depends"}},
                    {{"kind": "prior", "severity": "{}", "words": "zeta_nm"}}]}}"#,
                severities[0], severities[1]
            );
            let found: Vec<Finding> = verdict
                .findings()
                .iter()
                .map(|f| Finding {
                    from_s: None,
                    to_s: None,
                    ..f.clone()
                })
                .collect();
            assert_eq!(read(&earlier).findings(), found);
        }
        let bare = read(r#"{"level": "not determined", "reasons": ["too short"], "notes": ["no lines"]}"#);
        assert_eq!(bare.level, VerdictLevel::NotDetermined);
        assert_eq!(
            bare.findings(),
            [Finding::undetermined("", "too short"), Finding::note("", "no lines")]
        );
    }
}
