//! Conversion of errors of the libraries to exceptions of `pyhoid.errors`, by kind.
//!
//! The messages are those of the libraries, with keywords in place of command-line options.

use hoid_analysis::{
    AnalysisError,
    registry::{CHANGE, OPERATOR, REMNANT},
};
use hoid_design::{compare::CompareError, experiment::DesignError};
use hoid_ident::IdentError;
use hoid_io::{IoError, ScenarioFileError};
use hoid_model::{ModelError, NotConvertible, UnknownName};
use hoid_report::ReportError;
use hoid_sim::SimError;
use hoid_study::StudyError;
use hoid_thesis::ThesisError;
use pyo3::{PyErr, import_exception};

use crate::keyword_messages::in_python;

import_exception!(pyhoid.errors, Error);
import_exception!(pyhoid.errors, DataError);
import_exception!(pyhoid.errors, OptionError);
import_exception!(pyhoid.errors, EstimationError);
import_exception!(pyhoid.errors, NotConvertibleError);
import_exception!(pyhoid.errors, FileError);
import_exception!(pyhoid.errors, FileMissingError);
import_exception!(pyhoid.errors, FormatError);
import_exception!(pyhoid.errors, StudyStateError);

/// Result of a call, or the exception to raise.
pub type Outcome<T> = Result<T, Failure>;

/// An exception to raise; the operator `?` converts every error of the libraries to it.
pub struct Failure(PyErr);

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        failure.0
    }
}

impl From<PyErr> for Failure {
    fn from(error: PyErr) -> Self {
        Self(error)
    }
}

/// Returns the error for an invalid option.
pub fn bad_option(message: impl Into<String>) -> Failure {
    Failure(OptionError::new_err(message.into()))
}

impl From<UnknownName> for Failure {
    fn from(error: UnknownName) -> Self {
        ModelError::from(error).into()
    }
}

impl From<ModelError> for Failure {
    fn from(error: ModelError) -> Self {
        let text = in_python(&error.to_string());
        Self(match error {
            ModelError::NotFinite { .. }
            | ModelError::LengthMismatch { .. }
            | ModelError::EmptyRecord { .. }
            | ModelError::DuplicateChannel { .. }
            | ModelError::NoSuchChannel { .. }
            | ModelError::EmptySpan { .. }
            | ModelError::Decimation { .. } => DataError::new_err(text),
            ModelError::NotConvertible(_) => NotConvertibleError::new_err(text),
            _ => OptionError::new_err(text),
        })
    }
}

impl From<NotConvertible> for Failure {
    fn from(reason: NotConvertible) -> Self {
        Self(NotConvertibleError::new_err(reason.to_string()))
    }
}

impl From<IdentError> for Failure {
    fn from(error: IdentError) -> Self {
        let text = in_python(&error.to_string());
        Self(match error {
            IdentError::Model(error) => return error.into(),
            IdentError::BadStart { .. }
            | IdentError::UnknownParameter { .. }
            | IdentError::BadOption { .. }
            | IdentError::Option { .. }
            | IdentError::EmptyRange { .. } => OptionError::new_err(text),
            IdentError::SingularRegressors { .. }
            | IdentError::SingularInstruments { .. }
            | IdentError::SingularInformation { .. }
            | IdentError::NoFiniteLoss
            | IdentError::NotSettled { .. } => EstimationError::new_err(text),
            _ => DataError::new_err(text),
        })
    }
}

impl From<AnalysisError> for Failure {
    fn from(error: AnalysisError) -> Self {
        let text = in_python(&error.to_string());
        match error {
            AnalysisError::Ident(error) => error.into(),
            AnalysisError::Io(error) => error.into(),
            AnalysisError::Model(error) => error.into(),
            AnalysisError::OtherColumns(others) => Self(FormatError::new_err(format!(
                "{}: {}",
                others.description(),
                others.as_keys()
            ))),
            AnalysisError::Misplaced {
                name,
                estimators: of,
                alternative: instead,
            } => {
                let of: Vec<String> = of.into_iter().map(estimator).collect();
                bad_option(format!("{name} applies only to {}{instead}", of.join(", ")))
            }
            AnalysisError::InAnotherFile { .. } => Self(FormatError::new_err(text)),
            AnalysisError::SameSamples { .. } | AnalysisError::NotAResult { .. } => Self(DataError::new_err(text)),
            AnalysisError::NoSuchChannel { .. }
            | AnalysisError::Options { .. }
            | AnalysisError::Option { .. }
            | AnalysisError::NoRecordings => Self(OptionError::new_err(text)),
        }
    }
}

/// Returns the Python call that requests an estimator.
fn estimator(name: &str) -> String {
    match name {
        OPERATOR => format!("structure=\"{OPERATOR}\""),
        REMNANT => "noise=\"remnant\"".to_owned(),
        CHANGE => "change=\"sigmoid\"".to_owned(),
        name => format!("method=\"{name}\""),
    }
}

impl From<IoError> for Failure {
    fn from(error: IoError) -> Self {
        let text = in_python(&error.to_string());
        Self(match error {
            IoError::Unreadable { source, .. } if source.kind() == std::io::ErrorKind::NotFound => {
                FileMissingError::new_err(text)
            }
            IoError::Unreadable { .. } | IoError::Unwritable { .. } | IoError::Directory { .. } => {
                FileError::new_err(text)
            }
            _ => FormatError::new_err(text),
        })
    }
}

impl From<ScenarioFileError> for Failure {
    fn from(error: ScenarioFileError) -> Self {
        let text = in_python(&error.to_string());
        Self(match error {
            ScenarioFileError::Unreadable { .. } => FileMissingError::new_err(text),
            _ => FormatError::new_err(text),
        })
    }
}

impl From<SimError> for Failure {
    fn from(error: SimError) -> Self {
        match error {
            SimError::Model(error) => error.into(),
            other => Self(OptionError::new_err(other.to_string())),
        }
    }
}

impl From<CompareError> for Failure {
    fn from(error: CompareError) -> Self {
        let text = in_python(&error.to_string());
        Self(match error {
            CompareError::Study(error) => return (*error).into(),
            CompareError::Quantity { .. } | CompareError::Factor { .. } | CompareError::NotInJson { .. } => {
                OptionError::new_err(text)
            }
            CompareError::NoGroup { .. } => FormatError::new_err(text),
            _ => DataError::new_err(text),
        })
    }
}

impl From<DesignError> for Failure {
    fn from(error: DesignError) -> Self {
        let text = in_python(&error.to_string());
        match error {
            DesignError::Io(error) => error.into(),
            DesignError::Scenario(error) => error.into(),
            DesignError::Study(error) => (*error).into(),
            DesignError::Model(error) => error.into(),
            DesignError::NoPeople { .. } | DesignError::NoLines { .. } => Self(FormatError::new_err(text)),
            error if error.is_request_error() => bad_option(text),
            _ => Self(DataError::new_err(text)),
        }
    }
}

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        let text = in_python(&error.to_string());
        Self(match error {
            StudyError::Io(error) => return error.into(),
            StudyError::Plan { .. }
            | StudyError::BadShard { .. }
            | StudyError::Pattern { .. }
            | StudyError::Virtual { .. } => OptionError::new_err(text),
            _ => StudyStateError::new_err(text),
        })
    }
}

impl From<ThesisError> for Failure {
    fn from(error: ThesisError) -> Self {
        match error {
            ThesisError::Io(error) => error.into(),
            ThesisError::Report(error) => (*error).into(),
            ThesisError::Study(error) => (*error).into(),
            ThesisError::UnknownItem { .. } => Self(OptionError::new_err(error.to_string())),
            other => Self(DataError::new_err(other.to_string())),
        }
    }
}

impl From<ReportError> for Failure {
    fn from(error: ReportError) -> Self {
        match error {
            ReportError::Io(error) => error.into(),
            ReportError::Study(error) => (*error).into(),
            other => Self(DataError::new_err(other.to_string())),
        }
    }
}
