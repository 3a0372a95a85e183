//! The true values of what is estimated.

use hoid_model::remnant::{RemnantDiscretisation, RemnantFilter};

use crate::{
    columns::OPERATOR,
    plan::{Cell, EstimatorCell, Task},
};

/// True value of a column of the table of fits, where it is known and does not change within the
/// span.
pub fn true_value(cell: &Cell, estimator: &EstimatorCell, name: &str) -> f64 {
    let scenario = cell.resolved.scenario();
    let (from, to) = match estimator.task {
        // A recursion ends in the last state.
        Task::Track(_) => (scenario.measurement_s, scenario.measurement_s),
        _ => estimator.span_s.unwrap_or((0.0, scenario.measurement_s)),
    };
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-2 * a.abs().max(b.abs());
    let [first, last] = [from, to].map(|t| cell.resolved.parameters_at(t).operator);
    if !close(first.k_e, last.k_e) || !close(first.t_l_s, last.t_l_s) {
        return f64::NAN;
    }
    let [before, after] = cell.truth();
    let state = if close(first.k_e_dot(), before.operator[2]) {
        before
    } else {
        after
    };
    if let Some(i) = OPERATOR.iter().position(|p| *p == name) {
        return state.operator[i];
    }
    let coefficient = match name {
        "tau_e" if close(first.tau_e_s, last.tau_e_s) => return last.tau_e_s,
        "tau_e" => return f64::NAN,
        "T_n" | "T_n_backward_euler" => return scenario.remnant.time_constant_s,
        "K_n" | "K_n_backward_euler" => return state.k_n,
        "f1" | "a1" => 0,
        "f2" | "a2" => 1,
        "b0" => 2,
        "b1" => 3,
        _ => return of_noise_model(cell, estimator, state.k_n, name),
    };
    if estimator.decimate > 1 {
        return f64::NAN;
    }
    state.discrete[coefficient]
}

/// Coefficients of D and the innovation variance of the remnant as it is held over each sample.
fn of_noise_model(cell: &Cell, estimator: &EstimatorCell, k_n: f64, name: &str) -> f64 {
    let remnant = cell.resolved.scenario().remnant;
    if estimator.decimate > 1 || !matches!(estimator.task, Task::Fit(_)) {
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
