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

use std::fmt;

/// Severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum Severity {
    /// The finding is information; the result remains valid.
    Note,
    /// The result may be wrong.
    Doubt,
    /// The data do not determine the requested quantity.
    Undetermined,
}

crate::named_choice!(Severity, "severity", 3, {
    Note => "note",
    Doubt => "doubt",
    Undetermined => "undetermined",
});

/// One observation about a result.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Finding {
    /// Kind of the observation, as a name for programs, such as `not-converged` or `delay-at-bound`.
    #[serde(deserialize_with = "crate::static_names::name")]
    pub kind: crate::static_names::Name,
    /// Severity of the observation.
    pub severity: Severity,
    /// Observation as a sentence with its numbers, without a full stop.
    #[serde(rename = "words")]
    pub message: String,
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
        }
    }
}

/// Reliability of a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum VerdictLevel {
    /// There is no evidence against the result.
    Trustworthy,
    /// There is evidence against the result; the findings describe it.
    Doubtful,
    /// The data do not determine the result.
    NotDetermined,
}

crate::named_choice!(VerdictLevel, "verdict", 3, {
    Trustworthy => "trustworthy",
    Doubtful => "doubtful",
    NotDetermined => "not determined",
});

/// Reliability of a result, with the findings that determine it, in descending order of severity.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Verdict {
    /// Level of the verdict.
    pub level: VerdictLevel,
    findings: Vec<Finding>,
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
        Self { level, findings }
    }

    /// Returns the verdict with further findings appended.
    pub fn append(self, more: impl IntoIterator<Item = Finding>) -> Self {
        Self::of(self.findings.into_iter().chain(more).collect())
    }

    /// Returns the verdict with further findings, which may be the cause of the present findings, inserted before them.
    pub fn prepend(self, first: impl IntoIterator<Item = Finding>) -> Self {
        Self::of(first.into_iter().chain(self.findings).collect())
    }

    /// Returns all findings in descending order of severity.
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// Returns the findings against the result, which are all findings except notes.
    pub fn reasons(&self) -> impl Iterator<Item = &str> {
        let weighs = |finding: &&Finding| finding.severity > Severity::Note;
        self.findings
            .iter()
            .filter(weighs)
            .map(|finding| finding.message.as_str())
    }

    /// Returns the notes.
    pub fn notes(&self) -> impl Iterator<Item = &str> {
        let light = |finding: &&Finding| finding.severity == Severity::Note;
        self.findings
            .iter()
            .filter(light)
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
