//! Runs the program as a user does.
// Each test file uses only part of this module.
#![allow(dead_code, clippy::unwrap_used)]

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use serde_json::Value;
use tempfile::TempDir;

/// Options of a Box-Jenkins fit with the orders of the simulated operator and its remnant.
pub const BOX_JENKINS_OPTIONS: [&str; 6] = ["--structure", "bj", "--nk", "29", "--orders", "nd=1"];

pub fn hoid(directory: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hoid"))
        .args(arguments)
        .current_dir(directory)
        .env_remove("COLUMNS")
        .output()
        .unwrap()
}

pub fn stdout_of(directory: &Path, arguments: &[&str]) -> String {
    let output = hoid(directory, arguments);
    assert!(
        output.status.success(),
        "{arguments:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout).unwrap()
}

pub fn json(directory: &Path, arguments: &[&str]) -> Value {
    serde_json::from_str(&stdout_of(directory, arguments)).unwrap()
}

/// Returns the result of a fit with any verdict; a result that is not determined is also printed, with exit code 1.
pub fn json_with_any_exit_code(directory: &Path, arguments: &[&str]) -> Value {
    let output = hoid(directory, arguments);
    let found: Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|_| panic!("{arguments:?}: {}", String::from_utf8_lossy(&output.stderr)));
    let level = found["verdict"]["level"].as_str().unwrap();
    assert_eq!(output.status.code(), Some(i32::from(level == "not determined")));
    found
}

/// Returns the exit code and message of a command that fails; it must print nothing on standard output and leave no
/// file.
pub fn failure_of(directory: &Path, arguments: &[&str]) -> (i32, String) {
    let files = |d: &Path| fs::read_dir(d).unwrap().count();
    let before = files(directory);
    let output = hoid(directory, arguments);
    assert!(
        output.stdout.is_empty(),
        "{arguments:?}: {}",
        String::from_utf8_lossy(&output.stdout)
    );
    assert_eq!(files(directory), before, "{arguments:?} left a file behind");
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(!message.contains("panicked"), "{message}");
    (output.status.code().unwrap(), message)
}

/// Returns a folder with a simulated run of C1.
pub fn simulated_run() -> TempDir {
    let directory = TempDir::new().unwrap();
    stdout_of(
        directory.path(),
        &["simulate", "--condition", "C1", "--seed", "1", "--out", "c1.csv"],
    );
    directory
}

/// Writes a file of `rows` samples at 100 Hz; `row` makes each line from its index.
pub fn write_samples(directory: &Path, name: &str, header: &str, rows: usize, row: impl Fn(usize) -> String) {
    let lines: Vec<String> = std::iter::once(header.to_owned()).chain((0..rows).map(row)).collect();
    fs::write(directory.join(name), lines.join("\n") + "\n").unwrap();
}

/// Returns t, e and u of sample k.
pub fn wave(k: usize) -> (f64, f64, f64) {
    let t = k as f64 / 100.0;
    (
        t,
        (1.7 * t).sin() + 0.5 * (9.1 * t).sin(),
        (1.7 * t - 0.8).sin() + 0.3 * (23.0 * t).cos(),
    )
}

/// Returns sample k as a line of a file.
pub fn row(k: usize) -> String {
    let (t, e, u) = wave(k);
    format!("{t},{e},{u}")
}

/// Returns arguments of `track` or `stream`, with the physical method, which starts with a fit, unless a method is
/// given.
pub fn with_physical_method<'a>(arguments: &[&'a str]) -> Vec<&'a str> {
    let mut all = arguments.to_vec();
    if !all.contains(&"--method") {
        all.extend(["--method", "physical"]);
    }
    all
}

/// Returns the value of a setting in a result.
pub fn setting(found: &Value, name: &str) -> String {
    let all = found["settings"].as_array().unwrap();
    let one = all.iter().find(|one| one["name"] == name).unwrap();
    one["value"].as_str().unwrap().to_owned()
}
