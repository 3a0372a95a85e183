//! `hoid identify --pair`: two axes of one recording.
#![allow(clippy::unwrap_used)]

mod common;

use std::{fs, path::Path};

use common::{failure_of, json, stdout_of};
use serde_json::Value;
use tempfile::TempDir;

/// A lead on 4/(s(s+1)) with a target that has every second line, at 60 Hz.
const TASK: &str = r#"
form = "lead"
name = "axis"
sampling_rate_hz = 60
measurement_s = 80
run_in_s = 10

[initial]
K = 0.9
T_L_s = 0.4
omega_nm_rad_s = 11
zeta_nm = 0.3
tau_e_s = 0.25
controlled_element = "4/(s(s+1))"

[target]
interleaved = "even"

[[remnant]]
shape = "lag"
T_n_s = 0.1
share = 0.15
"#;
/// Delay of the coupling, samples.
const DELAY_SAMPLES: usize = 18;

/// Returns the columns of a simulated run.
fn simulated_columns(at: &Path, lines: &str, seed: &str) -> Vec<[f64; 4]> {
    fs::write(at.join("task.toml"), TASK.replace("\"even\"", lines)).unwrap();
    stdout_of(
        at,
        &[
            "simulate",
            "--scenario",
            "task.toml",
            "--seed",
            seed,
            "--out",
            "run.csv",
        ],
    );
    let text = fs::read_to_string(at.join("run.csv")).unwrap();
    let mut rows = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = rows.next().unwrap().split(',').collect();
    let index = |name: &str| header.iter().position(|column| *column == name).unwrap();
    let places = ["t", "e", "u", "f_t"].map(index);
    let row = |line: &str| {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
        places.map(|k| cells[k])
    };
    rows.map(row).collect()
}

/// Writes two axes to a table; the control of x contains a part of the error of y.
fn write_two_axes(at: &Path, lines_of_y: &str, coupling: f64) {
    let (x, y) = (
        simulated_columns(at, "\"even\"", "1"),
        simulated_columns(at, lines_of_y, "2"),
    );
    let mut text = "t,ex,ux,rx,ey,uy,ry\n".to_owned();
    for (k, (a, b)) in x.iter().zip(&y).enumerate() {
        let other = k.checked_sub(DELAY_SAMPLES).map_or(0.0, |before| y[before][1]);
        let ux = a[2] + coupling * other;
        text.push_str(&format!("{},{},{ux},{},{},{},{}\n", a[0], a[1], a[3], b[1], b[2], b[3]));
    }
    fs::write(at.join("two.csv"), text).unwrap();
}

fn coupling(found: &Value, axis: usize) -> &Value {
    &found["axes"][axis]["coupling"][0]
}

#[test]
fn each_axis_has_an_operator_and_coupling_is_reported() {
    let at = TempDir::new().unwrap();
    write_two_axes(at.path(), "\"odd\"", 0.4);
    let call = ["identify", "two.csv", "--pair", "ex,ux,rx", "--pair", "ey,uy,ry"];
    let found = json(at.path(), &[&call[..], &["--json"]].concat());
    assert_eq!(found["kind"], "axes");
    for axis in 0..2 {
        let result = &found["axes"][axis]["result"];
        let all = result["parameters"].as_array().unwrap();
        for (name, truth) in [("K_e", 0.9), ("tau_e", 0.25), ("omega_nm", 11.0)] {
            let of = all.iter().find(|p| p["name"] == name).unwrap();
            let (value, error) = (of["value"].as_f64().unwrap(), of["standard_error"].as_f64().unwrap());
            assert!(
                (value - truth).abs() < 3.5 * error,
                "axis {axis}: {name} {value} ± {error}"
            );
        }
    }
    // There is a coupling in one direction only.
    assert_eq!(coupling(&found, 0)["responds"], true, "{}", coupling(&found, 0));
    assert_eq!(coupling(&found, 0)["input"], "ey");
    assert_eq!(coupling(&found, 1)["responds"], false, "{}", coupling(&found, 1));
    let kinds = |axis: usize| found["axes"][axis]["result"]["verdict"]["findings"].to_string();
    assert!(kinds(0).contains("axis-coupling") && !kinds(1).contains("axis-coupling"));
    let text = stdout_of(at.path(), &call);
    assert!(
        text.contains("Axis ex, ux") && text.contains("ey to ux") && text.contains("a response"),
        "{text}"
    );
    // The result of an axis equals the result for its columns alone.
    let alone = json(
        at.path(),
        &[
            "identify",
            "two.csv",
            "--input",
            "ey",
            "--output",
            "uy",
            "--excitation",
            "ry",
            "--json",
        ],
    );
    assert_eq!(alone["parameters"], found["axes"][1]["result"]["parameters"]);
}

#[test]
fn coupling_is_not_tested_if_lines_are_shared() {
    let at = TempDir::new().unwrap();
    write_two_axes(at.path(), "\"even\"", 0.0);
    let reason = |pairs: [&str; 2]| {
        let call = [
            "identify", "two.csv", "--form", "lead", "--pair", pairs[0], "--pair", pairs[1], "--json",
        ];
        let found = json(at.path(), &call);
        assert_eq!(coupling(&found, 0)["tested"], false);
        coupling(&found, 0)["reason"].as_str().unwrap().to_owned()
    };
    let shared = reason(["ex,ux,rx", "ey,uy,ry"]);
    assert!(shared.contains("share the line at"), "{shared}");
    let not_given = reason(["ex,ux", "ey,uy"]);
    assert!(not_given.contains("not given"), "{not_given}");
}

#[test]
fn invalid_pairs_are_refused() {
    let at = TempDir::new().unwrap();
    fs::write(at.path().join("two.csv"), "t,ex,ux,ey,uy\n0,1,1,1,1\n").unwrap();
    for (pairs, wanted) in [
        (&["--pair", "ex,ux"][..], "one axis"),
        (&["--pair", "ex"], "expected the error and control"),
        (&["--pair", "ex,ux,rx,q"], "expected the error and control"),
        (&["--pair", "ex,ux", "--pair", "ex,uy"], "share a column"),
        (
            &["--pair", "ex,ux", "--pair", "ey,uy", "--input", "ex"],
            "cannot be used with",
        ),
        (
            &["--pair", "ex,ux", "--pair", "ey,uy", "--figure", "x.svg"],
            "requires a single axis",
        ),
        (
            &["--pair", "ex,ux", "--pair", "ey,uy", "--structure", "bj"],
            "applies only to the structure operator",
        ),
    ] {
        let (code, message) = failure_of(at.path(), &[&["identify", "two.csv"], pairs].concat());
        assert!(code == 2 && message.contains(wanted), "{pairs:?}: {code} {message}");
    }
}
