//! Conversion of results to JSON objects, the interface to other programs, and back.
//!
//! All results have the same envelope: `hoid` (the version), `kind`, `records`, `data` (faults and warnings of the
//! records), `settings` (the value of each setting, and whether the user gave it) and `verdict`; the other keys depend
//! on the kind. The complete state of a batch fit, with which it can predict again without its recordings, is in
//! `state` ([`state`]). The objects are values of `serde_json`, which keep the order of keys.
//!
//! | file | kind |
//! |---|---|
//! | `operator` | `operator`: operator of a person in the form that the evidence supports |
//! | `change` | `operator`: operator whose gains change once |
//! | `description` | `description`: describing function |
//! | `polynomials` | `polynomial`; `operator` with a remnant of order m, which is written by means of its polynomials |
//! | `trace` | `trace`: estimates of a recursion over a recording |
//! | `result` | the parts common to all kinds; conversion to text and back |

mod change;
mod description;
mod operator;
mod polynomials;
mod result;
pub mod state;
mod trace;

use hoid_ident::{
    MarginEstimates, Termination,
    family::LoopShape,
    validation::{GoodnessOfFit, LjungBox},
};
use hoid_model::{
    NotConvertible, Orders, Record, Verdict,
    margins::{Crossing, Crossings},
    uncertainty::{Estimate, OperatorEstimate},
};
use serde::Serialize;
use serde_json::{Map, Value, json};

pub(crate) use operator::response;
pub use polynomials::{PolynomialResult, family_json};
pub use result::{BatchResult, JsonFit};
pub use trace::{change, open_loop, responses, track_fault, tracked_operator};

use crate::{fault_findings::FoundFault, recordings::Account, settings::Setting};

/// Returns the envelope of a result: version, kind, verdict, records, their faults and warnings, settings.
pub fn envelope(
    kind: &str,
    files: &[String],
    of_records: &[Record],
    accounts: &[Account],
    verdict_of: &Verdict,
    settings_of: &[Setting],
) -> Map<String, Value> {
    let records = records(files, of_records, accounts);
    let data = json!({"faults": faults(files, accounts), "warnings": warnings(files, accounts)});
    envelope_of_parts(kind, records, &data, verdict_of, settings_of)
}

/// Returns the envelope of a result whose records and their faults are already JSON.
pub fn envelope_of_parts(
    kind: &str,
    records: Value,
    data: &Value,
    verdict_of: &Verdict,
    settings_of: &[Setting],
) -> Map<String, Value> {
    let all = [
        ("hoid", json!(env!("CARGO_PKG_VERSION"))),
        ("kind", json!(kind)),
        ("verdict", verdict(verdict_of)),
        ("records", records),
        ("data", data.clone()),
        // Earlier keys, kept for one release.
        ("warnings", data["warnings"].clone()),
        ("faults", data["faults"].clone()),
        ("settings", settings(settings_of)),
    ];
    all.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

/// Returns the settings, each with its value and whether the user gave it.
pub fn settings(all: &[Setting]) -> Value {
    all.iter()
        .map(|one| json!({"name": one.name, "value": one.value, "given": one.is_given}))
        .collect()
}

/// Returns a number, or null for a number that is not finite, since JSON has no NaN or infinity.
pub fn number(value: f64) -> Value {
    serde_json::Number::from_f64(value).map_or(Value::Null, Value::Number)
}

/// Returns a number, or null for `None`.
pub fn optional(value: Option<f64>) -> Value {
    value.map_or(Value::Null, number)
}

/// Returns an estimate with its standard error.
pub fn estimate(e: &Estimate) -> Value {
    json!({"value": number(e.value), "standard_error": optional(e.standard_error)})
}

/// Returns an estimate with its standard error and its 95 % interval, which is null if there is none.
pub fn estimate_with_interval(e: &Estimate, interval: Option<(f64, f64)>) -> Value {
    json!({
        "value": number(e.value),
        "standard_error": optional(e.standard_error),
        "interval": interval.map(|(low, high)| [number(low), number(high)]),
    })
}

/// Returns the verdict on a result: the level, the reasons (findings against the result), the notes, and the verdict on
/// each answer.
pub fn verdict(v: &Verdict) -> Value {
    let mut found = json!(v);
    // Earlier key, kept for one release.
    found["findings"] = json!(v.findings());
    found
}

/// Returns the model orders with their names.
pub fn orders(o: &Orders) -> Value {
    json!({"na": o.na, "nb": o.nb, "nc": o.nc, "nd": o.nd, "nf": o.nf, "nk": o.nk})
}

/// Returns the operator or the reason why there is none; null for a model whose orders are not those of an operator.
pub fn operator(found: &Result<OperatorEstimate, NotConvertible>) -> Value {
    match found {
        Ok(o) => {
            let mut map = Map::new();
            map.insert("convertible".to_owned(), json!(true));
            map.insert("stable".to_owned(), json!(o.parameters().is_stable()));
            for (name, _, e) in o.rows() {
                map.insert(name.to_owned(), estimate(&e));
            }
            Value::Object(map)
        }
        // A model whose orders differ from those of an operator is not expected to represent one, so no reason is
        // given.
        Err(NotConvertible::OtherOrders { .. } | NotConvertible::PolesInBoth { .. }) => Value::Null,
        Err(reason) => json!({"convertible": false, "reason": reason.to_string()}),
    }
}

/// Returns the crossover and margins of a known loop.
pub fn margins(all: &Crossings) -> Map<String, Value> {
    let m = all.margins();
    let mut map = Map::new();
    map.insert("crossover_rad_s".to_owned(), optional(m.crossover_rad_s));
    map.insert("phase_margin_deg".to_owned(), optional(m.phase_margin_deg));
    map.insert("gain_margin_db".to_owned(), optional(m.gain_margin_db));
    map.insert("phase_crossover_rad_s".to_owned(), optional(m.phase_crossover_rad_s));
    let crossing =
        |c: &Crossing| json!({"crossover_rad_s": number(c.omega_rad_s), "phase_margin_deg": number(c.margin)});
    map.insert("crossovers".to_owned(), all.gain.iter().map(crossing).collect());
    map
}

/// Returns all crossings of an estimated loop, the phase margin closest to zero, the gain margin, and whether the
/// closed loop is stable.
pub fn loop_shape(shape: &LoopShape) -> Map<String, Value> {
    let crossing = |(omega, margin): &(Estimate, Estimate)| json!({"crossover_rad_s": estimate(omega), "phase_margin_deg": estimate(margin)});
    let mut map = Map::new();
    let all: Vec<Value> = shape.crossovers.iter().map(crossing).collect();
    map.insert("crossovers".to_owned(), Value::Array(all));
    let or_null = |e: Option<Estimate>| e.map_or(Value::Null, |e| estimate(&e));
    let smallest = shape.smallest_margin().map(|(_, margin)| margin);
    map.insert("smallest_phase_margin_deg".to_owned(), or_null(smallest));
    map.insert(
        "gain_margin_db".to_owned(),
        or_null(shape.gain_margin.map(|(_, db)| db)),
    );
    map.insert(
        "phase_crossover_rad_s".to_owned(),
        or_null(shape.gain_margin.map(|(omega, _)| omega)),
    );
    map.insert("stable".to_owned(), json!(shape.is_stable()));
    map
}

/// Returns the crossover and margins of an estimated loop.
pub fn margin_estimates(m: &MarginEstimates) -> Value {
    let or_null = |e: &Option<Estimate>| e.as_ref().map_or(Value::Null, estimate);
    json!({
        "crossover_rad_s": or_null(&m.crossover_rad_s),
        "phase_margin_deg": or_null(&m.phase_margin_deg),
        "gain_margin_db": or_null(&m.gain_margin_db),
        "phase_crossover_rad_s": or_null(&m.phase_crossover_rad_s),
    })
}

/// Returns a whiteness test.
pub fn ljung_box(test: Option<&LjungBox>) -> Value {
    test.map_or(Value::Null, |t| {
        json!({
            "statistic": number(t.statistic),
            "degrees_of_freedom": t.degrees_of_freedom,
            "p_value": number(t.p_value),
        })
    })
}

/// Returns the goodness of fit on the fitted records or on other records.
pub fn goodness(q: &GoodnessOfFit) -> Map<String, Value> {
    let rows = [
        ("vaf_simulation", q.vaf_simulation),
        ("vaf_prediction", q.vaf_prediction),
        ("nrmse_simulation", q.nrmse_simulation),
        ("nrmse_prediction", q.nrmse_prediction),
    ];
    rows.into_iter()
        .map(|(name, value)| (name.to_owned(), number(value)))
        .collect()
}

/// Returns the goodness of fit on another file.
pub fn validation(file: &str, q: &GoodnessOfFit) -> Value {
    let file = std::iter::once(("file".to_owned(), json!(file)));
    Value::Object(file.chain(goodness(q)).collect())
}

/// Returns the reason why a search ended.
pub fn termination(t: &Termination) -> Value {
    json!({
        "reason": t.reason.to_string(),
        "converged": t.converged(),
        "iterations": t.iterations,
    })
}

/// Returns a parameter with its name.
pub fn named(name: &str, e: &Estimate) -> Value {
    json!({"name": name, "value": number(e.value), "standard_error": optional(e.standard_error)})
}

/// Returns the file, the sampling and the processing of each record as JSON.
pub fn records(files: &[String], records: &[Record], accounts: &[Account]) -> Value {
    let record = |((file, r), account): ((&String, &Record), &Account)| {
        let mut one = json!({
            "file": file,
            "samples": r.len(),
            "sample_time": number(r.sample_time().s()),
            "units": {
                "input": r.input_channel().map_or("", |channel| &channel.unit),
                "output": r.output_channel().unit,
            },
            "preparation": list(&account.steps),
            "trouble": list(&account.quality_issues),
        });
        if let Some(level) = &account.level {
            one["level"] = estimate(level);
        }
        one
    };
    files.iter().zip(records).zip(accounts).map(record).collect()
}

/// Returns the problems of the files as text.
pub fn warnings(files: &[String], accounts: &[Account]) -> Value {
    let all = files.iter().zip(accounts);
    all.flat_map(|(file, account)| {
        account
            .quality_issues
            .iter()
            .map(move |one| json!(format!("{file}: {one}")))
    })
    .collect()
}

/// Returns all faults of the records and all problems of their files, one object each.
pub fn faults(files: &[String], accounts: &[Account]) -> Value {
    let all = files.iter().zip(accounts);
    all.flat_map(|(file, account)| account.found_faults().into_iter().map(move |found| fault(file, &found)))
        .collect()
}

/// Returns a fault as an object.
pub fn fault(record: &str, found: &FoundFault) -> Value {
    let mut object = json!(found);
    object["record"] = json!(record);
    object
}

/// Returns a list of serialised items, one object each.
pub fn list<T: Serialize>(items: &[T]) -> Value {
    // Numbers that JSON cannot represent become null; serialisation cannot fail in any other way.
    serde_json::to_value(items).unwrap_or(Value::Null)
}
