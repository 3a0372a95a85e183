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
    /// A name that belongs to no table, figure, appendix or study of the reproduction.
    #[error("{name}: there is no table, figure or study with this name; expected {CLAIMS}, or a name, study or appendix from: {available}", CLAIMS = crate::CLAIMS_NAME)]
    UnknownItem {
        /// The unknown name.
        name: String,
        /// All known names, separated by commas.
        available: String,
    },
    /// Recordings were given, but something other than the experiment was requested.
    #[error("recordings apply only to the experiment; request only \"experiment\" with them")]
    NotTheExperiment,
    /// Recordings to which the procedure of the thesis cannot be applied.
    #[error("{subject}: {reason}")]
    Recordings {
        /// Manifest, group or experiment concerned.
        subject: String,
        /// The problem and its remedy.
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
    /// A record that is unsuitable for a comparator, or an invalid plan.
    #[error("{method}: {quantity} is {found}, expected {expected}")]
    Unsuited {
        /// Comparator, plan or procedure concerned.
        method: &'static str,
        /// The quantity or key that is wrong.
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
    /// A model that cannot be converted to an operator.
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
