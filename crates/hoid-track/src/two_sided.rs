//! The two-sided estimate of a recorded run, for methods that compute one.

use hoid_model::uncertainty::OperatorEstimate;

use crate::setup::Setup;

/// The causal run, and the samples at which two-sided estimates are needed.
#[derive(Debug, Clone)]
pub struct CausalRun {
    /// Components of the recursion.
    pub setup: Setup,
    /// Magnitude of e or u beyond which a sample counts as faulty.
    pub largest: f64,
    /// Indices of the samples at which a trace has rows, in ascending order.
    pub rows: Vec<usize>,
    /// The operator at the end of the causal run.
    pub last: Option<OperatorEstimate>,
}

/// The operator at one sample, estimated from the whole run.
#[derive(Debug, Clone, PartialEq)]
pub struct TwoSidedEstimate {
    /// The coefficients.
    pub theta: Vec<f64>,
    /// Covariance of the coefficients, by rows.
    pub covariance: Vec<f64>,
    /// The operator.
    pub operator: OperatorEstimate,
    /// Innovation variance.
    pub innovation_variance: f64,
}
