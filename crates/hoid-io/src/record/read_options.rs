//! How to read a record: which columns are input and output, which trials, the sampling, and what may
//! be repaired.

use std::fmt;
use std::str::FromStr;

use crate::IoError;
use crate::table::ColumnExpression;
use crate::time::TimeChoice;

/// Repairs of a damaged record. Default: none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Repair {
    /// Interpolate linearly from an uneven t, also over gaps, to an even grid. The grid starts at
    /// the first t; its sample time is that of the typical step, or of
    /// [`ReadOptions::sampling_hz`].
    pub resample: bool,
    /// Bridge missing values (empty, NaN, NA) linearly between the values before and after.
    pub fill: bool,
}

/// How to read a record.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadOptions {
    /// Input of the person; `e` by default. `None` reads an output alone, for the structures
    /// without input.
    pub input: Option<ColumnExpression>,
    /// Output of the person; `u` by default.
    pub output: ColumnExpression,
    /// The column of the time and its unit; by default it is found by names and types.
    pub time: Option<TimeChoice>,
    /// Which trials of the file are read; by default they are known by a t that starts again. A record
    /// is one of them, [`read_segments`](crate::read_segments) gives all.
    pub trial: Option<TrialChoice>,
    /// Sampling frequency in Hz. It wins over the column t, which then gives only the time of the
    /// first sample (0 when there is none); with [`Repair::resample`] it is the frequency of the
    /// new grid. By default the sampling is that of t.
    pub sampling_hz: Option<f64>,
    /// The samples with `from <= t < to`, s; anything outside is not used. By default all.
    pub span_s: (Option<f64>, Option<f64>),
    /// Permitted repairs.
    pub repair: Repair,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            input: Some(ColumnExpression::column("e")),
            output: ColumnExpression::column("u"),
            time: None,
            trial: None,
            sampling_hz: None,
            span_s: (None, None),
            repair: Repair::default(),
        }
    }
}

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
    pub(super) column: String,
    pub(super) value: Option<String>,
}

impl TrialChoice {
    /// One trial.
    pub(super) fn one(column: &str, value: &str) -> Self {
        Self {
            column: column.to_owned(),
            value: Some(value.to_owned()),
        }
    }

    /// Whether it names one trial.
    pub(super) fn is_one(&self) -> bool {
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
