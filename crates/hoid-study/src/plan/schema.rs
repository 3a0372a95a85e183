//! JSON schema of a plan, which editors use to complete and check plans.
//!
//! The schema is generated from the types that read plans and from the schema of a scenario file, extended so that each
//! single value may also be a list.

use hoid_ident::settings::{Kind, MethodSpec};
use schemars::{SchemaGenerator, generate::SchemaSettings};
use serde_json::{Map, Value, json};

use super::{
    estimator_table::{EstimatorTable, methods, non_axis_keys, plan_key},
    top_level_keys::Head,
};

/// Returns the schema (draft 2020-12) as text.
pub fn plan_schema() -> String {
    plan_schema_of(&methods())
}

/// Returns the schema with the options of these methods.
pub fn plan_schema_of(methods: &[MethodSpec]) -> String {
    let settings = || SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true);
    let of = |generator: SchemaGenerator, which: u8| match which {
        0 => generator.into_root_schema_for::<Head>(),
        _ => generator.into_root_schema_for::<EstimatorTable>(),
    };
    let mut plan = of(settings().into_generator(), 0).to_value();
    let mut estimator = of(settings().into_generator(), 1).to_value();
    let mut scenario: Value = serde_json::from_str(&hoid_io::scenario_schema()).unwrap_or_default();
    add_settings(&mut estimator, methods);
    let whole = non_axis_keys();
    let whole: Vec<&str> = whole.iter().map(String::as_str).collect();
    for (table, whole) in [
        (&mut estimator, whole.as_slice()),
        (&mut scenario, hoid_io::LIST_VALUED_KEYS.as_slice()),
    ] {
        strip(table);
        allow_lists(table, whole);
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

/// Adds the options of the methods, as listed in the registries.
fn add_settings(estimator: &mut Value, methods: &[MethodSpec]) {
    let Some(table) = estimator.as_object_mut() else { return };
    table.insert("additionalProperties".to_owned(), false.into());
    let Some(properties) = table.get_mut("properties").and_then(Value::as_object_mut) else {
        return;
    };
    for setting in methods.iter().flat_map(|spec| &spec.settings) {
        let key = plan_key(setting);
        if properties.contains_key(&key) {
            continue;
        }
        let of: Vec<&str> = methods
            .iter()
            .filter(|spec| spec.settings.iter().any(|other| other.name == setting.name))
            .map(|spec| spec.name)
            .collect();
        let mut schema = kind_schema(setting.kind);
        if let Some(schema) = schema.as_object_mut() {
            let text = format!("{}. For {}.", setting.help, of.join(", "));
            schema.insert("description".to_owned(), text.into());
        }
        properties.insert(key, schema);
    }
}

/// Returns the schema for a kind of value.
fn kind_schema(kind: Kind) -> Value {
    match kind {
        Kind::Flag => json!({ "type": "boolean" }),
        Kind::Count => json!({ "type": "integer", "minimum": 0 }),
        Kind::Number => json!({ "type": "number" }),
        Kind::NumberOrDefault(_) => json!({ "type": ["number", "boolean"] }),
        Kind::Counts | Kind::Delay => json!({ "type": ["integer", "string"] }),
        Kind::NumberOrSpan => json!({ "type": ["number", "array"], "items": { "type": "number" } }),
        Kind::Memory => json!({ "type": ["number", "string"] }),
        Kind::NumberOrOff => json!({ "anyOf": [{ "type": "number" }, { "enum": ["off"] }] }),
        Kind::Span => json!({ "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 2 }),
        Kind::OpenSpan | Kind::Channel | Kind::Names | Kind::Guess | Kind::Element | Kind::Prior => {
            json!({ "type": "string" })
        }
        Kind::Choice(words) => json!({ "enum": words }),
        Kind::Named(of) => {
            // `name` labels one table of a list of tables.
            json!({ "type": "object", "additionalProperties": kind_schema(*of), "properties": { "name": { "type": "string" } } })
        }
    }
}

/// Removes the keys that belong only at the top level of a schema.
fn strip(schema: &mut Value) {
    if let Some(object) = schema.as_object_mut() {
        object.remove("$schema");
        object.remove("title");
    }
}

/// Extends the schema of each value that is not a table, so that a list of such values is also valid.
fn allow_lists(table: &mut Value, whole: &[&str]) {
    let Some(properties) = table.get_mut("properties").and_then(Value::as_object_mut) else {
        return;
    };
    for (key, schema) in properties.iter_mut() {
        if whole.contains(&key.as_str()) {
            continue;
        }
        if schema.get("properties").is_some() {
            allow_lists(schema, &[]);
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
