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
        /// The file.
        path: String,
        /// Error reported by the operating system.
        reason: String,
    },
    /// Invalid TOML, or keys and types that a scenario does not have.
    #[error("scenario file {path}, line {line}: {reason}")]
    Syntax {
        /// The file.
        path: String,
        /// Line, from 1.
        line: usize,
        /// The problem.
        reason: String,
    },
    /// An invalid value.
    #[error("scenario file {path}, line {line}: {key} is {found}, expected {expected}")]
    Value {
        /// The file.
        path: String,
        /// Line, from 1.
        line: usize,
        /// The key.
        key: String,
        /// The value found.
        found: String,
        /// The valid values, and the remedy.
        expected: String,
    },
    /// Keys that are missing or contradict each other.
    #[error("scenario file {path}: {reason}")]
    Keys {
        /// The file.
        path: String,
        /// Missing or surplus parts, and the remedy.
        reason: String,
    },
    /// Values that are valid individually, but not together.
    #[error("scenario file {path}: {source}")]
    Model {
        /// The file.
        path: String,
        /// The problem.
        source: ModelError,
    },
}
