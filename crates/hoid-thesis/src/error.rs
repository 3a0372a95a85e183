//! Errors of the reproduction of the thesis.

use hoid_ident::IdentError;
use hoid_io::IoError;
use hoid_model::{ModelError, NotConvertible};
use hoid_report::ReportError;
use hoid_sim::SimError;
use hoid_study::StudyError;
use thiserror::Error;

/// Reason why a reproduction failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ThesisError {
    /// A name that is neither a table nor a figure of the reproduction.
    #[error("{name}: there is no table, figure or study of this name; expected {CLAIMS}, or a name, study or appendix of: {known}", CLAIMS = crate::CLAIMS)]
    UnknownItem {
        /// The name.
        name: String,
        /// All names, separated by commas.
        known: String,
    },
    /// Recordings for something that is made without them.
    #[error("recordings apply to the experiment only: make only \"experiment\" with them")]
    NotTheExperiment,
    /// Recordings to which the procedure of the text cannot be applied.
    #[error("{place}: {reason}")]
    Recordings {
        /// The manifest.
        place: String,
        /// The fault, and the remedy.
        reason: String,
    },
    /// Tables that cannot be read, or a page that cannot be written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A page that could not be rendered.
    #[error(transparent)]
    Report(Box<ReportError>),
    /// A study that failed.
    #[error(transparent)]
    Study(Box<StudyError>),
    /// A comparator for which a record is unsuitable.
    #[error("{method}: {quantity} is {found}, expected {expected}")]
    Unsuited {
        /// The comparator.
        method: &'static str,
        /// The problem.
        quantity: String,
        /// The value found.
        found: String,
        /// The expected value.
        expected: String,
    },
    /// An estimator that failed, or an invalid option.
    #[error(transparent)]
    Estimator(Box<IdentError>),
    /// An invalid model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A model that is not an operator.
    #[error(transparent)]
    NotConvertible(#[from] NotConvertible),
    /// A scenario that cannot be simulated.
    #[error(transparent)]
    Simulation(Box<SimError>),
}

impl From<IdentError> for ThesisError {
    fn from(error: IdentError) -> Self {
        Self::Estimator(Box::new(error))
    }
}

impl From<SimError> for ThesisError {
    fn from(error: SimError) -> Self {
        Self::Simulation(Box::new(error))
    }
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
