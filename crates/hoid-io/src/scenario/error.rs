//! Errors of scenario files.

use hoid_model::ModelError;
use thiserror::Error;

/// Reason why a file is not a valid scenario.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ScenarioFileError {
    /// A file that cannot be read.
    #[error("scenario file {path}: {reason}; expected a readable text file")]
    Unreadable {
        /// Path of the file.
        path: String,
        /// Error reported by the operating system.
        reason: String,
    },
    /// Invalid TOML, unknown keys, or values of a wrong type.
    #[error("scenario file {path}, line {line}: {reason}")]
    Syntax {
        /// Path of the file.
        path: String,
        /// Line number, counted from 1.
        line: usize,
        /// Description of the problem.
        reason: String,
    },
    /// An invalid value.
    #[error("scenario file {path}, line {line}: {key} is {found}, expected {expected}")]
    Value {
        /// Path of the file.
        path: String,
        /// Line number, counted from 1.
        line: usize,
        /// Key with the invalid value.
        key: String,
        /// Value found in the file.
        found: String,
        /// Description of the valid values, and the remedy.
        expected: String,
    },
    /// Keys that are missing or contradict each other.
    #[error("scenario file {path}: {reason}")]
    Keys {
        /// Path of the file.
        path: String,
        /// Missing or superfluous keys, and the remedy.
        reason: String,
    },
    /// Values that are valid individually, but not in combination.
    #[error("scenario file {path}: {source}")]
    Model {
        /// Path of the file.
        path: String,
        /// Error reported by the model.
        source: ModelError,
    },
}
