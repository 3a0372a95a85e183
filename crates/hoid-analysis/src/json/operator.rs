//! JSON form of the operator of a person: form, parameters with intervals, results of other methods, covariance.

use hoid_ident::{
    ResponsePoint,
    family::{
        AgreementMethod, AgreementPair, AgreementRow, ClusterKind, FamilyFit, FormFigures, LoopMeasures,
        OperatorOfRecord, Parameter,
    },
};
use hoid_model::{FamilyOperator, uncertainty::Estimate};
use serde_json::{Map, Value, json};

use super::{
    envelope, estimate_with_interval, goodness, loop_shape, named, number, optional, orders,
    result::{JsonFit, OPERATOR_KIND},
    termination,
};
use crate::{AnalysisError, identified::IdentifiedModel, registry};

/// Frequencies in rad/s at which the responses to several inputs are given.
const CHANNEL_FREQUENCIES: [f64; 16] = [
    0.3, 0.4, 0.5, 0.7, 1.0, 1.4, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0, 16.0,
];

impl JsonFit for FamilyFit {
    const ESTIMATOR: &'static str = registry::OPERATOR;

    fn object(found: &IdentifiedModel<Self>) -> Result<Map<String, Value>, AnalysisError> {
        let (fit, data) = (&found.fit, &found.data);
        let of = fit.operator(0);
        let mut map = envelope(
            OPERATOR_KIND,
            &data.names,
            &data.records,
            &data.accounts,
            &found.verdict,
            &found.settings,
        );
        let mut set = |key: &str, value: Value| map.insert(key.to_owned(), value);
        set("structure", json!(OPERATOR_KIND));
        set("form", json!(fit.form.name()));
        set("neuromuscular", json!(fit.neuromuscular));
        set("orders", orders(&of.polynomial_fit.orders()));
        set("parameters", of.parameters.iter().map(parameter).collect());
        if let Some(element) = &found.controlled_element {
            let mut found = open_loop(fit.loop_measures(0, element).as_ref());
            if let Some(map) = found.as_object_mut() {
                map.extend(loop_shape(&fit.loop_shape(0, element)));
            }
            set("open_loop", found);
        }
        set("loss", number(fit.loss));
        set("innovation_variance", number(fit.innovation_variance));
        set("residuals", json!(fit.residuals));
        set("termination", termination(&fit.termination));
        set(
            "intersample",
            json!({"used": fit.intersample.name(), "tau_e_if_straight": optional(fit.delay_if_linear_s(0))}),
        );
        let mut quality = goodness(&found.quality()?);
        quality.insert("coherent_share".to_owned(), optional(fit.coherent_share));
        set("fit", Value::Object(quality));
        set("operator", operator(of));
        if fit.operators.len() > 1 {
            set("operators", fit.operators.iter().map(operator).collect());
        }
        set("remnant", Value::Null);
        set("noise", json!({"c": fit.noise.0, "d": fit.noise.1}));
        if !fit.channels.is_empty() {
            set("channels", channels(found));
        }
        set("forms", fit.forms.iter().map(form_figures).collect());
        set("lines", lines(found));
        set("riv_bj", instrumental(found));
        set("agreement", agreement(found));
        set(
            "box_jenkins",
            fit.free_model.map_or(Value::Null, |free| {
                json!({
                    "loss": number(free.loss),
                    "likelihood_ratio": number(free.likelihood_ratio),
                    "degrees_of_freedom": free.degrees_of_freedom,
                    "p_value": number(free.p_value),
                })
            }),
        );
        set("covariance", covariance(&of.operator, of.covariance.as_deref()));
        set(
            "errors",
            json!({
                "clusters": fit.clusters,
                "kind": match fit.cluster_kind {
                    ClusterKind::Runs => "runs",
                    ClusterKind::Blocks => "blocks",
                },
                "inflation": number(fit.inflation),
                "largest_ratio_to_model_based": optional(fit.error_ratio),
                "model_based": covariance(&of.operator, of.model_based.as_deref()),
            }),
        );
        let prior = fit.prior.entries().iter();
        set(
            "prior",
            prior
                .map(|e| json!({"parameter": e.parameter, "centre": e.centre, "spread": e.spread, "source": e.source}))
                .collect(),
        );
        set("candidates", json!([]));
        Ok(map)
    }
}

/// Returns the responses to all inputs, the response to the error first.
fn channels(found: &IdentifiedModel) -> Value {
    let fit = &found.fit;
    let sampling = (fit.sample_time, fit.intersample);
    let error = found.data.records[0]
        .input_channel()
        .map_or("e", |channel| channel.name.as_str());
    let feedback = json!({
        "input": error,
        "role": "feedback",
        "form": fit.form.name(),
        "parameters": fit.operator(0).parameters.iter().map(parameter).collect::<Vec<_>>(),
        "response": response(&fit.frequency_response(0, &CHANNEL_FREQUENCIES)),
    });
    let further = fit.channels.iter().map(|channel| {
        let of = channel.response.as_ref();
        json!({
            "input": channel.name,
            "role": channel.role.name(),
            "preview": number(channel.preview_s),
            "form": of.map(|of| of.operator.form().name()),
            "parameters": of.map(|of| of.parameters.iter().map(parameter).collect::<Vec<_>>()),
            "response": channel.frequency_response(&CHANNEL_FREQUENCIES, sampling).map(|all| response(&all)),
            "p_value": number(channel.p_value),
            "forms": channel.forms.iter().map(|form| json!({
                "form": form.form.map(|form| form.name()),
                "loss": optional(form.loss),
                "criterion": optional(form.criterion),
            })).collect::<Vec<_>>(),
        })
    });
    std::iter::once(feedback).chain(further).collect()
}

/// Returns the gains and phases with their errors, in the format of the lines of a describing function.
pub(crate) fn response(points: &[ResponsePoint]) -> Value {
    let one = |p: &ResponsePoint| {
        json!({
            "omega_rad_s": number(p.omega_rad_s),
            "gain_db": number(p.magnitude_db.value),
            "gain_se_db": optional(p.magnitude_db.standard_error),
            "phase_deg": number(p.phase_deg.value),
            "phase_se_deg": optional(p.phase_deg.standard_error),
        })
    };
    points.iter().map(one).collect()
}

fn lines(found: &IdentifiedModel) -> Value {
    let Some(lines) = &found.fit.lines else {
        return reason_or_null(found.fit.no_lines.as_ref());
    };
    let mut map = Map::new();
    map.insert("parameters".to_owned(), named_estimates(&lines.parameters()));
    map.insert("chi2".to_owned(), number(lines.chi_squared));
    map.insert("degrees_of_freedom".to_owned(), json!(lines.degrees_of_freedom));
    map.insert("held_out".to_owned(), optional(lines.held_out_total()));
    map.insert("converged".to_owned(), json!(lines.termination.converged()));
    if let Some(element) = &found.controlled_element {
        let measures = found.fit.loop_measures_at_lines(element);
        map.insert("open_loop".to_owned(), open_loop(measures.as_ref()));
    }
    Value::Object(map)
}

fn instrumental(found: &IdentifiedModel) -> Value {
    let Some(of) = &found.fit.instrumental else {
        return reason_or_null(found.fit.no_instrumental.as_ref());
    };
    let mut map = Map::new();
    map.insert("parameters".to_owned(), named_estimates(&of.parameters()));
    map.insert("nd".to_owned(), json!(of.noise_order));
    map.insert("converged".to_owned(), json!(of.termination.converged()));
    map.insert("termination".to_owned(), json!(of.termination.to_string()));
    if let Some(element) = &found.controlled_element {
        let measures = found.fit.loop_measures_by_instruments(element);
        map.insert("open_loop".to_owned(), open_loop(measures.as_ref()));
    }
    Value::Object(map)
}

fn agreement(found: &IdentifiedModel) -> Value {
    found.fit.agreement.as_ref().map_or(Value::Null, |agreement| {
        let row = |r: &AgreementRow| {
            let mut map = Map::new();
            map.insert("coordinate".to_owned(), json!(r.coordinate.name()));
            for method in [
                AgreementMethod::PredictionError,
                AgreementMethod::Lines,
                AgreementMethod::Instrumental,
            ] {
                let pair = r.of(method).map_or(
                    Value::Null,
                    |(value, error)| json!({"value": number(value), "standard_error": number(error)}),
                );
                map.insert(method.name().to_owned(), pair);
            }
            map.insert("difference_in_errors".to_owned(), number(r.difference_in_errors));
            Value::Object(map)
        };
        let pair = |pair: &AgreementPair| {
            json!({
                "methods": [pair.methods.0.name(), pair.methods.1.name()],
                "chi2": number(pair.statistic),
                "p_value": number(pair.p_value),
            })
        };
        json!({
            "coordinates": agreement.rows.iter().map(row).collect::<Vec<_>>(),
            "pairs": agreement.pairs.iter().map(pair).collect::<Vec<_>>(),
            "chi2": number(agreement.statistic),
            "p_value": number(agreement.p_value),
        })
    })
}

/// Returns the reason why a method gave no result, or null.
fn reason_or_null(reason: Option<&String>) -> Value {
    reason.map_or(Value::Null, |why| json!({"reason": why}))
}

/// Returns named estimates in the order of the parameters of the form.
fn named_estimates(parameters: &[(&'static str, Estimate)]) -> Value {
    parameters.iter().map(|(name, e)| named(name, e)).collect()
}

fn parameter(p: &Parameter) -> Value {
    json!({
        "name": p.name,
        "unit": p.unit,
        "value": number(p.value),
        "standard_error": optional(p.standard_error),
        "standard_error_person": optional(p.standard_error_person),
        "interval": p.interval.map_or(Value::Null, |(low, high)| json!([number(low), number(high)])),
        "prior_share": number(p.prior_share),
        "determined": p.determined,
        "averaged_over": p.averaged_over.iter().map(|form| form.name()).collect::<Vec<_>>(),
    })
}

/// Returns the operator with the names of its parameters as keys.
fn operator(of: &OperatorOfRecord) -> Value {
    let mut map = Map::new();
    map.insert("convertible".to_owned(), json!(true));
    map.insert("form".to_owned(), json!(of.operator.form().name()));
    for p in &of.parameters {
        let mut value = parameter(p);
        if let Some(fields) = value.as_object_mut() {
            fields.shift_remove("name");
        }
        map.insert(p.name.clone(), value);
    }
    Value::Object(map)
}

fn open_loop(found: Option<&LoopMeasures>) -> Value {
    let of = |estimate: Estimate, interval: Option<(f64, f64)>, of_person: Option<f64>| {
        let mut value = estimate_with_interval(&estimate, interval);
        if let Some(fields) = value.as_object_mut() {
            fields.insert("standard_error_person".to_owned(), optional(of_person));
        }
        value
    };
    json!({
        "crossover_rad_s": found.map(|m| of(m.crossover_rad_s, m.crossover_interval, m.of_person[0])),
        "phase_margin_deg": found.map(|m| of(m.phase_margin_deg, m.phase_margin_interval, m.of_person[1])),
    })
}

fn form_figures(f: &FormFigures) -> Value {
    json!({
        "form": f.form.name(),
        "weight": number(f.weight),
        "loss": optional(f.loss),
        "criterion": optional(f.criterion),
        "held_out": optional(f.held_out),
        "chi2": optional(f.chi_squared),
        "degrees_of_freedom": f.degrees_of_freedom,
        "converged": f.converged,
    })
}

/// Returns the coordinates with their names and the rows of their covariance matrix.
fn covariance(operator: &FamilyOperator, covariance: Option<&[f64]>) -> Value {
    let coordinates = operator.form().coordinates(operator.has_neuromuscular());
    let p = coordinates.len();
    let names: Vec<&str> = coordinates.iter().map(|c| c.name()).collect();
    covariance.map_or(Value::Null, |c| {
        let rows: Vec<Vec<Value>> = c
            .chunks(p)
            .map(|row| row.iter().map(|v| number(*v)).collect())
            .collect();
        json!({"coordinates": names, "values": operator.coordinates(), "matrix": rows})
    })
}
