//! JSON form of a trace, and of the state of a tracker at one time.

use hoid_ident::Fit;
use hoid_model::{
    NotConvertible, Record,
    remnant::RemnantDiscretisation,
    uncertainty::{Estimate, OperatorEstimate},
};
use hoid_track::{Change, Determination, FurtherOperator, NoCrossover, OpenLoop, Response, TrackFault};
use serde_json::{Map, Value, json};

use super::{PolynomialResult, envelope, estimate, loop_shape, number, operator, optional, orders};
use crate::{AnalysisError, settings::Setting, tracking::TrackingResult};

impl TrackingResult {
    /// Returns the JSON object as text.
    ///
    /// # Errors
    /// Same as [`TrackingResult::json`].
    pub fn to_json(&self) -> Result<String, AnalysisError> {
        Ok(format!("{:#}\n", Value::Object(self.json()?)))
    }

    /// Returns the JSON object.
    ///
    /// # Errors
    /// The errors of computing the goodness of fit of the start fit.
    pub fn json(&self) -> Result<Map<String, Value>, AnalysisError> {
        let trace = &self.trace;
        let counts = trace.counts();
        let mut map = envelope(
            "trace",
            &self.data.names,
            &self.data.records,
            &self.data.accounts,
            &self.verdict,
            &self.settings,
        );
        let mut set = |key: &str, value: Value| map.insert(key.to_owned(), value);
        set("method", json!(trace.options().method.name()));
        set("structure", json!(trace.options().structure.name()));
        set("orders", orders(&trace.options().orders));
        let start = match (trace.start(), &self.span) {
            (Some(fit), Some(span)) => self.start_json(fit, span)?,
            _ => Value::Null,
        };
        set("start", start);
        if let Some((file, choice)) = self.chosen_covariance() {
            let each = choice.candidates.iter();
            let candidates: Vec<Value> = each
                .map(|(p, vaf)| json!({ "covariance": number(*p), "vaf": number(*vaf) }))
                .collect();
            set(
                "covariance_choice",
                json!({
                    "file": file,
                    "from": number(choice.span_s.0),
                    "to": number(choice.span_s.1),
                    "covariance": number(choice.covariance),
                    "candidates": candidates,
                }),
            );
        }
        set("updated_from", number(trace.updated_from_s()));
        set("last", self.last_json());
        if let Some(channels) = self.channels_json() {
            set("channels", channels);
        }
        set("samples", json!(counts.samples));
        set("skipped", json!(counts.skipped));
        set("held", json!(counts.held));
        set("restarts", json!(counts.restarts));
        let faults = trace.faults().iter().map(track_fault);
        set("faults", Value::Array(faults.collect()));
        set("idle_head", number(trace.idle_s()));
        set("steps_shortened", json!(counts.shortened));
        if !trace.change_odds().is_empty() {
            let each = trace.changes().iter().map(|(t, c)| change(Some(*t), c));
            set("changes", Value::Array(each.collect()));
        }
        set("rows", json!(trace.len()));
        let none = self.unconverted_rows();
        set("rows_not_convertible", json!(none.rows));
        set("not_convertible_reason", json!(none.reason));
        if let Some((rows, reason)) = self.rows_without_crossover() {
            set("rows_without_crossover", json!(rows));
            set("no_crossover_reason", json!(reason.map(NoCrossover::as_text)));
        }
        let errors: Map<String, Value> = self
            .relative_errors()
            .into_iter()
            .map(|(name, e)| (name.to_owned(), number(e)))
            .collect();
        set("rms_relative_error", Value::Object(errors));
        Ok(map)
    }

    /// Returns the start fit in the JSON form of `identify`.
    fn start_json(&self, fit: &Fit, span: &Record) -> Result<Value, AnalysisError> {
        let records = std::slice::from_ref(span);
        let validation = fit.validate(span)?;
        let verdict = fit.verdict(records, self.choice.as_ref())?;
        let remnant = (fit.orders().nd > 0).then(|| fit.remnant(RemnantDiscretisation::ZeroOrderHold));
        let words = format!("{} to {}", span.time_s(0), span.time_s(span.len()));
        let answer = PolynomialResult {
            verdict: &verdict,
            files: &self.data.names,
            records,
            accounts: &self.data.accounts,
            fit,
            choice: self.choice.as_ref(),
            grey_box: None,
            quality: validation.quality,
            operator: fit.operator(),
            family: None,
            remnant,
            margins: None,
            validations: vec![validation],
            ahead: None,
            validation: None,
            settings: &[Setting::new("span in s", words)],
        };
        Ok(Value::Object(answer.object()))
    }

    /// Returns the two inputs of a model with a further input: their coefficients and responses in the last row.
    fn channels_json(&self) -> Option<Value> {
        let trace = &self.trace;
        let further = trace.options().further.as_ref()?;
        let row = trace.len().checked_sub(1)?;
        let own = further.names();
        let at = &trace.options().at_rad_s;
        let channel = |input: &str, role: &str, first: bool| {
            let all = trace.parameter_names().into_iter().zip(trace.parameters(row));
            let of_input = all.filter(|(name, _)| match first {
                true => name.starts_with(['b', 'f']) && !own.contains(name),
                false => own.contains(name),
            });
            let operator = trace.further_operator(row).filter(|_| !first);
            let parameter = |name: String, e: Estimate| {
                let standard_error = optional(e.standard_error);
                json!({"name": name, "value": number(e.value), "standard_error": standard_error})
            };
            let physical = operator.iter().flat_map(|found| {
                let determined = trace.further_determinations(found);
                let estimates = FurtherOperator::NAMES.into_iter().zip(found.parameters());
                estimates.zip(determined).map(move |((name, e), determined)| {
                    let mut whole = parameter(name.to_owned(), e);
                    whole["determined"] = json!(determined);
                    whole
                })
            });
            let parameters = of_input.map(|(name, e)| parameter(name, e)).chain(physical);
            let response = |place: usize, omega: f64| match first {
                true => trace.response(row, place),
                false => trace.further_response(row, omega),
            };
            json!({
                "input": input,
                "role": role,
                "form": null,
                "parameters": parameters.collect::<Vec<_>>(),
                "response": responses(at, response),
            })
        };
        let record = &self.data.records[0];
        let error = record.input_channel().map_or("e", |channel| channel.name.as_str());
        Some(json!([
            channel(error, "feedback", true),
            channel(&further.channel, further.role.name(), false),
        ]))
    }

    fn last_json(&self) -> Value {
        let trace = &self.trace;
        let Some(row) = trace.len().checked_sub(1) else {
            return Value::Null;
        };
        let names = trace.parameter_names();
        let parameters: Map<String, Value> = names
            .into_iter()
            .zip(trace.parameters(row))
            .map(|(name, e)| (name, estimate(&e)))
            .collect();
        let mut last = json!({
            "t": number(trace.times_s()[row]),
            "parameters": parameters,
            "operator": tracked_operator(&self.operators[row], |o| trace.determinations(o)),
            "response": responses(&trace.options().at_rad_s, |place, _| trace.response(row, place)),
            "innovation": number(trace.innovation()[row]),
            "innovation_variance": number(trace.innovation_variance()[row]),
        });
        if let Some(found) = trace.open_loop(row) {
            last["open_loop"] = open_loop(&found);
            if let (Value::Object(map), Some(shape), Ok(_)) = (&mut last["open_loop"], trace.loop_shape(), found) {
                map.extend(loop_shape(shape));
            }
        }
        last
    }
}

/// Returns the gain and phase at each of the frequencies in rad/s; null at a frequency without an estimate.
pub fn responses(at_rad_s: &[f64], of: impl Fn(usize, f64) -> Option<Response>) -> Value {
    let each = at_rad_s.iter().enumerate().map(|(place, omega)| {
        let response = of(place, *omega);
        json!({
            "omega_rad_s": omega,
            "gain_db": response.map(|r| estimate(&r.gain_db())),
            "phase_deg": response.map(|r| estimate(&r.phase_deg())),
        })
    });
    Value::Array(each.collect())
}

/// Returns the crossover and the phase margin of a recursion, or the reason why they do not exist.
pub fn open_loop(found: &Result<OpenLoop, NoCrossover>) -> Value {
    match found {
        Ok(found) => json!({
            "crossover_rad_s": estimate(&found.crossover_rad_s),
            "phase_margin_deg": estimate(&found.phase_margin_deg),
        }),
        Err(reason) => json!({"crossover_rad_s": null, "phase_margin_deg": null, "reason": reason.as_text()}),
    }
}

/// Returns the operator of a recursion; for each parameter it includes whether the data determine the parameter.
pub fn tracked_operator(
    found: &Result<OperatorEstimate, NotConvertible>,
    determined: impl Fn(&OperatorEstimate) -> Vec<Determination>,
) -> Value {
    let mut whole = operator(found);
    for (name, yes) in found.as_ref().map(determined).unwrap_or_default() {
        whole[name]["determined"] = json!(yes);
    }
    whole
}

/// Returns a fault span that the guard of a recursion found.
pub fn track_fault(fault: &TrackFault) -> Value {
    json!({
        "kind": fault.kind.name(),
        "channel": fault.channel.name(),
        "from": number(fault.from_s),
        "to": number(fault.to_s),
        "size": number(fault.size),
        "action": fault.action.name(),
    })
}

/// Returns a change in the person, with the time in s at which it was declared.
pub fn change(declared_at: Option<f64>, c: &Change) -> Value {
    let before_and_after = |pair: &[Estimate; 2]| json!({"before": estimate(&pair[0]), "after": estimate(&pair[1])});
    let numbers = |pair: &[f64; 2]| json!({"before": number(pair[0]), "after": number(pair[1])});
    let mut whole = json!({
        "t": optional(declared_at),
        "since": optional(declared_at.map(|t| t - c.seconds_ago)),
        "probability": number(c.probability()),
        "log_odds": number(c.odds),
        "changed": c.changed_quantities(),
        "K_e": before_and_after(&c.k_e),
        "K_e_dot": before_and_after(&c.k_e_dot),
        "omega_nm": before_and_after(&c.omega_nm_rad_s),
        "zeta_nm": before_and_after(&c.zeta_nm),
        "tau_e": before_and_after(&c.tau_e_s),
        "T_L": numbers(&c.t_l_s),
        "innovation_variance": numbers(&c.innovation_variance),
        "z": {
            "K_e": number(c.z[0]),
            "K_e_dot": number(c.z[1]),
            "omega_nm": number(c.z[2]),
            "zeta_nm": number(c.z[3]),
            "remnant": number(c.z[4]),
            "tau_e": number(c.z[5]),
        },
    });
    if let Some(further) = &c.further {
        let [before, after] = further.operators.map(|operator| operator.parameters());
        for (i, name) in FurtherOperator::NAMES.iter().enumerate() {
            whole[*name] = before_and_after(&[before[i], after[i]]);
            whole["z"][*name] = number(further.z[i]);
        }
    }
    whole
}
