//! Findings about a result, as text and in a form for programs.
//!
//! A [`Finding`] is one observation about a result: the termination of a search, a parameter at its bound, methods that
//! do not agree, a quantity that the data do not determine. It has a kind (a name that does not change between
//! versions), a severity and a sentence for the user. The [`Verdict`] depends only on the findings: the highest
//! severity determines its level.
//!
//! | highest severity | level |
//! |---|---|
//! | none, or [`Severity::Note`] | trustworthy |
//! | [`Severity::Doubt`] | doubtful |
//! | [`Severity::Undetermined`] | not determined |
//!
//! A new test affects the verdict only through the findings that it adds.
//!
//! A result has several answers, such as the response or a parameter. The verdict contains the [`AnswerVerdict`] of
//! each: a finding about the whole result affects all answers; in addition, each answer has its own findings.

use std::{collections::BTreeMap, fmt};

mod written;

/// Severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
// The aliases are the names in earlier files.
pub enum Severity {
    /// The finding is information; the result remains valid.
    #[serde(alias = "Note")]
    Note,
    /// The result may be wrong.
    #[serde(alias = "Doubt")]
    Doubt,
    /// The data do not determine the requested quantity.
    #[serde(alias = "Undetermined")]
    Undetermined,
}

crate::named_choice!(Severity, "severity", 3, {
    Note => "note",
    Doubt => "doubt",
    Undetermined => "undetermined",
});

/// One observation about a result.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(from = "written::WrittenFinding")]
pub struct Finding {
    /// Kind of the observation, as a name for programs, such as `not-converged` or `delay-at-bound`.
    pub kind: crate::static_names::Name,
    /// Severity of the observation.
    pub severity: Severity,
    /// Observation as a sentence with its numbers, without a full stop.
    pub message: String,
    /// Start of the span of the record to which the observation refers, s; `None` if it refers to no span.
    #[serde(rename = "from")]
    pub from_s: Option<f64>,
    /// End of this span, s.
    #[serde(rename = "to")]
    pub to_s: Option<f64>,
}

impl Finding {
    /// Returns a finding that does not affect the validity of the result.
    pub fn note(kind: &'static str, message: impl Into<String>) -> Self {
        Self::new(kind, Severity::Note, message)
    }

    /// Returns a finding that makes the result doubtful.
    pub fn warning(kind: &'static str, message: impl Into<String>) -> Self {
        Self::new(kind, Severity::Doubt, message)
    }

    /// Returns a finding which states that the data do not determine the result.
    pub fn undetermined(kind: &'static str, message: impl Into<String>) -> Self {
        Self::new(kind, Severity::Undetermined, message)
    }

    fn new(kind: &'static str, severity: Severity, message: impl Into<String>) -> Self {
        Self {
            kind,
            severity,
            message: message.into(),
            from_s: None,
            to_s: None,
        }
    }

    /// Returns the finding with the span of the record to which it refers, in s.
    #[must_use]
    pub fn over(self, from_s: f64, to_s: f64) -> Self {
        Self {
            from_s: Some(from_s),
            to_s: Some(to_s),
            ..self
        }
    }

    /// Returns the finding with the span from the start of the first to the end of the last of these spans, in s.
    #[must_use]
    pub fn over_spans(self, spans: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let hull = |(low, high): (f64, f64), (from, to): (f64, f64)| (low.min(from), high.max(to));
        match spans.into_iter().reduce(hull) {
            Some((from_s, to_s)) => self.over(from_s, to_s),
            None => self,
        }
    }

    /// True if the finding is against the result, i.e. not a note.
    pub fn is_reason(&self) -> bool {
        self.severity > Severity::Note
    }
}

/// Reliability of a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum VerdictLevel {
    /// There is no evidence against the result.
    #[serde(rename = "trustworthy", alias = "Trustworthy")]
    Trustworthy,
    /// There is evidence against the result; the findings describe it.
    #[serde(rename = "doubtful", alias = "Doubtful")]
    Doubtful,
    /// The data do not determine the result.
    #[serde(rename = "not determined", alias = "NotDetermined")]
    NotDetermined,
}

crate::named_choice!(VerdictLevel, "verdict", 3, {
    Trustworthy => "trustworthy",
    Doubtful => "doubtful",
    NotDetermined => "not determined",
});

/// Reliability of one answer of a result.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct AnswerVerdict {
    /// Level of the answer.
    pub level: VerdictLevel,
    /// Findings against the answer, in descending order of severity.
    pub reasons: Vec<Finding>,
}

impl AnswerVerdict {
    /// Returns the verdict that follows from the findings; notes are omitted.
    pub fn of(findings: impl IntoIterator<Item = Finding>) -> Self {
        let reasons = findings.into_iter().filter(Finding::is_reason).collect();
        let Verdict { level, findings, .. } = Verdict::of(reasons);
        Self {
            level,
            reasons: findings,
        }
    }
}

/// Reliability of a result, with the findings that determine it, in descending order of severity.
///
/// Its serialised form is the `verdict` in the JSON of results: level, reasons, notes, and the verdict on each answer.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(into = "written::WrittenVerdict", from = "written::WrittenVerdict")]
pub struct Verdict {
    /// Level of the verdict.
    pub level: VerdictLevel,
    findings: Vec<Finding>,
    /// Verdict on each answer, with the name of the answer as key; empty for a result without separate answers.
    pub answers: BTreeMap<String, AnswerVerdict>,
}

impl Verdict {
    /// Returns the verdict that follows from the findings; findings of equal severity keep their order.
    pub fn of(mut findings: Vec<Finding>) -> Self {
        findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
        let level = match findings.first().map(|finding| finding.severity) {
            None | Some(Severity::Note) => VerdictLevel::Trustworthy,
            Some(Severity::Doubt) => VerdictLevel::Doubtful,
            Some(Severity::Undetermined) => VerdictLevel::NotDetermined,
        };
        Self {
            level,
            findings,
            answers: BTreeMap::new(),
        }
    }

    /// Returns the verdict with a verdict on each answer.
    #[must_use]
    pub fn with_answers(self, answers: impl IntoIterator<Item = (String, AnswerVerdict)>) -> Self {
        Self {
            answers: answers.into_iter().collect(),
            ..self
        }
    }

    /// Returns the verdict with further findings appended; they affect each answer.
    pub fn append(self, more: impl IntoIterator<Item = Finding>) -> Self {
        let more: Vec<Finding> = more.into_iter().collect();
        let with = |answer: AnswerVerdict| AnswerVerdict::of(answer.reasons.into_iter().chain(more.iter().cloned()));
        let answers = self.answers.into_iter().map(|(name, answer)| (name, with(answer)));
        let answers = answers.collect();
        Self {
            answers,
            ..Self::of(self.findings.into_iter().chain(more).collect())
        }
    }

    /// Returns the verdict with further findings, which may be the cause of the present findings, inserted before them.
    /// Verdicts on answers are not changed.
    pub fn prepend(self, first: impl IntoIterator<Item = Finding>) -> Self {
        Self {
            answers: self.answers,
            ..Self::of(first.into_iter().chain(self.findings).collect())
        }
    }

    /// Returns the verdict with other messages, such as messages for another interface.
    #[must_use]
    pub fn map_messages(mut self, message: impl Fn(&str) -> String) -> Self {
        let of_answers = self.answers.values_mut().flat_map(|answer| &mut answer.reasons);
        for finding in self.findings.iter_mut().chain(of_answers) {
            finding.message = message(&finding.message);
        }
        self
    }

    /// Returns all findings in descending order of severity.
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// Returns the findings against the result, which are all findings except notes.
    pub fn reasons(&self) -> impl Iterator<Item = &str> {
        self.findings
            .iter()
            .filter(|finding| finding.is_reason())
            .map(|finding| finding.message.as_str())
    }

    /// Returns the notes.
    pub fn notes(&self) -> impl Iterator<Item = &str> {
        self.findings
            .iter()
            .filter(|finding| !finding.is_reason())
            .map(|finding| finding.message.as_str())
    }
}

impl fmt::Display for Verdict {
    /// Formats the verdict: the level on the first line, followed by a line for each finding.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Verdict: {}", self.level)?;
        for reason in self.reasons() {
            write!(f, "\n- {reason}")?;
        }
        for note in self.notes() {
            write!(f, "\n  (note: {note})")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worst_finding_sets_the_level() {
        let note = Finding::note("prior", "omega_nm is the prior alone");
        let doubt = Finding::warning("not-converged", "the search did not converge");
        let open = Finding::undetermined("lag", "T_I is not determined");
        assert_eq!(Verdict::of(Vec::new()).level, VerdictLevel::Trustworthy);
        assert_eq!(Verdict::of(vec![note.clone()]).level, VerdictLevel::Trustworthy);
        let doubtful = Verdict::of(vec![note.clone(), doubt.clone()]);
        assert_eq!(doubtful.level, VerdictLevel::Doubtful);
        assert_eq!(doubtful.reasons().collect::<Vec<_>>(), ["the search did not converge"]);
        let all = Verdict::of(vec![note.clone(), doubt.clone(), open.clone()]);
        assert_eq!(
            Verdict::of(vec![note.clone()]).append([doubt.clone(), open.clone()]),
            all
        );
        let second = Finding::warning("second", "what follows from it");
        let led = Verdict::of(vec![note, second.clone()]).prepend([doubt.clone()]);
        assert_eq!(led.findings()[..2], [doubt, second]);
        assert_eq!(all.level, VerdictLevel::NotDetermined);
        assert_eq!(
            all.to_string(),
            "Verdict: not determined\n- T_I is not determined\n- the search did not converge\n  (note: omega_nm is the \
             prior alone)"
        );
    }
}
