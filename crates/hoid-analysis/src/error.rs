//! Reasons why an analysis has no result.

use std::path::Path;

use hoid_ident::IdentError;
use hoid_io::{IoError, ReadOptions};
use hoid_model::ModelError;
use thiserror::Error;

use crate::examination::{OtherColumns, other_columns};

/// Reason why an analysis has no result.
#[derive(Debug, Error)]
pub enum AnalysisError {
    /// A recording that is given twice.
    #[error(
        "{first} and {second} hold the same samples of e and u; runs of one person must be different recordings: give \
         each recording once"
    )]
    SameSamples {
        /// Name of the first recording.
        first: String,
        /// Name of the second recording.
        second: String,
    },
    /// A file without the requested columns, whose signals have other names.
    #[error(transparent)]
    OtherColumns(Box<OtherColumns>),
    /// A column that is missing in one file but exists in another.
    #[error(
        "{file} has no column {missing}, but {other} does. Each file is read as a separate recording. If the files \
         are parts of one recording, join them by time, for example in Python with \
         pandas.merge(pandas.read_csv(\"{file}\"), pandas.read_csv(\"{other}\"), on=\"t\", \
         how=\"outer\").sort_values(\"t\").to_csv(\"joined.csv\", index=False), and read joined.csv with --sparse \
         e=linear,u=linear --resample"
    )]
    InAnotherFile {
        /// Name of the file without the column.
        file: String,
        /// Name of the column.
        missing: String,
        /// Name of the file that contains the column.
        other: String,
    },
    /// An offset for a channel that does not exist.
    #[error(
        "--offset: there is no channel {name:?}; the record has {available}; e and u can also be used for the input and output"
    )]
    NoSuchChannel {
        /// The requested name.
        name: String,
        /// Names of the existing channels.
        available: String,
    },
    /// Options that contradict each other or the model.
    #[error("{reason}")]
    Options {
        /// The value found, the expected value, and the remedy.
        reason: String,
    },
    /// A text that is not a result.
    #[error(
        "this is not a result of a fit: {found}; expected the output of identify --json, or of to_json in this version"
    )]
    NotAResult {
        /// Description of the contents found.
        found: String,
    },
    /// An option with an invalid value, or one that does not apply to the estimator.
    #[error("{name}: {reason}")]
    Option {
        /// Name of the option in the registry.
        name: &'static str,
        /// The value found, the expected value, and the remedy.
        reason: String,
    },
    /// An option that belongs to other estimators.
    #[error("{name} applies only to {}{alternative}", .estimators.join(", "))]
    Misplaced {
        /// Name of the option in the registry.
        name: &'static str,
        /// Names of the estimators that have the option.
        estimators: Vec<&'static str>,
        /// The option to use instead.
        alternative: &'static str,
    },
    /// There is no recording.
    #[error("no recording was given; name at least one run")]
    NoRecordings,
    /// An error of an estimator.
    #[error(transparent)]
    Ident(IdentError),
    /// A file cannot be read.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A record cannot be created from the data.
    #[error(transparent)]
    Model(#[from] ModelError),
}

impl From<IdentError> for AnalysisError {
    fn from(error: IdentError) -> Self {
        match error {
            IdentError::Option { name, reason } => Self::Option { name, reason },
            other => Self::Ident(other),
        }
    }
}

impl AnalysisError {
    /// Creates the error for a file that cannot be read. If the requested columns are missing, the error contains the
    /// columns to request.
    pub fn from_reading(error: IoError, path: &Path, options: &ReadOptions) -> Self {
        match other_columns(&error, path, options) {
            Some(others) => Self::OtherColumns(Box::new(others)),
            None => error.into(),
        }
    }
}
