//! The tables of the page as template values. A missing number is shown as a dash, with the reason next to it.

use hoid_ident::{
    Choice, Fit, InitialState, MarginEstimates,
    order_selection::Criterion,
    validation::{GoodnessOfFit, Validation},
};
use hoid_model::{GainUnit, OperatorParameters, Record, remnant::RemnantDiscretisation};
use minijinja::{Value, context};

use crate::{
    cells::{cell, html, record_name, symbol},
    model_section::ModelSection,
    numbers::{DASH, Z_95, format_fixed, format_plain, interval, with_uncertainty},
};

/// Maximum number of candidates in a table.
const MAX_CANDIDATES: usize = 30;

fn true_value(name: &str, truth: &OperatorParameters) -> Option<f64> {
    Some(match name {
        "K_e" => truth.k_e,
        "T_L" => truth.t_l_s,
        "K_e_dot" => truth.k_e_dot(),
        "omega_nm" => truth.omega_nm_rad_s,
        "zeta_nm" => truth.zeta_nm,
        "tau_e" => truth.tau_e_s,
        _ => return None,
    })
}

const OPERATOR_NAMES: [&str; 6] = ["K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm", "tau_e"];

/// Comparison of the models: one column per model, one row per quantity.
pub fn comparison(models: &[ModelSection<'_>], qualities: &[Result<GoodnessOfFit, String>]) -> Value {
    let row = |label: Value, unit: &str, cells: Vec<Value>, truth: Option<String>| {
        context! { label, unit, cells, truth => truth.unwrap_or_default() }
    };
    let unit = common_output_unit(models);
    let each = |f: &dyn Fn(&Fit) -> f64| -> Vec<Value> {
        models.iter().map(|m| Value::from(format_plain(f(m.fit)))).collect()
    };
    let criterion = |f: &dyn Fn(&Fit) -> f64| -> Vec<Value> {
        models.iter().map(|m| Value::from(format_fixed(f(m.fit), 1))).collect()
    };
    let mut rows = vec![row(html("loss <i>V</i>"), &squared_unit(&unit), each(&Fit::loss), None)];
    type Part = fn(&GoodnessOfFit) -> f64;
    let percentages: [(&str, Part); 4] = [
        ("VAF, simulation<sup>1</sup>", |q| q.vaf_simulation),
        ("VAF, prediction<sup>1</sup>", |q| q.vaf_prediction),
        ("NRMSE fit, simulation<sup>2</sup>", |q| q.nrmse_simulation),
        ("NRMSE fit, prediction<sup>2</sup>", |q| q.nrmse_prediction),
    ];
    for (label, of) in percentages {
        let cells = qualities
            .iter()
            .map(|q| match q {
                Ok(q) => Value::from(format_fixed(of(q), 2)),
                Err(_) => Value::from(DASH),
            })
            .collect();
        rows.push(row(html(label), "%", cells, None));
    }
    rows.push(row(Value::from("AIC"), "-", criterion(&Fit::aic), None));
    rows.push(row(Value::from("BIC"), "-", criterion(&Fit::bic), None));
    let operators: Vec<_> = models.iter().map(|m| m.fit.operator()).collect();
    let truth = common_truth(models);
    let gain = models.first().map(|m| gain_unit(m.records)).unwrap_or_default();
    for (i, name) in OPERATOR_NAMES.into_iter().enumerate() {
        let cells = operators
            .iter()
            .map(|o| match o {
                Ok(o) => cell(o.rows()[i].2),
                Err(_) => Value::from(DASH),
            })
            .collect();
        let (label, unit) = symbol(name);
        let unit = gain.unit(name, unit);
        let truth = truth.and_then(|t| true_value(name, &t)).map(format_plain);
        rows.push(row(label, &unit, cells, truth));
    }
    let mut remarks: Vec<String> = Vec::new();
    for ((model, operator), quality) in models.iter().zip(&operators).zip(qualities) {
        if let Err(reason) = operator {
            remarks.push(format!("{}: not convertible: {reason}", model.name));
        }
        if let Err(reason) = quality {
            remarks.push(format!("{}: no VAF and NRMSE: {reason}", model.name));
        }
        if model.fit.loss() == 0.0 {
            remarks.push(format!("{}: no AIC and BIC: the loss is zero", model.name));
        }
    }
    let several = models.iter().any(|m| m.records.len() > 1);
    context! {
        names => models.iter().map(|m| m.name.clone()).collect::<Vec<_>>(),
        has_truth => truth.is_some(),
        rows, remarks, several,
    }
}

/// The true operator, if it is the same for all models for which it is known; otherwise `None`.
fn common_truth(models: &[ModelSection<'_>]) -> Option<OperatorParameters> {
    let mut known = models.iter().filter_map(|m| m.truth);
    let first = known.next()?;
    known.all(|t| t == first).then_some(first)
}

fn output_unit(records: &[Record]) -> String {
    records
        .first()
        .map(|r| r.output_channel().unit.clone())
        .unwrap_or_default()
}

/// The unit of the outputs, if it is the same for all models; otherwise empty.
fn common_output_unit(models: &[ModelSection<'_>]) -> String {
    let first = models.first().map(|m| output_unit(m.records)).unwrap_or_default();
    if models.iter().all(|m| output_unit(m.records) == first) {
        first
    } else {
        String::new()
    }
}

fn squared_unit(unit: &str) -> String {
    match unit {
        "" => "-".to_owned(),
        u if u.chars().all(char::is_alphanumeric) => format!("{u}\u{b2}"),
        u => format!("({u})\u{b2}"),
    }
}

/// Returns the name, value, standard error and 95 % interval of each coefficient of a fit.
pub fn coefficients(fit: &Fit) -> Vec<Value> {
    let rows = fit.parameters().into_iter().map(|(name, estimate)| {
        let (value, error) = with_uncertainty(estimate.value, estimate.standard_error);
        let name = if fit.is_grey_box() {
            Value::from(name)
        } else {
            let (letter, index) = name.split_at(1);
            html(format!("<i>{letter}</i><sub>{index}</sub>"))
        };
        context! { name, value, error, interval => interval(estimate.value, estimate.standard_error, Z_95) }
    });
    rows.collect()
}

/// The parameters of the operator, or the reason why the model cannot be converted to an operator.
pub fn operator(fit: &Fit, truth: Option<&OperatorParameters>, gain: &GainUnit) -> Value {
    let estimate = match fit.operator() {
        Ok(estimate) => estimate,
        Err(reason) => return context! { reason => reason.to_string() },
    };
    let rows: Vec<Value> = estimate
        .rows()
        .into_iter()
        .map(|(name, _, e)| {
            let (label, unit) = symbol(name);
            let unit = gain.unit(name, unit);
            let (value, error) = with_uncertainty(e.value, e.standard_error);
            let truth = truth.and_then(|t| true_value(name, t));
            let relative = truth.map(|t| 100.0 * (e.value / t - 1.0));
            context! {
                label, unit, value, error,
                interval => interval(e.value, e.standard_error, Z_95),
                truth => truth.map(format_plain),
                relative => relative.map(|r| if r.is_finite() { format!("{r:+.1}") } else { DASH.to_owned() }),
            }
        })
        .collect();
    context! { rows, has_truth => truth.is_some() }
}

/// The units of the gains, derived from the units of the first record.
pub fn gain_unit(records: &[Record]) -> GainUnit {
    records.first().map(GainUnit::of).unwrap_or_default()
}

/// T_n and K_n for each discretisation, or the reason why they cannot be computed.
pub fn remnant(fit: &Fit) -> Vec<Value> {
    let ways = [
        (
            RemnantDiscretisation::ZeroOrderHold,
            "zero-order hold (exact for noise held over each sample)",
        ),
        (RemnantDiscretisation::BackwardEuler, "backward Euler"),
    ];
    // The hold of the remnant is part of a grey-box model.
    let count = if fit.is_grey_box() { 1 } else { ways.len() };
    let rows = ways.into_iter().take(count).map(|(how, name)| match fit.remnant(how) {
        Ok(r) => context! { how => name, order => r.order, t_n => cell(r.t_n_s), k_n => cell(r.k_n) },
        Err(reason) => context! { how => name, reason => reason.to_string() },
    });
    rows.collect()
}

/// The reason why no discretisation gives T_n and K_n, if it is the same for all discretisations.
pub fn missing_remnant_reason(fit: &Fit) -> Option<String> {
    if fit.orders().nd == 0 {
        return Some("the model has no polynomial D".to_owned());
    }
    let reason = |how| fit.remnant(how).err().map(|e| e.to_string());
    let first = reason(RemnantDiscretisation::ZeroOrderHold)?;
    (reason(RemnantDiscretisation::BackwardEuler)? == first).then_some(first)
}

/// Describes how the fit was computed, as pairs of label and text.
pub fn computation_rows(fit: &Fit, records: &[Record]) -> Vec<Value> {
    let end = fit.termination();
    let (n, p, s) = (fit.residual_count(), fit.free_count(), fit.state_count());
    let unit = output_unit(records);
    let divisor = n.saturating_sub(p + s);
    let initial = match fit.initial_state() {
        InitialState::Zero => "input, output and innovations are zero before each record".to_owned(),
        InitialState::Estimate if s == 0 => {
            "conditional on the first samples of each record; no initial states are needed".to_owned()
        }
        InitialState::Estimate => format!("estimated with the parameters, {s} in total"),
        InitialState::Backcast if s == 0 => "backcast: the noise was stationary before each record".to_owned(),
        InitialState::Backcast => {
            format!(
                "backcast: the noise was stationary before each record; {s} states of the response to the input were \
                 estimated"
            )
        }
    };
    let steps = match end.iterations {
        1 => "1 step".to_owned(),
        n => format!("{n} steps"),
    };
    let rows = [
        (
            "model",
            format!("{}({})", fit.model().structure().label(), fit.orders()),
        ),
        ("end of the search", format!("{}; {steps}", end.reason)),
        ("best start", fit.start().to_owned()),
        ("initial states", initial),
        (
            "innovation variance",
            format!(
                "\u{3c3}\u{b2} = {} {}, the sum of squared residuals divided by n - p - s = {n} - {p} - {s} = \
                 {divisor} (residuals, parameters, initial states)",
                format_plain(fit.innovation_variance()),
                squared_unit(&unit)
            ),
        ),
        (
            "loss",
            format!(
                "V = {} {}, the same sum divided by n = {n}",
                format_plain(fit.loss()),
                squared_unit(&unit)
            ),
        ),
    ];
    rows.into_iter().map(|(label, text)| context! { label, text }).collect()
}

/// VAF and NRMSE for each record.
pub fn quality_rows(records: &[Record], validations: &[Result<Validation, String>]) -> Vec<Value> {
    let rows = records
        .iter()
        .zip(validations)
        .enumerate()
        .map(|(i, (record, validation))| {
            let label = record_name(record, i);
            match validation {
                Ok(v) => context! {
                    label, samples => record.len(),
                    vaf_simulation => format_fixed(v.quality.vaf_simulation, 2),
                    vaf_prediction => format_fixed(v.quality.vaf_prediction, 2),
                    nrmse_simulation => format_fixed(v.quality.nrmse_simulation, 2),
                    nrmse_prediction => format_fixed(v.quality.nrmse_prediction, 2),
                },
                Err(reason) => context! { label, samples => record.len(), reason },
            }
        });
    rows.collect()
}

/// Margins of the loop with the controlled element.
pub fn margins(margins: &MarginEstimates) -> Vec<Value> {
    let rows = [
        (
            "gain crossover",
            "rad/s",
            margins.crossover_rad_s,
            "the magnitude does not cross 1",
        ),
        (
            "phase margin",
            "deg",
            margins.phase_margin_deg,
            "there is no gain crossover",
        ),
        (
            "phase crossover",
            "rad/s",
            margins.phase_crossover_rad_s,
            "the phase does not cross -180 deg",
        ),
        (
            "gain margin",
            "dB",
            margins.gain_margin_db,
            "there is no phase crossover",
        ),
    ];
    let rows = rows.into_iter().map(|(label, unit, value, without)| match value {
        Some(e) if e.value.is_finite() => {
            let (value, error) = with_uncertainty(e.value, e.standard_error);
            let value = match e.standard_error {
                Some(_) => format!("{value} (standard error {error})"),
                None => format_plain(e.value),
            };
            context! { label, unit, value }
        }
        _ => context! { label, unit, value => DASH, reason => format!("{without} in the range scanned") },
    });
    rows.collect()
}

/// Candidates of an order search, with the best first.
pub fn candidates(choice: &Choice) -> Value {
    let name = choice.criterion.label();
    let mut fitted = Vec::new();
    let mut failed = Vec::new();
    for candidate in &choice.candidates {
        match &candidate.outcome {
            Ok(f) => {
                fitted.push((f.value(choice.criterion), candidate.orders, *f));
            }
            Err(reason) => failed.push((candidate.orders, reason.to_string())),
        }
    }
    // The sort is stable: equal candidates stay in the order of the search.
    fitted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let best = fitted.first().map_or(0.0, |f| f.0);
    let all = fitted.len() + failed.len();
    let decimals = |value: f64| match choice.criterion {
        Criterion::Loss | Criterion::Fpe | Criterion::Mdl => format_plain(value),
        _ => format_fixed(value, 1),
    };
    let rows: Vec<Value> = fitted
        .iter()
        .map(|(value, orders, f)| {
            context! {
                orders => orders.to_string(), parameters => orders.parameter_count(),
                loss => format_plain(f.loss), aic => format_fixed(f.aic, 1), bic => format_fixed(f.bic, 1),
                above => decimals(value - best),
                remark => if f.converged { "" } else { "search did not converge" },
            }
        })
        .chain(failed.iter().map(|(orders, reason)| {
            context! {
                orders => orders.to_string(), parameters => orders.parameter_count(),
                loss => DASH, aic => DASH, bic => DASH, above => DASH, remark => reason,
            }
        }))
        .take(MAX_CANDIDATES)
        .collect();
    let more = all - rows.len();
    context! { criterion => name, rows, more, all }
}
