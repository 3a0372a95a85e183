//! A start for the prediction error method by a chain of instrumental variables (L. Ljung, *System Identification*, 1999, section
//! 10.6): ARX by least squares, instruments simulated with it, the IV estimate, instruments and estimate once more, the residual of
//! that system, a long autoregression of it, and C and D by regression on past residuals and past innovations.
//!
//! Consistent in an open loop for any noise; in a closed loop its poles are biased like those of ARX, but less. About ten passes
//! over the data.

use hoid_model::Orders;

use crate::{
    InitialState,
    prediction_error::{Criterion, Workspace, first_residual},
    search::Objective,
    starts::noise_model,
};

use super::equation::{Prefilter, Problem, Source};

/// Theta for the orders of the criterion; `None` where A and F are both there (the chain does not tell their poles apart), where
/// there is no input, and where the data do not carry it.
pub(crate) fn instrument_chain(criterion: &Criterion<'_>) -> Option<Vec<f64>> {
    let o = criterion.orders;
    if o.nb == 0 || (o.na > 0 && o.nf > 0) {
        return None;
    }
    let problem = Problem::new(&o, criterion.data.clone(), Source::measured(&criterion.data));
    let white_orders = Orders { nc: 0, nd: 0, ..o };
    let white = Criterion {
        orders: white_orders,
        initial: InitialState::Estimate,
        first: first_residual(&white_orders, InitialState::Estimate).max(problem.first),
        weights: None,
        ..criterion.clone()
    };
    let needed = white.first + 2 * o.parameters();
    if criterion.data.iter().any(|d| d.u.len() <= needed) {
        return None;
    }
    let mut system = problem.least_squares(Prefilter::default()).ok()?;
    for _ in 0..2 {
        let (stable, _) = problem.stabilised(&system).ok()?;
        let equation = problem.equation(Prefilter::default(), &stable);
        system = problem.solve(&equation).ok()?;
    }
    if o.nf > 0 {
        (system, _) = problem.stabilised(&system).ok()?;
    }
    let (poles, b) = system.split_at(problem.poles);
    let (a, f) = if o.na > 0 { (poles, &[][..]) } else { (&[][..], poles) };
    let mut workspace = Workspace::default();
    let left: Vec<Vec<f64>> = (0..white.data.len())
        .map(|record| white.residuals_of(&[a, b, f].concat(), record, &mut workspace))
        .collect();
    let (c, d) = noise_model(&left, o.nc, o.nd);
    let theta = [a, b, &c, &d, f].concat();
    criterion.is_feasible(&theta).then_some(theta)
}
