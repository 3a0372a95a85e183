//! Simplified refined instrumental variable for `u = (B/F) q^-nk e + eps` (P. C. Young and A. J.
//! Jakeman, *Int. J. Control* 29 (1979) 1-30; P. C. Young, *Recursive Estimation and Time-Series
//! Analysis*, 2nd ed. 2011, ch. 6).
//!
//! The equation `F u = B q^-nk e + F eps` is filtered with 1/F of the previous iteration, so its noise is eps. The
//! estimate is also consistent for coloured eps; for white eps it has the smallest variance. The covariance takes the
//! estimated colour into account.

use hoid_model::Structure;

use crate::iv::{
    algorithm::{Algorithm, IterationLimits, IvSolution},
    columns::split_by_record,
    covariance::covariance,
    equation::IvProblem,
    final_iteration::NoiseModel,
    refined,
};
use crate::{IdentError, Reason, criterion::Criterion};

pub(super) const ALGORITHM: Algorithm = Algorithm {
    name: "sriv",
    help: "simplified refined instrumental variable",
    source: "Young 2011, chapter 6",
    structures: &[Structure::OutputError],
    solve,
};

fn solve(problem: &IvProblem<'_>, _: &Criterion<'_>, limits: IterationLimits) -> Result<IvSolution, IdentError> {
    let last = refined::iterate_to_convergence(limits, problem, |_| NoiseModel::default())?;
    let (poles, b) = last.system.split_at(problem.poles);
    let theta: Vec<f64> = b.iter().chain(poles).copied().collect();
    let covariance = (last.termination.reason != Reason::UnstableEstimate)
        .then(|| {
            let residual = split_by_record(&last.equation.residual(&last.system), &problem.row_counts(0));
            let in_order = |columns: &[Vec<f64>]| {
                let (poles, b) = columns.split_at(problem.poles);
                [b, poles].concat()
            };
            covariance(
                &in_order(&last.equation.z),
                &in_order(&last.equation.phi),
                |_| true,
                &residual,
            )
        })
        .flatten();
    Ok(IvSolution {
        theta,
        covariance,
        termination: last.termination,
    })
}
