//! Why a report could not be made.

use thiserror::Error;

/// Everything that stops a report. A model that does not convert or a record that cannot be validated is no error: the page
/// shows the reason in its place.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ReportError {
    /// Nothing to report.
    #[error("the report has no model; expected at least one fitted model")]
    NoModels,
    /// The page template could not be filled: a defect of this crate.
    #[error("the page template could not be filled: {reason}; please report this as a defect")]
    Template {
        /// What the template engine said.
        reason: String,
    },
}
