//! Options for reading a record: the columns of the input and the output, trials, sampling, and permitted repairs.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use crate::IoError;
use crate::table::ColumnExpression;
use crate::time::TimeChoice;

/// Repairs of a damaged record. Default: none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Repair {
    /// Interpolate linearly from an unevenly spaced t, also over gaps, onto an evenly spaced grid. The grid starts at
    /// the first t; its sample time is the typical step, or follows from [`ReadOptions::sampling_hz`].
    pub resample: bool,
    /// Interpolate missing values (empty, NaN, NA) linearly between the values before and after.
    pub fill: bool,
}

/// Treatment of a column that has no value in some rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SparseTreatment {
    /// The last value is held until the next value.
    Hold,
    /// Values are interpolated linearly.
    Linear,
    /// Rows without a value are dropped.
    Drop,
}

hoid_model::named_choice!(SparseTreatment, "handling of a sparse column", 3, {
    Hold => "hold",
    Linear => "linear",
    Drop => "drop",
});

/// Options for reading a record.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadOptions {
    /// Input of the operator; `e` by default. `None` reads only an output, for structures without input.
    pub input: Option<ColumnExpression>,
    /// Output of the operator; `u` by default.
    pub output: ColumnExpression,
    /// Time column and its unit; by default both are determined from names and types.
    pub time: Option<TimeChoice>,
    /// Trials to read; by default trials are recognised by a t that restarts. A record holds one trial;
    /// [`read_segments`](crate::read_segments) returns all trials.
    pub trial: Option<TrialChoice>,
    /// Sampling frequency in Hz. It takes precedence over the column t, which then gives only the time of the first
    /// sample (0 if there is no t); with [`Repair::resample`] it is the frequency of the new grid. By default the
    /// column t determines the sampling.
    pub sampling_hz: Option<f64>,
    /// Selects the samples with `from <= t < to`, s. By default all samples.
    pub span_s: (Option<f64>, Option<f64>),
    /// Columns that were logged at their own times and therefore have no value in some rows; `e` and `u` denote the
    /// input and the output unless a column has that name. By default there are none.
    pub sparse: BTreeMap<String, SparseTreatment>,
    /// Names of columns to keep in addition to the input, the output and the time; by default all columns are kept.
    /// Other columns of a CSV file are not kept in memory.
    pub columns: Option<Vec<String>>,
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
            sparse: BTreeMap::new(),
            columns: None,
            repair: Repair::default(),
        }
    }
}

impl ReadOptions {
    /// True if a column must be read; the time is treated separately.
    pub(crate) fn needs_column(&self, name: &str) -> bool {
        let is_term = |signal: &ColumnExpression| signal.terms().contains(&name);
        self.columns.as_ref().is_none_or(|kept| {
            kept.iter().any(|column| column == name)
                || self.input.iter().chain([&self.output]).any(is_term)
                || self.sparse.contains_key(name)
                || self.trial.as_ref().is_some_and(|trial| trial.column == name)
        })
    }
}

/// Trials of a file to read: `COLUMN` selects a trial for each value of a column (`t`: for each restart of the time),
/// `COLUMN=VALUE` a single trial.
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
    /// Selects a single trial.
    pub(super) fn single(column: &str, value: &str) -> Self {
        Self {
            column: column.to_owned(),
            value: Some(value.to_owned()),
        }
    }

    /// True if the choice selects a single trial.
    pub(super) fn selects_one_trial(&self) -> bool {
        self.value.is_some()
    }
}

impl FromStr for TrialChoice {
    type Err = IoError;

    /// # Errors
    /// [`IoError::Expression`] if the column or the value is missing.
    fn from_str(text: &str) -> Result<Self, IoError> {
        let (column, value) = match text.rsplit_once('=') {
            Some((column, value)) => (column.trim(), Some(value.trim().to_owned())),
            None => (text.trim(), None),
        };
        if column.is_empty() || value.as_ref().is_some_and(String::is_empty) {
            return Err(IoError::Expression {
                found: text.to_owned(),
                expected: String::from("expected the column that numbers the trials, or one trial, such as trial=3"),
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
