//! A system by refined instrumental variables, as a start of the prediction error method.
//!
//! The iteration of RIV-BJ ([`super::refined`]) with instruments from the measured input and an autoregression as noise
//! model: it contains no search. It need not converge; a start only has to be near. It is consistent in an open loop
//! for any noise, and in a closed loop biased as far as the input follows the noise, like every start from the input
//! alone.

use super::{
    algorithm::IterationLimits,
    equation::{IvProblem, Source},
    last_iterate::NoiseModel,
    refined::plain_iteration,
    simulation_error::simulation_error,
};
use crate::{criterion::Criterion, noise_model::noise_model};

/// A start need not be nearer than this share of its standard errors.
const LIMITS: IterationLimits = IterationLimits {
    max_iterations: 30,
    tolerance: 1e-2,
};

/// Returns `[f_1 .., b_0 ..]` with an autoregression of order `nd` for the noise; `None` if the model has A, without an
/// input, and if the data are not sufficient.
pub(crate) fn refined_system(criterion: &Criterion<'_>, nd: usize) -> Option<Vec<f64>> {
    let o = criterion.orders;
    if o.na > 0 || o.nb == 0 || o.nf == 0 {
        return None;
    }
    let problem = IvProblem::new(&o, criterion.data.clone(), Source::measured(&criterion.data));
    let needed = problem.first + nd + o.parameters() + o.nf;
    if criterion.data.iter().any(|d| d.u.len() <= needed) {
        return None;
    }
    let noise_of = |system: &[f64]| {
        let (poles, b) = system.split_at(problem.poles);
        let (c, d) = noise_model(&simulation_error(&[b, poles].concat(), criterion), 0, nd);
        NoiseModel { c, d }
    };
    Some(plain_iteration(LIMITS, &problem, noise_of).ok()?.system)
}
