//! Interface between an instrumental variable method and the estimator.

use hoid_model::Structure;

use super::equation::IvProblem;
use crate::{IdentError, Termination, criterion::Criterion};

/// An instrumental variable method. Each method has its own file and is listed in [`IvMethod`](super::IvMethod).
pub(super) struct Algorithm {
    /// Short name, as used in options and tables.
    pub name: &'static str,
    /// Description in one line, without a full stop.
    pub help: &'static str,
    /// Source in the literature.
    pub source: &'static str,
    /// The only structure that the method fits.
    pub structures: &'static [Structure; 1],
    /// Function that computes theta, its covariance, and the termination of the iteration.
    pub solve: fn(&IvProblem<'_>, &Criterion<'_>, IterationLimits) -> Result<IvSolution, IdentError>,
}

/// Criteria for ending the iteration of a refined method.
#[derive(Debug, Clone, Copy)]
pub(super) struct IterationLimits {
    /// Largest number of iterations.
    pub max_iterations: usize,
    /// The iteration ends if a step, measured in standard errors, is smaller than this value.
    pub tolerance: f64,
}

/// Result of an instrumental variable method.
pub(super) struct IvSolution {
    /// Theta in the order of [`Orders::parameter_names`](hoid_model::Orders::parameter_names).
    pub theta: Vec<f64>,
    /// Covariance of theta by rows; `None` if the method gives none.
    pub covariance: Option<Vec<f64>>,
    pub termination: Termination,
}
