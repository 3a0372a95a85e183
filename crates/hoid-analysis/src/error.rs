//! Reasons why an analysis gives no result.

use std::path::Path;

use hoid_ident::IdentError;
use hoid_io::{IoError, ReadOptions};
use hoid_model::ModelError;
use thiserror::Error;

use crate::look::{OtherColumns, other_columns};

/// Reason why an analysis gives no result.
#[derive(Debug, Error)]
pub enum AnalysisError {
    /// A recording is given twice.
    #[error(
        "{first} and {second} hold the same samples of e and u; runs of one person must be different recordings: give each once"
    )]
    SameSamples {
        /// Name of the first.
        first: String,
        /// Name of the second.
        second: String,
    },
    /// A file without the requested columns, which contains them under other names.
    #[error(transparent)]
    OtherColumns(Box<OtherColumns>),
    /// A column that is in another of the files.
    #[error(
        "{file} has no column {missing}, but {other} has: each file is taken as a separate recording. If they are \
         parts of one recording, join them by time, in Python with pandas.merge(pandas.read_csv(\"{file}\"), \
         pandas.read_csv(\"{other}\"), on=\"t\", how=\"outer\").sort_values(\"t\").to_csv(\"joined.csv\", \
         index=False), and read joined.csv with --sparse e=linear,u=linear --resample"
    )]
    InAnotherFile {
        /// The file without the column.
        file: String,
        /// The column.
        missing: String,
        /// The file that has it.
        other: String,
    },
    /// An offset of a channel that does not exist.
    #[error("--offset: there is no channel {name:?}; the record has {known}, and e and u represent input and output")]
    NoSuchChannel {
        /// The requested name.
        name: String,
        /// The names that exist.
        known: String,
    },
    /// Options that contradict each other or the model.
    #[error("{reason}")]
    Options {
        /// The value found, the value expected, and the remedy.
        reason: String,
    },
    /// A text that is not a result.
    #[error(
        "this is not a result of a fit: {found}; expected the output of to_json of this version, or of identify --json"
    )]
    NotAResult {
        /// The value found.
        found: String,
    },
    /// An option that does not fit the estimator, or does not have this value.
    #[error("{name}: {reason}")]
    Option {
        /// Its name in the registry.
        name: &'static str,
        /// The value found, the value expected, and the remedy.
        reason: String,
    },
    /// An option of other estimators.
    #[error("{name} belongs to {}{instead}", .of.join(", "))]
    Misplaced {
        /// Its name in the registry.
        name: &'static str,
        /// The estimators that have it.
        of: Vec<&'static str>,
        /// The option to use instead.
        instead: &'static str,
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
    /// A record cannot be made.
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
    /// Error for a file that cannot be read, with the columns to request if it does not have the requested ones.
    pub fn of_reading(error: IoError, path: &Path, options: &ReadOptions) -> Self {
        match other_columns(&error, path, options) {
            Some(others) => Self::OtherColumns(Box::new(others)),
            None => error.into(),
        }
    }
}
