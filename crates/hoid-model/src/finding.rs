//! Findings that make a result doubtful, as text and in a form for programs.
//!
//! A [`Finding`] is one observation about a result: how a search ended, a parameter at its bound,
//! methods that do not agree, a quantity that the data do not determine. It has a kind (a name that
//! does not change), a severity and a sentence for the user. The [`Verdict`] follows from the
//! findings alone: the gravest severity decides.
//!
//! | gravest severity | level |
//! |---|---|
//! | none, or [`Severity::Note`] | trustworthy |
//! | [`Severity::Doubt`] | doubtful |
//! | [`Severity::Undetermined`] | not determined |
//!
//! Code that judges something new adds findings; no other code decides what they amount to.

use std::fmt;

/// How much a finding weighs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum Severity {
    /// Worth knowing; the result remains valid.
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
    /// The observation, as a name for programs: `not-converged`, `delay-at-bound`.
    #[serde(deserialize_with = "crate::interned::name")]
    pub kind: crate::interned::Name,
    /// How much it weighs.
    pub severity: Severity,
    /// The observation in a sentence, with its numbers, without a full stop.
    #[serde(rename = "words")]
    pub message: String,
}

impl Finding {
    /// A finding that the result is in spite of.
    pub fn note(kind: &'static str, message: impl Into<String>) -> Self {
        Self::new(kind, Severity::Note, message)
    }

    /// A finding that makes the result doubtful.
    pub fn doubt(kind: &'static str, message: impl Into<String>) -> Self {
        Self::new(kind, Severity::Doubt, message)
    }

    /// A finding that leaves the question open.
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
    /// Nothing speaks against it.
    Trustworthy,
    /// Something does; the reasons report what.
    Doubtful,
    /// The data do not determine it.
    NotDetermined,
}

crate::named_choice!(VerdictLevel, "verdict", 3, {
    Trustworthy => "trustworthy",
    Doubtful => "doubtful",
    NotDetermined => "not determined",
});

/// The level, and the findings it rests on, the gravest first.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Verdict {
    /// Verdict on the result.
    pub level: VerdictLevel,
    findings: Vec<Finding>,
}

impl Verdict {
    /// The verdict of these findings; those of one severity keep their order.
    pub fn of(mut findings: Vec<Finding>) -> Self {
        findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
        let level = match findings.first().map(|finding| finding.severity) {
            None | Some(Severity::Note) => VerdictLevel::Trustworthy,
            Some(Severity::Doubt) => VerdictLevel::Doubtful,
            Some(Severity::Undetermined) => VerdictLevel::NotDetermined,
        };
        Self { level, findings }
    }

    /// The verdict of these findings and more.
    pub fn append(self, more: impl IntoIterator<Item = Finding>) -> Self {
        Self::of(self.findings.into_iter().chain(more).collect())
    }

    /// The verdict of these findings behind others, from which they may follow.
    pub fn prepend(self, first: impl IntoIterator<Item = Finding>) -> Self {
        Self::of(first.into_iter().chain(self.findings).collect())
    }

    /// All findings, the gravest first.
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }

    /// Findings against the result: the findings that are more than notes.
    pub fn reasons(&self) -> impl Iterator<Item = &str> {
        let weighs = |finding: &&Finding| finding.severity > Severity::Note;
        self.findings
            .iter()
            .filter(weighs)
            .map(|finding| finding.message.as_str())
    }

    /// Additional notes.
    pub fn notes(&self) -> impl Iterator<Item = &str> {
        let light = |finding: &&Finding| finding.severity == Severity::Note;
        self.findings
            .iter()
            .filter(light)
            .map(|finding| finding.message.as_str())
    }
}

impl fmt::Display for Verdict {
    /// The level on the first line, then a line for each finding.
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
    fn the_gravest_finding_decides() {
        let note = Finding::note("prior", "omega_nm is the prior alone");
        let doubt = Finding::doubt("not-converged", "the search did not converge");
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
        let second = Finding::doubt("second", "what follows from it");
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
