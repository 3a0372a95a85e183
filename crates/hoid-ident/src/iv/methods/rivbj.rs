//! Refined instrumental variable for `u = (B/F) q^-nk e + (C/D) eps` (P. C. Young, *Recursive
//! Estimation and Time-Series Analysis*, 2nd ed. 2011, ch. 7).
//!
//! The equation is filtered with `D/(C F)` of the previous iteration, so its noise is eps. In each iteration C and D
//! are estimated from an ARMA model of `u - (B/F) q^-nk e`, by the prediction error method or, with nc = 0, by least
//! squares.
//!
//! **Covariance.** B and F solve `Z' eps = 0`; C and D solve `psi' eps = 0`, where psi is the negative gradient of eps
//! for C and D. With both conditions stacked, `W = [Z, psi]`, and with the gradient psi_theta for all parameters, the
//! covariance is `sigma^2 (W' psi_theta)^-1 W' W (psi_theta' W)^-1`. In an open loop it separates into Young's
//! `sigma^2 (Z'Z)^-1` and the covariance of the ARMA model; in a closed loop the errors of the system also affect C and
//! D. If the order of the noise model is too low, the remaining colour of eps is taken into account for B and F.

use hoid_model::{Orders, Structure};

use crate::iv::{
    algorithm::{Algorithm, IterationLimits, IvSolution},
    covariance,
    equation::IvProblem,
    final_iteration::{LastIterate, NoiseModel},
    refined,
    simulation_error::simulation_error,
};
use crate::{
    IdentError, InitialState, Reason, SearchOptions,
    criterion::{Criterion, Data, Workspace, first_residual},
    noise_model::noise_model,
    optimize::minimise,
};

pub(super) const ALGORITHM: Algorithm = Algorithm {
    name: "rivbj",
    help: "refined instrumental variable",
    source: "Young 2011, chapter 7; Young 2015",
    structures: &[Structure::BoxJenkins],
    solve,
};

fn solve(
    problem: &IvProblem<'_>,
    criterion: &Criterion<'_>,
    limits: IterationLimits,
) -> Result<IvSolution, IdentError> {
    let mut noise_before: Option<NoiseModel> = None;
    let last = refined::iterate_to_convergence(limits, problem, |system| {
        let noise = estimate_noise_model(system, problem, criterion, noise_before.as_ref());
        noise_before = Some(noise.clone());
        noise
    })?;
    let (poles, b) = last.system.split_at(problem.poles);
    let theta = [b, &last.noise.c, &last.noise.d, poles].concat();
    let covariance = if last.termination.reason == Reason::UnstableEstimate {
        None
    } else {
        covariance(&theta, &last, problem, criterion)
    };
    Ok(IvSolution {
        theta,
        covariance,
        termination: last.termination,
    })
}

/// Returns C and D of the noise model for a system with stable F.
fn estimate_noise_model(
    system: &[f64],
    problem: &IvProblem<'_>,
    criterion: &Criterion<'_>,
    before: Option<&NoiseModel>,
) -> NoiseModel {
    let Orders { nc, nd, .. } = criterion.orders;
    if nc + nd == 0 {
        return NoiseModel::default();
    }
    let (poles, b) = system.split_at(problem.poles);
    let left = simulation_error(&[b, poles].concat(), criterion);
    let (c, d) = noise_model(&left, nc, nd);
    // An autoregression is a linear least-squares problem; an ARMA model with C needs a search.
    if nc == 0 {
        return NoiseModel { c, d };
    }
    let orders = Orders {
        na: nd,
        nc,
        ..Orders::default()
    };
    let arma = Criterion {
        orders,
        data: left.iter().map(|u| Data::new(&[], u)).collect(),
        initial: InitialState::Estimate,
        first: first_residual(&orders, InitialState::Estimate),
        weights: None,
        further: Vec::new(),
    };
    // The search starts from the noise model of the previous iteration and therefore stays at the same minimum;
    // otherwise the iteration might not converge.
    let start = before.map_or_else(|| [d.as_slice(), &c].concat(), |n| [n.d.as_slice(), &n.c].concat());
    match minimise(
        &arma,
        start,
        &SearchOptions::default(),
        None,
        &mut Workspace::borrow_from_thread(),
    ) {
        Some(minimum) => {
            let (d, c) = minimum.theta.split_at(nd);
            NoiseModel {
                c: c.to_vec(),
                d: d.to_vec(),
            }
        }
        None => NoiseModel { c, d },
    }
}

fn covariance(
    theta: &[f64],
    last: &LastIterate,
    problem: &IvProblem<'_>,
    criterion: &Criterion<'_>,
) -> Option<Vec<f64>> {
    let o = criterion.orders;
    let noise = o.nb..o.nb + o.nc + o.nd;
    // Only rows that are contained in both the equation and the residuals are used.
    let nd = o.nd;
    let first = (problem.first + nd).max(criterion.first);
    let mut workspace = Workspace::borrow_from_thread();
    let mut residual = Vec::new();
    let mut psi: Vec<Vec<f64>> = vec![Vec::new(); theta.len()];
    let mut w: Vec<Vec<f64>> = vec![Vec::new(); theta.len()];
    let mut end = 0;
    for (record, rows) in problem.row_counts(nd).into_iter().enumerate() {
        let eps = criterion.residuals_of(theta, record, &mut workspace);
        residual.push(eps[first - criterion.first..].to_vec());
        let gradient = criterion.jacobian(theta, record, &mut workspace);
        end += rows;
        let from = end - rows + (first - problem.first - nd);
        for (i, column) in gradient.iter().enumerate() {
            let column = &column[first - criterion.first..];
            psi[i].extend_from_slice(column);
            if noise.contains(&i) {
                w[i].extend_from_slice(column);
            } else {
                let z = if i < o.nb { problem.poles + i } else { i - noise.end };
                w[i].extend_from_slice(&last.equation.z[z][from..end]);
            }
        }
    }
    covariance::covariance(&w, &psi, |i| !noise.contains(&i), &residual)
}
