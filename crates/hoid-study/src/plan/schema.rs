//! JSON schema of a plan: what editors complete and check.
//!
//! It is made of the types that read plans and of the schema of a scenario file, in which each single value may also be a list.

use schemars::{SchemaGenerator, generate::SchemaSettings};
use serde_json::{Map, Value, json};

use super::{
    Head,
    estimator_table::{EstimatorTable, WHOLE},
};

/// The schema (draft 2020-12) as text.
pub fn plan_schema() -> String {
    let settings = || SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true);
    let of = |generator: SchemaGenerator, which: u8| match which {
        0 => generator.into_root_schema_for::<Head>(),
        _ => generator.into_root_schema_for::<EstimatorTable>(),
    };
    let mut plan = of(settings().into_generator(), 0).to_value();
    let mut estimator = of(settings().into_generator(), 1).to_value();
    let mut scenario: Value = serde_json::from_str(&hoid_io::scenario_schema()).unwrap_or_default();
    for (table, whole) in [(&mut estimator, WHOLE.as_slice()), (&mut scenario, &["forcing"])] {
        strip(table);
        with_lists(table, whole);
    }
    if let Some(properties) = plan.get_mut("properties").and_then(Value::as_object_mut) {
        let array = |items: Value| json!({ "type": "array", "minItems": 1, "items": items });
        properties.insert("scenarios".to_owned(), array(scenario));
        properties.insert("estimators".to_owned(), array(estimator));
    }
    if let Some(required) = plan.get_mut("required").and_then(Value::as_array_mut) {
        required.extend(["scenarios", "estimators"].map(Value::from));
    }
    if let Some(plan) = plan.as_object_mut() {
        plan.insert("title".to_owned(), "Plan of a hoid study".into());
    }
    format!("{plan:#}\n")
}

/// Parts that belong to a schema of its own.
fn strip(schema: &mut Value) {
    if let Some(object) = schema.as_object_mut() {
        object.remove("$schema");
        object.remove("title");
    }
}

/// Lets each value that is no table be a list of such values too.
fn with_lists(table: &mut Value, whole: &[&str]) {
    let Some(properties) = table.get_mut("properties").and_then(Value::as_object_mut) else {
        return;
    };
    for (key, schema) in properties.iter_mut() {
        if whole.contains(&key.as_str()) {
            continue;
        }
        if schema.get("properties").is_some() {
            with_lists(schema, &[]);
            continue;
        }
        let Some(object) = schema.as_object_mut() else { continue };
        let mut outer = Map::new();
        for part in ["description", "default"] {
            if let Some(value) = object.remove(part) {
                outer.insert(part.to_owned(), value);
            }
        }
        let single = Value::Object(object.clone());
        outer.insert(
            "anyOf".to_owned(),
            json!([single, { "type": "array", "minItems": 1, "items": single }]),
        );
        *schema = Value::Object(outer);
    }
}
