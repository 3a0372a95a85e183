//! Comparison of two answers: numbers must agree within a tolerance, everything else exactly.

use serde_json::Value;

/// Numbers below this value are rounding errors.
const ROUNDING_LIMIT: f64 = 1e-15;

/// Returns the changes, each with the key of the call, the old and the new value.
pub fn changes(key: &str, was: &Value, now: &Value, tolerance: f64) -> Vec<String> {
    match (was, now) {
        (Value::Object(a), Value::Object(b)) => {
            let gone = a.iter().filter(|(name, _)| !b.contains_key(*name));
            let mut all: Vec<String> = gone
                .map(|(name, v)| change_message(&format!("{key}.{name}"), v, &Value::Null))
                .collect();
            for (name, now) in b {
                let was = a.get(name).unwrap_or(&Value::Null);
                all.extend(changes(&format!("{key}.{name}"), was, now, tolerance));
            }
            all
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            let pairs = a.iter().zip(b).enumerate();
            pairs
                .flat_map(|(k, (was, now))| changes(&format!("{key}[{k}]"), was, now, tolerance))
                .collect()
        }
        (Value::Number(a), Value::Number(b)) if numbers_agree(a, b, tolerance) => Vec::new(),
        _ if was == now => Vec::new(),
        _ => vec![change_message(key, was, now)],
    }
}

fn numbers_agree(a: &serde_json::Number, b: &serde_json::Number, tolerance: f64) -> bool {
    if !a.is_f64() && !b.is_f64() {
        return a == b;
    }
    let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
    (a - b).abs() <= tolerance * a.abs().max(b.abs()) || a.abs().max(b.abs()) < ROUNDING_LIMIT
}

fn change_message(key: &str, was: &Value, now: &Value) -> String {
    let text = |value: &Value| {
        let text = value.to_string();
        let short: String = text.chars().take(300).collect();
        if short.len() < text.len() {
            short + " ..."
        } else {
            short
        }
    };
    format!("{key}: was {}, now {}", text(was), text(now))
}

/// Formats JSON with one line for each key of the answer, so that a change affects only its line.
pub fn line_per_key(value: &Value) -> String {
    let Some(map) = value.as_object() else {
        return format!("{value}\n");
    };
    let lines = map.iter().map(|(key, value)| {
        let name = Value::String(key.clone());
        match value.as_object() {
            Some(inner) if !inner.is_empty() => {
                let inner = inner
                    .iter()
                    .map(|(key, value)| format!("  {}: {value}", Value::String(key.clone())));
                format!("{name}: {{\n{}\n}}", inner.collect::<Vec<_>>().join(",\n"))
            }
            _ => format!("{name}: {value}"),
        }
    });
    format!("{{\n{}\n}}\n", lines.collect::<Vec<_>>().join(",\n"))
}

#[test]
fn changes_are_reported_by_key() {
    let was = serde_json::json!({"a": [1.0, {"b": "x"}], "n": 3, "gone": true});
    let now = serde_json::json!({"a": [1.0 + 1e-12, {"b": "y"}], "n": 4});
    assert_eq!(
        changes("call", &was, &now, 1e-9),
        [
            "call.gone: was true, now null",
            "call.a[1].b: was \"x\", now \"y\"",
            "call.n: was 3, now 4",
        ]
    );
    assert!(changes("call", &was, &was, 0.0).is_empty());
    assert_eq!(serde_json::from_str::<Value>(&line_per_key(&was)).unwrap(), was);
}
