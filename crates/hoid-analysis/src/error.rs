//! Why an analysis gives no result.

use std::path::Path;

use hoid_ident::IdentError;
use hoid_io::{IoError, ReadOptions};
use hoid_model::ModelError;
use thiserror::Error;

use crate::look::{OtherColumns, other_columns};

/// Why an analysis gives no result.
#[derive(Debug, Error)]
pub enum AnalysisError {
    /// A recording is given twice.
    #[error(
        "{first} and {second} hold the same samples of e and u; runs of one person must be different recordings: give each once"
    )]
    SameSamples {
        /// The one.
        first: String,
        /// The other.
        second: String,
    },
    /// A file without the columns that were requested, in which they are found under other names.
    #[error(transparent)]
    OtherColumns(Box<OtherColumns>),
    /// An offset of a channel that does not exist.
    #[error("--offset: there is no channel {name:?}; the record has {known}, and e and u represent input and output")]
    NoSuchChannel {
        /// The request.
        name: String,
        /// The available items.
        known: String,
    },
    /// Options that contradict each other or the model.
    #[error("{reason}")]
    Options {
        /// The findings, the expected value, what to do.
        reason: String,
    },
    /// A text that is not a result.
    #[error(
        "this is not a result of a fit: {found}; expected what to_json of this version wrote, or identify --json printed"
    )]
    NotAResult {
        /// The findings.
        found: String,
    },
    /// An option that does not fit the estimator, or has no such value.
    #[error("{name}: {reason}")]
    Option {
        /// Its name in the registry.
        name: &'static str,
        /// The findings, the expected value, what to do.
        reason: String,
    },
    /// An option of other estimators.
    #[error("{name} belongs to {}{instead}", .of.join(", "))]
    Misplaced {
        /// Its name in the registry.
        name: &'static str,
        /// The estimators that have it.
        of: Vec<&'static str>,
        /// The alternative.
        instead: &'static str,
    },
    /// There is no recording.
    #[error("no recording was given; name at least one run")]
    NoRecordings,
    /// An estimator refuses.
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
    /// Why a file is not read, with what to ask for where it has other columns than were requested.
    pub fn of_reading(error: IoError, path: &Path, options: &ReadOptions) -> Self {
        match other_columns(&error, path, options) {
            Some(others) => Self::OtherColumns(Box::new(others)),
            None => error.into(),
        }
    }
}
