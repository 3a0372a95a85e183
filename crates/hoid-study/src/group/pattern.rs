//! Patterns of file names: `{subject}_{condition}_{run}*.csv`.
//!
//! A name in braces matches one or more characters, as few as possible; `*` matches any number of characters; all other
//! characters match themselves.

use std::fmt;

use crate::StudyError;

/// A part of a pattern.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Part {
    Text(String),
    Name(String),
    Any,
}

/// A pattern of file names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern(Vec<Part>);

/// Values of the placeholders for a file name.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FileNameParts {
    /// Value of `{subject}`; empty if the pattern has no subject.
    pub subject: String,
    /// Value of `{condition}`; empty if the pattern has no condition.
    pub condition: String,
    /// Value of `{axis}`; empty if the pattern has no axis.
    pub axis: String,
    /// Value of `{run}`.
    pub run: String,
}

impl FileNameParts {
    /// Returns the condition with its axis, such as `C3-roll`. Each axis has its own controlled element and operator.
    pub fn condition_with_axis(&self) -> String {
        match (self.condition.as_str(), self.axis.as_str()) {
            (condition, "") => condition.to_owned(),
            ("", axis) => axis.to_owned(),
            (condition, axis) => format!("{condition}-{axis}"),
        }
    }
}

const NAMES: [&str; 4] = ["subject", "condition", "axis", "run"];

impl fmt::Display for Pattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|part| match part {
            Part::Text(text) => f.write_str(text),
            Part::Name(name) => write!(f, "{{{name}}}"),
            Part::Any => f.write_str("*"),
        })
    }
}

impl Pattern {
    /// Parses a pattern.
    ///
    /// # Errors
    /// [`StudyError::Pattern`] for unclosed braces, unknown or duplicate names, two names without a character between
    /// them, or a pattern without `{run}`.
    pub fn new(text: &str) -> Result<Self, StudyError> {
        let bad = |reason: String| StudyError::Pattern {
            pattern: text.to_owned(),
            reason,
        };
        let mut parts: Vec<Part> = Vec::new();
        let mut rest = text;
        while !rest.is_empty() {
            if let Some(after) = rest.strip_prefix('*') {
                parts.push(Part::Any);
                rest = after;
            } else if let Some(after) = rest.strip_prefix('{') {
                let (name, after) = after
                    .split_once('}')
                    .ok_or_else(|| bad("a brace is not closed".to_owned()))?;
                if !NAMES.contains(&name) {
                    return Err(bad(format!(
                        "{{{name}}} is not a name, expected {{subject}}, {{condition}}, {{axis}} or {{run}}"
                    )));
                }
                if parts.contains(&Part::Name(name.to_owned())) {
                    return Err(bad(format!("{{{name}}} is duplicated")));
                }
                if matches!(parts.last(), Some(Part::Name(_))) {
                    return Err(bad(format!("nothing separates {{{name}}} from the name before it")));
                }
                parts.push(Part::Name(name.to_owned()));
                rest = after;
            } else {
                let end = rest.find(['*', '{']).unwrap_or(rest.len());
                parts.push(Part::Text(rest[..end].to_owned()));
                rest = &rest[end..];
            }
        }
        if !parts.contains(&Part::Name("run".to_owned())) {
            return Err(bad("it has no {run}".to_owned()));
        }
        Ok(Self(parts))
    }

    /// Returns the values of the placeholders for a file name; `None` if the name does not match.
    pub fn matches(&self, name: &str) -> Option<FileNameParts> {
        let mut found = FileNameParts::default();
        match_parts(&self.0, name, &mut found).then_some(found)
    }
}

/// True if the text matches a pattern in which `*` is the only placeholder.
pub(super) fn matches_any(pattern: &str, text: &str) -> bool {
    let mut parts = Vec::new();
    for (i, fixed) in pattern.split('*').enumerate() {
        if i > 0 {
            parts.push(Part::Any);
        }
        parts.push(Part::Text(fixed.to_owned()));
    }
    match_parts(&parts, text, &mut FileNameParts::default())
}

fn match_parts(parts: &[Part], text: &str, found: &mut FileNameParts) -> bool {
    let Some((first, rest)) = parts.split_first() else {
        return text.is_empty();
    };
    if let Part::Text(expected) = first {
        return text
            .strip_prefix(expected.as_str())
            .is_some_and(|after| match_parts(rest, after, found));
    }
    let least = usize::from(*first != Part::Any);
    let ends = text.char_indices().map(|(i, _)| i).chain([text.len()]).skip(least);
    for end in ends {
        if match_parts(rest, &text[end..], found) {
            if let Part::Name(name) = first {
                let value = text[..end].to_owned();
                match name.as_str() {
                    "subject" => found.subject = value,
                    "condition" => found.condition = value,
                    "axis" => found.axis = value,
                    _ => found.run = value,
                }
            }
            return true;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn patterns_match_file_names() {
        let pattern = Pattern::new("{subject}_{condition}_{run}_d_only.csv").unwrap();
        let found = pattern.matches("P03_fo_11_d_only.csv").unwrap();
        assert_eq!(
            (found.subject.as_str(), found.condition.as_str(), found.run.as_str()),
            ("P03", "fo", "11")
        );
        assert_eq!(pattern.matches("P03_fo_11_r_only.csv"), None);
        let loose = Pattern::new("s{subject}-*run{run}.*").unwrap();
        let found = loose.matches("s7-C4-run12.mat").unwrap();
        assert_eq!((found.subject.as_str(), found.run.as_str()), ("7", "12"));
        assert_eq!(loose.matches("s-run1.csv"), None);
    }

    #[test]
    fn axis_is_appended_to_the_condition() {
        let of = |pattern: &str, name: &str| {
            let found = Pattern::new(pattern).unwrap().matches(name).unwrap();
            (found.condition_with_axis(), found.run)
        };
        let both = of("{subject}_{condition}_{axis}_{run}.csv", "A1_C3_roll_6.csv");
        assert_eq!(both, ("C3-roll".to_owned(), "6".to_owned()));
        assert_eq!(of("{subject}_{axis}_{run}.csv", "A1_roll_6.csv").0, "roll");
        assert_eq!(of("{subject}_{condition}_{run}.csv", "A1_C3_6.csv").0, "C3");
    }

    #[test]
    fn bad_patterns_are_refused() {
        for bad in [
            "{subject",
            "{name}_{run}",
            "{run}_{run}",
            "{subject}{run}",
            "{subject}.csv",
            "",
        ] {
            assert!(matches!(Pattern::new(bad), Err(StudyError::Pattern { .. })), "{bad}");
        }
    }
}
