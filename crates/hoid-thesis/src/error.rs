//! Why the reference text could not be reproduced.

use hoid_io::IoError;
use hoid_report::ReportError;
use hoid_study::StudyError;
use thiserror::Error;

/// Everything that stops a reproduction.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ThesisError {
    /// A name that is neither a table nor a figure of the reproduction.
    #[error("{name}: no table, figure or study is called so; expected {CLAIMS}, or a name, study or appendix of: {known}", CLAIMS = crate::CLAIMS)]
    UnknownItem {
        /// The name.
        name: String,
        /// All names, separated by commas.
        known: String,
    },
    /// Tables that cannot be read, or a page that cannot be written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A page that could not be made.
    #[error(transparent)]
    Report(Box<ReportError>),
    /// A study that failed.
    #[error(transparent)]
    Study(Box<StudyError>),
}

impl From<ReportError> for ThesisError {
    fn from(error: ReportError) -> Self {
        Self::Report(Box::new(error))
    }
}

impl From<StudyError> for ThesisError {
    fn from(error: StudyError) -> Self {
        Self::Study(Box::new(error))
    }
}
