//! JSON form of an operator whose gains change once.

use hoid_ident::{ChangedOperator, SigmoidFit, validation::whiteness};
use serde_json::{Map, Value, json};

use super::{
    envelope, estimate, ljung_box, number, operator as of_gain_and_lead, optional,
    result::{JsonFit, OPERATOR_KIND},
    termination,
};
use crate::{AnalysisError, identified::IdentifiedModel, registry};

impl JsonFit for SigmoidFit {
    const ESTIMATOR: &'static str = registry::CHANGE;

    fn object(found: &IdentifiedModel<Self>) -> Result<Map<String, Value>, AnalysisError> {
        let (fit, data) = (&found.fit, &found.data);
        let mut map = envelope(
            OPERATOR_KIND,
            &data.names,
            &data.records,
            &data.accounts,
            &found.verdict,
            &found.settings,
        );
        let mut set = |key: &str, value: Value| map.insert(key.to_owned(), value);
        let parameters = fit.parameters().into_iter().map(|p| {
            json!({
                "name": p.name,
                "value": number(p.estimate.value),
                "standard_error": optional(p.estimate.standard_error),
                "unit": p.unit,
                "remark": p.remark.map(|r| r.to_string()),
            })
        });
        let mut tests = Vec::new();
        for record in &data.records {
            let test = whiteness(&fit.residuals(record)?.values, fit.d().len());
            tests.push(json!({"ljung_box": ljung_box(test.as_ref())}));
        }
        let c = fit.comparison();
        let interval = |interval: Option<(f64, f64)>| interval.map_or(Value::Null, |(low, high)| json!([low, high]));
        set("structure", json!(OPERATOR_KIND));
        set("form", json!(fit.form().name()));
        set("neuromuscular", json!(fit.has_neuromuscular()));
        set("parameters", parameters.collect());
        set("loss", number(fit.loss()));
        set("innovation_variance", number(fit.innovation_variance()));
        set("termination", termination(&fit.termination()));
        set("start", json!(fit.start()));
        set("residuals", json!(fit.residual_count()));
        set("initial_states", json!(fit.state_count()));
        set(
            "change",
            json!({
                "found": fit.has_change(),
                "likelihood_ratio": number(c.likelihood_ratio),
                "extra_parameters": c.extra_parameters,
                "bic_difference": number(c.bic_difference),
                "t_M_interval": interval(fit.midpoint_interval()),
                "G_interval": interval(fit.rate_interval()),
            }),
        );
        set("residual_tests", Value::Array(tests));
        set("initial", operator(fit.initial_operator()));
        set("last", operator(fit.last_operator()));
        Ok(map)
    }
}

/// Returns the operator before or after the change as JSON.
fn operator(of: &ChangedOperator) -> Value {
    if let Some(lead) = of.operator_estimate() {
        return of_gain_and_lead(&Ok(lead));
    }
    let mut map = Map::new();
    map.insert("convertible".to_owned(), json!(true));
    map.insert("form".to_owned(), json!(of.operator.form().name()));
    for p in &of.parameters {
        map.insert(p.name.to_owned(), estimate(&p.estimate));
    }
    Value::Object(map)
}
