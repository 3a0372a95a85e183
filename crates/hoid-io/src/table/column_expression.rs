//! Selection of the input and the output by an expression: `NAME`, `-NAME` or `NAME-NAME`.
//!
//! Laboratories often record the target r and the output y of the controlled element instead of the tracking error
//! `e = r - y`, or use the opposite sign of the control. A column whose name equals the whole text takes precedence, so
//! a name may contain a hyphen.

use std::fmt;
use std::str::FromStr;

use super::column_option::ColumnOption;
use crate::IoError;
use crate::wording::{did_you_mean, list_names};

/// A column, its negative, or the difference of two columns. The expression is kept as text until the columns of a file
/// are known.
///
/// ```
/// let error: hoid_io::ColumnExpression = "r-y".parse()?;
/// assert_eq!(error.to_string(), "r-y");
/// # Ok::<(), hoid_io::IoError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnExpression {
    text: String,
}

/// An expression resolved to the columns of one file, which are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Signal {
    Column(usize),
    Negative(usize),
    Difference(usize, usize),
}

impl Signal {
    /// Returns the indices of the columns in the expression.
    pub(crate) fn columns(self) -> impl Iterator<Item = usize> {
        let (a, b) = match self {
            Self::Column(a) | Self::Negative(a) => (a, None),
            Self::Difference(a, b) => (a, Some(b)),
        };
        std::iter::once(a).chain(b)
    }
}

impl ColumnExpression {
    /// Selects the column with this name.
    pub fn column(name: impl Into<String>) -> Self {
        Self { text: name.into() }
    }

    /// Returns all parts of the text that may be a column name.
    pub(crate) fn terms(&self) -> Vec<&str> {
        let mut terms = vec![self.text.as_str()];
        terms.extend(self.text.strip_prefix('-'));
        terms.extend(self.splits().flat_map(|(left, right)| [left, right]));
        terms.iter_mut().for_each(|term| *term = term.trim());
        terms.retain(|term| !term.is_empty());
        terms
    }

    /// Returns the parts before and after each hyphen in the text.
    fn splits(&self) -> impl Iterator<Item = (&str, &str)> {
        let hyphens = self.text.match_indices('-');
        hyphens.filter_map(|(at, hyphen)| {
            let (left, rest) = self.text.split_at_checked(at)?;
            Some((left, rest.strip_prefix(hyphen)?))
        })
    }

    /// True if the expression is valid for columns with these names.
    #[must_use]
    pub fn is_among(&self, names: &[&str]) -> bool {
        self.resolve(names, "").is_ok()
    }

    /// Returns the sign of each column in the expression and its index in `names`.
    ///
    /// # Errors
    /// [`IoError`] if the expression is not valid for these columns; `file` is the file from which they were read.
    pub fn signed_columns(&self, names: &[&str], file: &str) -> Result<Vec<(f64, usize)>, IoError> {
        Ok(match self.resolve(names, file)? {
            Signal::Column(one) => vec![(1.0, one)],
            Signal::Negative(one) => vec![(-1.0, one)],
            Signal::Difference(one, other) => vec![(1.0, one), (-1.0, other)],
        })
    }

    /// Resolves the expression to indices of columns in `names`.
    pub(crate) fn resolve(&self, names: &[&str], file: &str) -> Result<Signal, IoError> {
        let find = |name: &str| {
            let name = name.trim();
            names.iter().position(|known| !known.is_empty() && *known == name)
        };
        if let Some(column) = find(&self.text) {
            return Ok(Signal::Column(column));
        }
        let mut meanings = Vec::new();
        if let Some(name) = self.text.strip_prefix('-') {
            meanings.extend(find(name).map(Signal::Negative));
        }
        let splits: Vec<(&str, &str)> = self
            .splits()
            .filter(|(left, right)| !left.trim().is_empty() && !right.trim().is_empty())
            .collect();
        for (left, right) in &splits {
            if let (Some(left), Some(right)) = (find(left), find(right)) {
                meanings.push(Signal::Difference(left, right));
            }
        }
        match (meanings.as_slice(), splits.as_slice()) {
            ([one], _) => Ok(*one),
            ([], splits) => {
                // If the text contains a single hyphen, the message quotes only the names that do not exist; otherwise
                // it quotes the whole text.
                let parts = match splits {
                    [(left, right)] => vec![*left, *right],
                    _ => vec![self.text.strip_prefix('-').unwrap_or(&self.text)],
                };
                let unknown: Vec<&str> = parts.into_iter().filter(|part| find(part).is_none()).collect();
                let missing: Vec<String> = unknown.iter().map(|part| format!("\"{}\"", part.trim())).collect();
                Err(IoError::NoSuchColumn {
                    file: file.to_owned(),
                    missing: missing.join(" and no "),
                    suggestion: did_you_mean(&unknown, names).into_boxed_str(),
                    requested: self.text.clone(),
                    available: list_names(names),
                    option: ColumnOption::Signals,
                })
            }
            _ => Err(IoError::Expression {
                found: self.text.clone(),
                expected: format!(
                    "it matches more than one difference of columns of {file}; rename a column so that no name contains a hyphen"
                ),
            }),
        }
    }
}

impl FromStr for ColumnExpression {
    type Err = IoError;

    /// # Errors
    /// [`IoError::Expression`] if the text contains no name.
    fn from_str(text: &str) -> Result<Self, IoError> {
        let trimmed = text.trim();
        if trimmed.trim_matches(|c: char| c == '-' || c.is_whitespace()).is_empty() {
            return Err(IoError::Expression {
                found: text.to_owned(),
                expected: String::from("expected a column name, -NAME, or a difference NAME-NAME such as r-y"),
            });
        }
        Ok(Self {
            text: trimmed.to_owned(),
        })
    }
}

impl fmt::Display for ColumnExpression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 6] = ["t", "r", "y", "stick-x", "", "r-d"];

    fn resolve(text: &str) -> Result<Signal, IoError> {
        text.parse::<ColumnExpression>()?.resolve(&NAMES, "run.csv")
    }

    #[test]
    fn names_negatives_and_differences_are_resolved() {
        let signed = |text: &str| {
            text.parse::<ColumnExpression>()
                .unwrap()
                .signed_columns(&NAMES, "run.csv")
        };
        assert_eq!(signed("r-y").unwrap(), vec![(1.0, 1), (-1.0, 2)]);
        assert_eq!(signed("-y").unwrap(), vec![(-1.0, 2)]);
        assert!(signed("q-y").is_err());
        assert_eq!(resolve("y").unwrap(), Signal::Column(2));
        assert_eq!(resolve(" -y ").unwrap(), Signal::Negative(2));
        assert_eq!(resolve("- y").unwrap(), Signal::Negative(2));
        assert_eq!(resolve("r-y").unwrap(), Signal::Difference(1, 2));
        assert_eq!(resolve("r - y").unwrap(), Signal::Difference(1, 2));
    }

    #[test]
    fn hyphenated_names_take_precedence_over_differences() {
        assert_eq!(resolve("stick-x").unwrap(), Signal::Column(3));
        assert_eq!(resolve("-stick-x").unwrap(), Signal::Negative(3));
        assert_eq!(resolve("stick-x-y").unwrap(), Signal::Difference(3, 2));
        assert_eq!(resolve("y - stick-x").unwrap(), Signal::Difference(2, 3));
        // The text `r-d` is the name of a column, which takes precedence over a difference; there is no column d.
        assert_eq!(resolve("r-d").unwrap(), Signal::Column(5));
    }

    #[test]
    fn missing_columns_are_named() {
        let message = |text| resolve(text).unwrap_err().to_string();
        assert!(message("q").contains("no column \"q\" (requested: q); it has t, r, y, stick-x, r-d"));
        assert!(message("r-q").contains("no column \"q\" (requested: r-q)"));
        assert!(message("p-q").contains("no column \"p\" and no \"q\""));
        assert!(message("-q").contains("no column \"q\" (requested: -q)"));
        for empty in ["", "  ", "-", " - - "] {
            assert!(matches!(resolve(empty), Err(IoError::Expression { .. })), "{empty:?}");
        }
    }

    #[test]
    fn ambiguous_expressions_are_refused() {
        let names = ["a", "a-b", "c", "b-c"];
        let expression = ColumnExpression::column("a-b-c");
        assert!(matches!(
            expression.resolve(&names, "run.csv"),
            Err(IoError::Expression { .. })
        ));
    }

    #[test]
    fn long_lists_are_truncated() {
        let names: Vec<String> = (0..45).map(|k| format!("x{k}")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        assert!(list_names(&names).ends_with("x39 and 5 more"));
        assert_eq!(list_names(&["", ""]), "no named columns");
    }
}
