//! The true values of the estimated quantities.

use hoid_analysis::ResolvedRequest;
use hoid_model::{
    remnant::{RemnantDiscretisation, RemnantFilter},
    schedule::Schedule,
};

use crate::{
    columns::OPERATOR_PARAMETERS,
    plan::{Cell, EstimatorCell, Task},
};

/// Returns the true value of a column of the table of fits; NaN if it is unknown or changes within the span.
pub fn true_value(cell: &Cell, estimator: &EstimatorCell, name: &str) -> f64 {
    let scenario = cell.resolved.scenario();
    let (from, to) = match estimator.task {
        // The final estimate of a recursion is compared with the last state.
        Task::Track(_) => (scenario.measurement_s, scenario.measurement_s),
        _ => estimator.span_s.unwrap_or((0.0, scenario.measurement_s)),
    };
    if let Some(ResolvedRequest::Change(_)) = estimator.task.analysis() {
        return true_change_value(cell, name);
    }
    let [first, last] = [from, to].map(|t| cell.resolved.parameters_at(t).operator);
    if !is_close(first.k_e, last.k_e) || !is_close(first.t_l_s, last.t_l_s) {
        return f64::NAN;
    }
    let [before, after] = cell.true_states();
    let state = if is_close(first.k_e_dot(), before.operator[2]) {
        before
    } else {
        after
    };
    // The static gain K_e is also the true value of K, the name used by forms without a lead.
    let named = if name == "K" { "K_e" } else { name };
    if let Some(i) = OPERATOR_PARAMETERS.iter().position(|p| *p == named) {
        return state.operator[i];
    }
    let coefficient = match name {
        "tau_e" if is_close(first.tau_e_s, last.tau_e_s) => return last.tau_e_s,
        "tau_e" => return f64::NAN,
        "T_n" | "T_n_backward_euler" => return scenario.remnant.time_constant_s,
        "K_n" | "K_n_backward_euler" => return state.k_n,
        "f1" | "a1" => 0,
        "f2" | "a2" => 1,
        "b0" => 2,
        "b1" => 3,
        _ => return true_noise_model_value(cell, estimator, state.k_n, name),
    };
    if estimator.decimate > 1 {
        return f64::NAN;
    }
    state.discrete[coefficient]
}

fn is_close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-2 * a.abs().max(b.abs())
}

/// Returns a true value for an operator with changing gains: a parameter before (1) or after (2) the change, or the
/// time or rate of the change.
fn true_change_value(cell: &Cell, name: &str) -> f64 {
    let scenario = cell.resolved.scenario();
    let ends = cell.true_states();
    let constant = |of: [f64; 2]| if is_close(of[0], of[1]) { of[0] } else { f64::NAN };
    let index = |parameter: &str| OPERATOR_PARAMETERS.iter().position(|p| *p == parameter);
    let end = |digit| name.strip_suffix(digit).and_then(index);
    match (name, &scenario.schedule) {
        // An operator who changes back and forth does not match the model.
        (_, Schedule::Alternating { .. }) => f64::NAN,
        ("t_M", schedule) => schedule.change_s().unwrap_or(f64::NAN),
        ("G", schedule) => schedule.rate_per_s().unwrap_or(f64::NAN),
        ("tau_e", _) => constant([scenario.initial.operator.tau_e_s, scenario.last.operator.tau_e_s]),
        _ => match (end('1'), end('2'), index(name)) {
            (Some(i), _, _) => ends[0].operator[i],
            (_, Some(i), _) => ends[1].operator[i],
            (_, _, Some(i)) => constant(ends.map(|end| end.operator[i])),
            _ => f64::NAN,
        },
    }
}

/// Returns a coefficient of D or the innovation variance of the noise model of the remnant, which is held over each
/// sample.
fn true_noise_model_value(cell: &Cell, estimator: &EstimatorCell, k_n: f64, name: &str) -> f64 {
    let remnant = cell.resolved.scenario().remnant;
    let by_polynomials = matches!(estimator.task, Task::Fit(_))
        || matches!(estimator.task.analysis(), Some(ResolvedRequest::Polynomials(_)));
    if estimator.decimate > 1 || !by_polynomials {
        return f64::NAN;
    }
    let model = RemnantFilter::new(k_n, remnant.time_constant_s, remnant.order).and_then(|filter| {
        filter.noise_model(
            cell.resolved.scenario().sample_time,
            RemnantDiscretisation::ZeroOrderHold,
        )
    });
    let Ok(model) = model else { return f64::NAN };
    match (name, name.strip_prefix('d').and_then(|i| i.parse::<usize>().ok())) {
        ("innovation_variance", _) => model.innovation_sd * model.innovation_sd,
        (_, Some(i)) => model.d.get(i).copied().unwrap_or(f64::NAN),
        _ => f64::NAN,
    }
}
