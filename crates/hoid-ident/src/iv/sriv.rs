//! Simplified refined instrumental variable for `u = (B/F) q^-nk e + eps` (P. C. Young and A. J. Jakeman, *Int. J. Control* 29 (1979)
//! 1-30; P. C. Young, *Recursive Estimation and Time-Series Analysis*, 2nd ed. 2011, ch. 6).
//!
//! The equation `F u = B q^-nk e + F eps` is filtered with 1/F of the iteration before, which makes its noise eps again. Consistent
//! for coloured eps as well, of the smallest variance for white eps; the covariance is that of the colour found.

use crate::IdentError;

use super::{
    InstrumentalVariable, Solution,
    equation::{self, Problem, cut},
    refined::{self, Noise},
};
use crate::Reason;

pub(super) fn solve(settings: &InstrumentalVariable, problem: &Problem<'_>) -> Result<Solution, IdentError> {
    let rest = refined::iterate(settings, problem, |_| Noise::default())?;
    let (poles, b) = rest.system.split_at(problem.poles);
    let theta: Vec<f64> = b.iter().chain(poles).copied().collect();
    let covariance = (rest.termination.reason != Reason::UnstableEstimate)
        .then(|| {
            let residual = cut(&rest.equation.residual(&rest.system), &problem.rows(0));
            let in_order = |columns: &[Vec<f64>]| {
                let (poles, b) = columns.split_at(problem.poles);
                [b, poles].concat()
            };
            equation::covariance(
                &in_order(&rest.equation.z),
                &in_order(&rest.equation.phi),
                |_| true,
                &residual,
            )
        })
        .flatten();
    Ok(Solution {
        theta,
        covariance,
        termination: rest.termination,
    })
}
