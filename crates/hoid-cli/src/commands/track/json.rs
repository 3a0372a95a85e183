//! A trace as JSON.

use hoid::analysis::Setting;
use hoid::ident::Fit;
use hoid::model::{Record, remnant::RemnantDiscretisation};
use hoid::track::NoCrossover;
use serde_json::{Map, Value, json};

use super::result::Tracked;
use crate::{
    error::CliError,
    json::{self, PolynomialAnswer, number},
};

impl Tracked<'_> {
    /// The object of the contract.
    ///
    /// # Errors
    /// Those of the quality of the start fit.
    pub fn to_json(&self) -> Result<Value, CliError> {
        let trace = self.trace;
        let counts = trace.counts();
        let mut map = json::envelope(
            "trace",
            std::slice::from_ref(&self.file),
            std::slice::from_ref(self.record),
            std::slice::from_ref(self.account),
            self.verdict,
            self.settings,
        );
        let mut set = |key: &str, value: Value| map.insert(key.to_owned(), value);
        set("method", json!(trace.options().method.name()));
        set("structure", json!(trace.options().structure.name()));
        set("orders", json::orders(&trace.options().orders));
        let start = match (trace.start(), &self.span) {
            (Some(fit), Some(span)) => self.start_json(fit, span)?,
            _ => Value::Null,
        };
        set("start", start);
        if let Some((file, choice)) = self.covariance {
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
        set("samples", json!(counts.samples));
        set("skipped", json!(counts.skipped));
        set("held", json!(counts.held));
        set("restarts", json!(counts.restarts));
        let faults = trace.faults().iter().map(json::track_fault);
        set("faults", Value::Array(faults.collect()));
        set("idle_head", number(trace.idle_s()));
        set("steps_shortened", json!(counts.shortened));
        if !trace.change_odds().is_empty() {
            let each = trace.changes().iter().map(|(t, c)| json::change(Some(*t), c));
            set("changes", Value::Array(each.collect()));
        }
        set("rows", json!(trace.len()));
        let none = self.not_converted();
        set("rows_not_convertible", json!(none.rows));
        set("not_convertible_reason", json!(none.reason));
        if let Some((rows, reason)) = self.without_crossover() {
            set("rows_without_crossover", json!(rows));
            set("no_crossover_reason", json!(reason.map(NoCrossover::words)));
        }
        let errors: Map<String, Value> = self
            .relative_errors()
            .into_iter()
            .map(|(name, e)| (name.to_owned(), number(e)))
            .collect();
        set("rms_relative_error", Value::Object(errors));
        set("trace", json!(self.out));
        Ok(Value::Object(map))
    }

    /// The start fit as `identify` gives it.
    fn start_json(&self, fit: &Fit, span: &Record) -> Result<Value, CliError> {
        let records = std::slice::from_ref(span);
        let validation = fit.validate(span)?;
        let verdict = fit.verdict(records, self.choice)?;
        let remnant = (fit.orders().nd > 0).then(|| fit.remnant(RemnantDiscretisation::ZeroOrderHold));
        let words = format!("{} to {}", span.time_s(0), span.time_s(span.len()));
        let answer = PolynomialAnswer {
            verdict: &verdict,
            files: std::slice::from_ref(&self.file),
            records,
            accounts: std::slice::from_ref(self.account),
            fit,
            choice: self.choice,
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

    fn last_json(&self) -> Value {
        let trace = self.trace;
        let Some(row) = trace.len().checked_sub(1) else {
            return Value::Null;
        };
        let names = trace.parameter_names();
        let parameters: Map<String, Value> = names
            .into_iter()
            .zip(trace.parameters(row))
            .map(|(name, e)| (name, json::estimate(&e)))
            .collect();
        let mut last = json!({
            "t": number(trace.times_s()[row]),
            "parameters": parameters,
            "operator": json::tracked_operator(&self.operators[row], |o| trace.determined(o)),
            "response": json::responses(&trace.options().at_rad_s, |place, _| trace.response(row, place)),
            "innovation": number(trace.innovation()[row]),
            "innovation_variance": number(trace.innovation_variance()[row]),
        });
        if let Some(found) = trace.open_loop(row) {
            last["open_loop"] = json::open_loop(&found);
            if let (Value::Object(map), Some(shape), Ok(_)) = (&mut last["open_loop"], trace.loop_shape(), found) {
                map.extend(json::loop_shape(shape));
            }
        }
        last
    }
}
