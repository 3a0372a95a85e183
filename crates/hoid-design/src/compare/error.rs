//! Why people or conditions cannot be compared.

use hoid_study::StudyError;
use thiserror::Error;

/// Why there is no comparison.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CompareError {
    /// No more people than coefficients.
    #[error("{found} with an estimate, expected at least {expected}: record more, or compare fewer levels")]
    TooFew {
        /// People, or runs.
        found: usize,
        /// The least number of them.
        expected: usize,
    },
    /// A value or an error that is not a number.
    #[error("an estimate or its standard error is not finite, or negative: leave that person out")]
    NotFinite,
    /// Columns that cannot be distinguished.
    #[error("the covariates cannot be distinguished (one is constant, or a sum of others): leave one out")]
    Collinear,
    /// Nothing to judge a mean by.
    #[error("all estimates are equal: there is no scatter to judge a difference by; is a run given twice?")]
    NoScatter,
    /// A quantity that is invalid.
    #[error(
        "there is no quantity {found:?} to compare; expected crossover, phase_margin, tau_e, gain_db@W or phase_deg@W with W in rad/s, rms_e, rms_u, or a parameter of the operator such as K, T_L, omega_nm"
    )]
    Quantity {
        /// The request.
        found: String,
    },
    /// A factor without meaning.
    #[error(
        "factor {name:?}: {reason}; expected NAME, or NAME:LEVEL=A,B;LEVEL=C with conditions or people of the group"
    )]
    Factor {
        /// The request.
        name: String,
        /// The problem.
        reason: String,
    },
    /// A place that holds no group.
    #[error(
        "{place} holds no result of a group ({reason}); expected a directory that `hoid group DIR --out` wrote, or what `hoid group --json` printed"
    )]
    NoGroup {
        /// The place.
        place: String,
        /// The problem.
        reason: String,
    },
    /// Contents of the JSON of a group does not.
    #[error("{what} is not in the JSON of a group: name the directory that `hoid group DIR --out` wrote")]
    NotInJson {
        /// The request.
        what: String,
    },
    /// Tables that cannot be read.
    #[error(transparent)]
    Study(Box<StudyError>),
}

impl From<StudyError> for CompareError {
    fn from(error: StudyError) -> Self {
        Self::Study(Box::new(error))
    }
}
