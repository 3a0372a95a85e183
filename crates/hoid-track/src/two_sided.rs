//! The two-sided estimate of a recorded run, as a method that has one gives it.

use hoid_model::uncertainty::OperatorEstimate;

use crate::setup::Setup;

/// The causal run before it, and of which samples estimates are asked.
#[derive(Debug, Clone)]
pub struct Causal {
    /// Components of the recursion.
    pub setup: Setup,
    /// Magnitude beyond which a sample is a fault.
    pub largest: f64,
    /// The samples of which a trace has rows, ascending.
    pub rows: Vec<usize>,
    /// The operator at the end.
    pub last: Option<OperatorEstimate>,
}

/// Information of all of a run about the operator at one sample.
#[derive(Debug, Clone, PartialEq)]
pub struct TwoSided {
    /// The coefficients.
    pub theta: Vec<f64>,
    /// Their covariance, by rows.
    pub covariance: Vec<f64>,
    /// The operator.
    pub operator: OperatorEstimate,
    /// Innovation variance.
    pub innovation_variance: f64,
}
