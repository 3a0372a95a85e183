//! The answer of a call, without parts that depend on the machine or the version.

use std::{
    fs,
    path::Path,
    process::{Command, Output, Stdio},
};

use serde_json::{Map, Value, json};

use super::manifest::Call;

/// Keys that are omitted.
const VOLATILE_KEYS: [&str; 4] = ["hoid", "seconds", "state", "threads"];
/// Longest list that is kept completely.
const MAX_LIST_LENGTH: usize = 24;
/// Approximate number of rows of a table that are kept.
const KEPT_ROWS: usize = 12;

pub fn run(at: &Path, command: &str, stdin: Option<&str>) -> Output {
    let input = stdin.map_or_else(Stdio::null, |file| fs::File::open(at.join(file)).unwrap().into());
    Command::new(env!("CARGO_BIN_EXE_hoid"))
        .args(command.split_whitespace())
        .current_dir(at)
        .stdin(input)
        .env_remove("COLUMNS")
        .output()
        .unwrap()
}

/// Returns the exit code, the standard output, and rows of the written tables.
pub fn of(at: &Path, call: &Call) -> Value {
    let out = |text: &str| text.replace("{out}", &call.name);
    let done = run(at, &out(&call.command), call.stdin.as_deref());
    let mut answer = Map::new();
    answer.insert("exit".to_owned(), json!(done.status.code()));
    answer.insert("messages".to_owned(), lines(&done.stderr));
    answer.insert("answer".to_owned(), shorten(parse_output(&done.stdout)));
    for table in &call.tables {
        let text = fs::read_to_string(at.join(out(table)));
        answer.insert(table.clone(), text.map_or(Value::Null, |text| summarise_rows(&text)));
    }
    Value::Object(answer)
}

fn lines(text: &[u8]) -> Value {
    let text = String::from_utf8_lossy(text).replace("\r\n", "\n");
    json!(text.lines().map(|line| line.trim_end()).collect::<Vec<_>>())
}

/// Returns the output as one JSON object, as one object per line, or as text.
fn parse_output(bytes: &[u8]) -> Value {
    if let Ok(one) = serde_json::from_slice(bytes) {
        return one;
    }
    let text = String::from_utf8_lossy(bytes);
    let each: Result<Vec<Value>, _> = text.lines().map(serde_json::from_str).collect();
    each.map_or_else(|_| lines(bytes), Value::Array)
}

/// Returns the header, the number of rows, and some rows including the last one.
fn summarise_rows(text: &str) -> Value {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let cell = |text: &str| text.parse::<f64>().map_or_else(|_| json!(text), |v| shorten(json!(v)));
    let all: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let last = all.len().saturating_sub(1);
    let every = all.len().div_ceil(KEPT_ROWS).max(1);
    let kept = all.iter().enumerate().filter(|(k, _)| k % every == 0 || *k == last);
    let kept: Vec<Value> = kept
        .map(|(_, row)| row.iter().map(|text| cell(text)).collect())
        .collect();
    json!({"header": header, "rows": all.len(), "kept": kept})
}

/// Removes volatile keys, rounds numbers to twelve digits, and keeps about eight entries of long
/// lists; pages are kept completely.
fn shorten(value: Value) -> Value {
    match value {
        Value::Object(map) => map
            .into_iter()
            .filter(|(key, _)| !VOLATILE_KEYS.contains(&key.as_str()))
            .map(|(key, value)| (key, shorten(value)))
            .collect::<Map<_, _>>()
            .into(),
        Value::Array(all) if all.len() > MAX_LIST_LENGTH && !all.iter().any(Value::is_string) => {
            let step = all.len().div_ceil(8);
            let kept: Value = all.iter().step_by(step).map(|v| shorten(v.clone())).collect();
            json!({"length": all.len(), "kept": kept})
        }
        Value::Array(all) => all.into_iter().map(shorten).collect(),
        Value::Number(number) if number.is_f64() => {
            let v = number.as_f64().unwrap();
            json!(format!("{v:.11e}").parse::<f64>().unwrap())
        }
        other => other,
    }
}
