//! Errors of the comparison of people or conditions.

use hoid_study::StudyError;
use thiserror::Error;

/// The reason why there is no comparison.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CompareError {
    /// Not more people than coefficients.
    #[error("{found} with an estimate, expected at least {expected}: record more, or compare fewer levels")]
    TooFew {
        /// Number of people, or of runs.
        found: usize,
        /// Minimum number.
        expected: usize,
    },
    /// A value or a standard error that is not finite.
    #[error("an estimate or its standard error is not finite, or negative: leave that person out")]
    NotFinite,
    /// Columns that are linearly dependent.
    #[error("the covariates cannot be distinguished (one is constant, or a sum of others): leave one out")]
    Collinear,
    /// No scatter from which the error of a mean could be estimated.
    #[error("all estimates are equal: there is no scatter to judge a difference by; is a run given twice?")]
    NoScatter,
    /// An invalid quantity.
    #[error(
        "there is no quantity {found:?} to compare; expected crossover, phase_margin, tau_e, gain_db@W or phase_deg@W with W in rad/s, rms_e, rms_u, or a parameter of the operator such as K, T_L, omega_nm"
    )]
    Quantity {
        /// The requested quantity.
        found: String,
    },
    /// An invalid factor.
    #[error(
        "factor {name:?}: {reason}; expected NAME, or NAME:LEVEL=A,B;LEVEL=C with conditions or people of the group"
    )]
    Factor {
        /// The requested factor.
        name: String,
        /// The problem.
        reason: String,
    },
    /// A path without the result of a group.
    #[error(
        "{place} holds no result of a group ({reason}); expected recordings with their manifest group.toml, a directory that `hoid group DIR --out` wrote, or what `hoid group --json` printed"
    )]
    NoGroup {
        /// The path.
        place: String,
        /// The problem.
        reason: String,
    },
    /// A quantity that is missing in the JSON of a group.
    #[error("{what} is not in the JSON of a group: name the directory that `hoid group DIR --out` wrote")]
    NotInJson {
        /// The requested quantity.
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
