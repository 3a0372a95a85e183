//! Errors that end a command, and their exit codes.

use hoid::analysis::{AnalysisError, registry::estimator_setting};
use hoid::design::{compare::CompareError, experiment::DesignError};
use hoid::ident::IdentError;
use hoid::io::{IoError, ScenarioFileError};
use hoid::model::{ModelError, Verdict, VerdictLevel};
use hoid::report::ReportError;
use hoid::sim::SimError;
use hoid::study::StudyError;
use hoid::thesis::ThesisError;
use thiserror::Error;

use crate::{
    args::{as_text, flag},
    interrupt,
};

/// An error that ends a command.
#[derive(Debug, Error)]
pub enum CliError {
    /// The arguments are contradictory or invalid.
    #[error("{0}")]
    Usage(String),
    /// The file does not have the requested columns; the message contains a command with the columns of the file.
    #[error("{0}")]
    OtherColumns(String),
    /// A stream cannot be read, parsed or written.
    #[error("{0}")]
    Stream(String),
    /// The result could not be printed.
    #[error("standard output cannot be written: {0}; the output is missing or truncated; free space and run again")]
    Output(std::io::Error),
    /// The result was printed, but the data do not determine the requested quantity.
    #[error("the data do not determine the requested quantity: {0}")]
    NotDetermined(String),
    /// The work was interrupted and can be resumed.
    #[error("{0}")]
    Stopped(String),
    #[error(transparent)]
    Study(#[from] StudyError),
    #[error(transparent)]
    Compare(#[from] CompareError),
    #[error(transparent)]
    Design(#[from] DesignError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Ident(#[from] IdentError),
    #[error(transparent)]
    Io(#[from] IoError),
    #[error(transparent)]
    Scenario(#[from] ScenarioFileError),
    #[error(transparent)]
    Sim(#[from] SimError),
    #[error(transparent)]
    Report(#[from] ReportError),
    /// An experiment of the lab cannot be set up or shown.
    #[cfg(feature = "lab")]
    #[error(transparent)]
    Lab(Box<hoid_lab::LabError>),
    /// The reproduction of the thesis failed.
    #[error(transparent)]
    Thesis(#[from] ThesisError),
}

impl From<AnalysisError> for CliError {
    /// Converts the error; options that contradict each other or the data are usage errors.
    fn from(error: AnalysisError) -> Self {
        match error {
            AnalysisError::Ident(error) => Self::Ident(error),
            AnalysisError::Io(error) => Self::Io(error),
            AnalysisError::Model(error) => Self::Model(error),
            AnalysisError::OtherColumns(others) => {
                let typed = std::env::args_os().skip(1);
                let command = others.command(typed.map(|word| word.to_string_lossy().into_owned()));
                Self::OtherColumns(format!("{}: {command}", others.description()))
            }
            AnalysisError::InAnotherFile { .. } => Self::OtherColumns(error.to_string()),
            AnalysisError::SameSamples { .. }
            | AnalysisError::NoSuchChannel { .. }
            | AnalysisError::Options { .. }
            | AnalysisError::NotAResult { .. }
            | AnalysisError::NoRecordings => Self::Usage(error.to_string()),
            AnalysisError::Option { name, reason } => Self::Usage(format!("{}: {reason}", option_text(name))),
            AnalysisError::Misplaced {
                name,
                estimators: of,
                alternative: instead,
            } => {
                let instead = instead.replace("delay", "--delay");
                Self::Usage(format!(
                    "{} applies only to {}{instead}",
                    option_text(name),
                    as_text(&of)
                ))
            }
        }
    }
}

/// Returns an option as the user types it.
fn option_text(name: &str) -> String {
    match estimator_setting(name) {
        Some(setting) => format!("--{}", flag(setting.name)),
        None => name.to_owned(),
    }
}

#[cfg(feature = "lab")]
impl From<hoid_lab::LabError> for CliError {
    /// Converts the error; an invalid configuration is a usage error.
    fn from(error: hoid_lab::LabError) -> Self {
        match error {
            hoid_lab::LabError::Config { .. } => Self::Usage(error.to_string()),
            _ => Self::Lab(Box::new(error)),
        }
    }
}

impl CliError {
    /// Converts an error in the options that was found before any file was read.
    pub fn from_options(error: AnalysisError) -> Self {
        match error {
            AnalysisError::Ident(IdentError::BadOption {
                option,
                found,
                expected,
            }) => Self::Usage(format!("{}: found {found}; expected {expected}", option_text(&option))),
            other => other.into(),
        }
    }

    /// Returns an error if the verdict on a printed result is that the requested quantity is not determined.
    ///
    /// # Errors
    /// [`CliError::NotDetermined`] if the data do not determine the requested quantity.
    pub fn check_verdict(verdict: &Verdict) -> Result<(), Self> {
        match verdict.level {
            VerdictLevel::NotDetermined => {
                let reasons: Vec<&str> = verdict.reasons().collect();
                Err(Self::NotDetermined(reasons.join("; ")))
            }
            VerdictLevel::Trustworthy | VerdictLevel::Doubtful => Ok(()),
        }
    }

    /// Returns the exit code: 2 for usage errors, 1 if the data or the task give no result, 128 plus the number of the
    /// signal after a signal.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_)
            | Self::Compare(
                CompareError::Factor { .. } | CompareError::Quantity { .. } | CompareError::NotInJson { .. },
            )
            | Self::Io(IoError::OutputIsInput { .. } | IoError::OutputAmongInputs { .. })
            | Self::Study(StudyError::Io(IoError::OutputIsInput { .. } | IoError::OutputAmongInputs { .. }))
            | Self::Study(
                StudyError::Plan { .. }
                | StudyError::BadShard { .. }
                | StudyError::Pattern { .. }
                | StudyError::NoManifest { .. },
            ) => 2,
            Self::Design(error) if error.is_request_error() => 2,
            Self::Stopped(_) => u8::try_from(interrupt::exit_code()).unwrap_or(1),
            _ => 1,
        }
    }
}
