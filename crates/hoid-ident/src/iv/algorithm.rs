//! Interface between a method of instrumental variables and the estimator.

use hoid_model::Structure;

use super::equation::IvProblem;
use crate::{IdentError, Termination, criterion::Criterion};

/// A method: each is in a file of its own and is listed in [`IvMethod`](super::IvMethod).
pub(super) struct Algorithm {
    /// Short name, as in options and tables.
    pub name: &'static str,
    /// Its definition, in a line without a full stop.
    pub help: &'static str,
    /// Where it comes from.
    pub source: &'static str,
    /// The structure that it fits, alone.
    pub structures: &'static [Structure; 1],
    /// Theta, its covariance, and how the iteration ended.
    pub solve: fn(&IvProblem<'_>, &Criterion<'_>, IterationLimits) -> Result<IvSolution, IdentError>,
}

/// When a refined method ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct IterationLimits {
    /// Largest number of iterations.
    pub max_iterations: usize,
    /// Largest step of the last iteration, as a share of the standard errors.
    pub tolerance: f64,
}

/// Result of a method.
pub(super) struct IvSolution {
    /// Theta in the order of [`Orders::parameter_names`](hoid_model::Orders::parameter_names).
    pub theta: Vec<f64>,
    /// Covariance by rows, where the method has one.
    pub covariance: Option<Vec<f64>>,
    pub termination: Termination,
}
