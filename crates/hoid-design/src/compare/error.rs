//! Errors of the comparison of people or conditions.

use hoid_study::StudyError;
use thiserror::Error;

/// Reason why a comparison is not possible.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CompareError {
    /// There are not more people than coefficients.
    #[error(
        "{found} people or runs have an estimate, expected at least {expected}: record more, or compare fewer levels"
    )]
    TooFew {
        /// Number of people or runs.
        found: usize,
        /// Minimum number of people or runs.
        expected: usize,
    },
    /// A value or a standard error is not finite.
    #[error(
        "an estimate, standard error or covariate is not finite, or a standard error is negative: leave out the \
         person with this value"
    )]
    NotFinite,
    /// Columns are linearly dependent.
    #[error("the covariates cannot be distinguished (one is constant, or a sum of other covariates): leave one out")]
    Collinear,
    /// All values are equal, so the error of a mean cannot be estimated.
    #[error("all estimates are equal, so there is no scatter with which to test a difference; give each run only once")]
    NoScatter,
    /// The requested quantity does not exist.
    #[error(
        "there is no quantity {found:?} to compare; expected crossover, phase_margin, tau_e, gain_db@W or phase_deg@W with W in rad/s, rms_e, rms_u, a parameter of the operator such as K, T_L, omega_nm, or of the response to a further input such as tau_f[f_t]"
    )]
    Quantity {
        /// Name of the requested quantity.
        found: String,
    },
    /// The requested factor is invalid.
    #[error(
        "factor {name:?}: {reason}; expected NAME, or NAME:LEVEL=A,B;LEVEL=C with conditions or people of the group"
    )]
    Factor {
        /// Name of the requested factor.
        name: String,
        /// The problem with the factor.
        reason: String,
    },
    /// The path does not hold the result of a group.
    #[error(
        "{path} does not contain the result of a group ({reason}); expected recordings with their manifest group.toml, a directory that `hoid group DIR --out` wrote, or the output of `hoid group --json`"
    )]
    NoGroup {
        /// Path that was given.
        path: String,
        /// The problem with the path.
        reason: String,
    },
    /// The JSON of a group does not contain a quantity.
    #[error("the JSON of a group does not contain {quantity}: give the directory that `hoid group DIR --out` wrote")]
    NotInJson {
        /// The requested quantity.
        quantity: String,
    },
    /// The tables of a group cannot be read.
    #[error(transparent)]
    Study(Box<StudyError>),
}

impl From<StudyError> for CompareError {
    fn from(error: StudyError) -> Self {
        Self::Study(Box::new(error))
    }
}
