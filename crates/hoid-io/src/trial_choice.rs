//! Which trials of a file are asked for: `COLUMN`, or `COLUMN=VALUE`.

use std::fmt;
use std::str::FromStr;

use crate::IoError;

/// Which trials of a file are read: `COLUMN` for each value of a column (`t`: where the time starts
/// again), `COLUMN=VALUE` for one.
///
/// ```
/// let trial: hoid_io::TrialChoice = "trial=3".parse()?;
/// assert_eq!(trial.to_string(), "trial=3");
/// # Ok::<(), hoid_io::IoError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TrialChoice {
    pub(crate) column: String,
    pub(crate) value: Option<String>,
}

impl TrialChoice {
    /// One trial.
    pub(crate) fn one(column: &str, value: &str) -> Self {
        Self {
            column: column.to_owned(),
            value: Some(value.to_owned()),
        }
    }

    /// Whether it names one trial.
    pub(crate) fn is_one(&self) -> bool {
        self.value.is_some()
    }
}

impl FromStr for TrialChoice {
    type Err = IoError;

    /// # Errors
    /// [`IoError::Expression`] where no column or no value is named.
    fn from_str(text: &str) -> Result<Self, IoError> {
        let (column, value) = match text.rsplit_once('=') {
            Some((column, value)) => (column.trim(), Some(value.trim().to_owned())),
            None => (text.trim(), None),
        };
        if column.is_empty() || value.as_ref().is_some_and(String::is_empty) {
            return Err(IoError::Expression {
                found: text.to_owned(),
                expected: String::from("expected the column that counts the trials, or one of them as trial=3"),
            });
        }
        Ok(Self {
            column: column.to_owned(),
            value,
        })
    }
}

impl fmt::Display for TrialChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.value {
            Some(value) => write!(f, "{}={value}", self.column),
            None => f.write_str(&self.column),
        }
    }
}
