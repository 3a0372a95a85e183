//! Errors of reports.

use hoid_io::IoError;
use hoid_study::StudyError;
use thiserror::Error;

/// Errors that prevent a report. A model that cannot be converted or a record that cannot be validated does not prevent
/// a report: the page shows the reason instead.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReportError {
    /// A report that contains no model.
    #[error("the report has no model; expected at least one fitted model")]
    NoModels,
    /// A report that contains no recursive estimate.
    #[error("the report has no trace; expected one to {maximum} recursive estimates")]
    NoTraces {
        /// Maximum number of traces on a page.
        maximum: usize,
    },
    /// More recursive estimates than a figure can show.
    #[error("the report has {found} traces, expected at most {maximum}: write a second report for the others")]
    TooManyTraces {
        /// Number of traces given.
        found: usize,
        /// Maximum number of traces on a page.
        maximum: usize,
    },
    /// A recursive estimate without rows.
    #[error("the trace {name:?} has no row, expected one or more: track a record that has samples")]
    EmptyTrace {
        /// Name of the trace.
        name: String,
    },
    /// Tables that cannot be read, or a page that cannot be written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A study that failed.
    #[error(transparent)]
    Study(Box<StudyError>),
    /// A figure that cannot be written in the requested format.
    #[error("the figure cannot be written in this format: {reason}")]
    Figure {
        /// Reason why the figure cannot be written.
        reason: String,
    },
    /// A page template that could not be rendered: a defect of this crate.
    #[error("the page template could not be filled: {reason}; please report this as a defect")]
    Template {
        /// Error message of the template engine.
        reason: String,
    },
}

impl From<StudyError> for ReportError {
    fn from(error: StudyError) -> Self {
        Self::Study(Box::new(error))
    }
}
