//! What some comparators start from: the Box-Jenkins fit of the first span, as the recursive methods
//! do.

use hoid_ident::Estimator;
use hoid_model::{Structure, uncertainty::OperatorEstimate};

use super::comparator::Task;
use crate::ThesisError;

/// Operator and noise model of the first span.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start {
    /// The operator with its errors.
    pub operator: OperatorEstimate,
    /// b0, b1, d1, f1, f2.
    pub theta: [f64; 5],
    /// Variance of the innovation, deg^2.
    pub innovation_variance: f64,
}

impl Start {
    /// d1 of the noise model 1/(1 + d1 q^-1).
    pub fn d1(&self) -> f64 {
        self.theta[2]
    }

    /// The fit of BJ(nb = 2, nd = 1, nf = 2, nk) to the start span.
    pub fn of(task: &Task<'_>) -> Result<Self, ThesisError> {
        let (from_s, to_s) = task.start_s;
        let span = task.record.span(from_s, to_s)?;
        let estimator = Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(task.nk));
        let fit = estimator.fit(std::slice::from_ref(&span))?;
        Ok(Self {
            operator: fit.operator()?,
            theta: std::array::from_fn(|i| fit.model().theta()[i]),
            innovation_variance: fit.innovation_variance(),
        })
    }
}
