//! Errors of an experiment.

use std::path::Path;

use hoid_ident::IdentError;
use hoid_io::{IoError, ScenarioFileError};
use hoid_model::ModelError;
use hoid_study::StudyError;
use thiserror::Error;

/// Reason why an experiment cannot be set up, run, verified or displayed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LabError {
    /// A configuration that contradicts itself or cannot be read.
    #[error("{location}: {reason}")]
    Config {
        /// Name of the file and the location in it.
        location: String,
        /// Description of the problem, the expected value and the remedy.
        reason: String,
    },
    /// An invalid message from a page.
    #[error("a message from the page was refused: {0}")]
    Message(String),
    /// A request at the wrong time.
    #[error("{0}")]
    Order(String),
    /// A file of a session that cannot be read or written.
    #[error("{file}: {source}; check the location and the permissions")]
    File {
        /// Path of the file.
        file: String,
        /// Error reported by the operating system.
        source: std::io::Error,
    },
    /// A damaged file of a session.
    #[error("{file}: {reason}")]
    Damaged {
        /// Path of the file.
        file: String,
        /// The value found and the expected value.
        reason: String,
    },
    /// No available port, or no random numbers.
    #[error("the server cannot start: {0}")]
    Server(String),
    /// A page of results that could not be created.
    #[error("{0}")]
    Report(String),
    /// An error of a recording or a table.
    #[error(transparent)]
    Io(#[from] IoError),
    /// An error in a scenario file.
    #[error(transparent)]
    Scenario(Box<ScenarioFileError>),
    /// An invalid value or signal of a model or a record.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// An estimate that cannot be computed.
    #[error(transparent)]
    Ident(Box<IdentError>),
    /// An error of the manifest of a group.
    #[error(transparent)]
    Study(Box<StudyError>),
}

impl LabError {
    /// Creates the error for a file that the operating system cannot read or write.
    pub(crate) fn file(path: &Path, source: std::io::Error) -> Self {
        Self::File {
            file: path.display().to_string(),
            source,
        }
    }

    pub(crate) fn damaged_file(path: &Path, reason: impl Into<String>) -> Self {
        Self::Damaged {
            file: path.display().to_string(),
            reason: reason.into(),
        }
    }
}

macro_rules! boxed {
    ($($error:ident => $variant:ident),+) => {
        $(impl From<$error> for LabError {
            fn from(error: $error) -> Self {
                Self::$variant(Box::new(error))
            }
        })+
    };
}

// Large errors are boxed, so that a `Result` stays small.
boxed! { ScenarioFileError => Scenario, IdentError => Ident, StudyError => Study }
