//! A system from refined instrumental variables, as a start for the prediction error method.
//!
//! The iteration of RIV-BJ ([`super::refined`]) is run with instruments from the measured input and an autoregressive
//! noise model, so it contains no search. It need not converge, because a start only has to be near the minimum. In an
//! open loop it is consistent for any noise. In a closed loop it is biased to the extent that the input follows the
//! noise, like every start based on the input alone.

use super::{
    algorithm::IterationLimits,
    equation::{IvProblem, Source},
    final_iteration::NoiseModel,
    refined::plain_iteration,
    simulation_error::simulation_error,
};
use crate::{criterion::Criterion, noise_model::noise_model};

/// Limits of the iteration; the tolerance is large, because a start need not be accurate.
const ITERATION_LIMITS: IterationLimits = IterationLimits {
    max_iterations: 30,
    tolerance: 1e-2,
};

/// Returns `[f_1 .., b_0 ..]`, estimated with an autoregressive noise model of order `nd`. `None` if the model has A or
/// no input, or if the data are not sufficient.
pub(crate) fn refined_system(criterion: &Criterion<'_>, nd: usize) -> Option<Vec<f64>> {
    let o = criterion.orders;
    if o.na > 0 || o.nb == 0 || o.nf == 0 {
        return None;
    }
    let problem = IvProblem::new(&o, criterion.data.clone(), Source::measured_inputs(&criterion.data));
    let needed = problem.first + nd + o.parameter_count() + o.nf;
    if criterion.data.iter().any(|d| d.u.len() <= needed) {
        return None;
    }
    let noise_of = |system: &[f64]| {
        let (poles, b) = system.split_at(problem.poles);
        let (c, d) = noise_model(&simulation_error(&[b, poles].concat(), criterion), 0, nd);
        NoiseModel { c, d }
    };
    Some(plain_iteration(ITERATION_LIMITS, &problem, noise_of).ok()?.system)
}
