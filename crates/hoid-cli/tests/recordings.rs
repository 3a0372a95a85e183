//! Typical recordings of laboratories: preparation, inspection and cuts from the command line.
#![allow(clippy::unwrap_used)]

mod common;

use std::{fs, path::Path};

use common::{failure_of, hoid, json, json_with_any_exit_code, stdout_of};
use serde_json::Value;
use tempfile::TempDir;

const FIT_OPTIONS: [&str; 8] = [
    "--structure",
    "arx",
    "--orders",
    "na=2,nb=2",
    "--nk",
    "29",
    "--json",
    "run.csv",
];

/// Writes a simulated run with e in rad, u recorded two samples late, and t from 100 s on; `row` modifies the rows.
fn recording_folder(row: impl Fn(usize, [f64; 3]) -> Vec<[f64; 3]>) -> TempDir {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    stdout_of(
        at,
        &["simulate", "--condition", "C1", "--seed", "3", "--out", "clean.csv"],
    );
    let text = fs::read_to_string(at.join("clean.csv")).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let all: Vec<Vec<f64>> = lines
        .map(|l| l.split(',').map(|v| v.parse().unwrap()).collect())
        .collect();
    let mut out = String::from("t,e,u\n");
    for k in 2..4000 {
        let values = [
            100.0 + 0.01 * k as f64,
            all[k][column("e")].to_radians(),
            all[k - 2][column("u")],
        ];
        for [t, e, u] in row(k, values) {
            out.push_str(&format!("{t:.2},{e},{u}\n"));
        }
    }
    fs::write(at.join("run.csv"), out).unwrap();
    directory
}

fn parameters(found: &Value) -> Vec<f64> {
    let all = found["parameters"].as_array().unwrap();
    all.iter().map(|p| p["value"].as_f64().unwrap()).collect()
}

fn identify(at: &Path, options: &[&str]) -> Value {
    json_with_any_exit_code(at, &[&["identify"], options, &FIT_OPTIONS[..]].concat())
}

#[test]
fn preparation_steps_are_reported_in_every_format() {
    let directory = recording_folder(|_, values| vec![values]);
    let at = directory.path();
    let plain = json(
        at,
        &[
            "identify",
            "--structure",
            "arx",
            "--orders",
            "na=2,nb=2",
            "--nk",
            "29",
            "--json",
            "clean.csv",
            "--from",
            "1.02",
            "--to",
            "39.98",
            "--detrend",
            "mean",
        ],
    );
    let options = [
        "--scale",
        "e=rad:deg",
        "--offset",
        "u=2",
        "--detrend",
        "mean",
        "--run-in",
        "1",
    ];
    let found = identify(at, &options);
    let steps = found["records"][0]["preparation"].as_array().unwrap();
    let names: Vec<&str> = steps.iter().map(|step| step["step"].as_str().unwrap()).collect();
    assert_eq!(names, ["scale", "offset", "run-in", "detrend"]);
    assert!((steps[0]["factor"].as_f64().unwrap() - 57.295_779_513_082_32).abs() < 1e-12);
    assert_eq!(
        (&steps[1]["samples"], &steps[1]["cut_samples"][1]),
        (&Value::from(2.0), &Value::from(2))
    );
    assert_eq!(found["warnings"], serde_json::json!([]));
    // The samples are the same, up to rounding of the factor.
    for (a, b) in parameters(&found).iter().zip(parameters(&plain)) {
        assert!((a - b).abs() < 1e-7 * b.abs() + 1e-9, "{a} {b}");
    }
    let text = stdout_of(
        at,
        &[
            "identify",
            "--structure",
            "arx",
            "--orders",
            "na=2,nb=2",
            "--nk",
            "29",
            "run.csv",
            "--offset",
            "u=0.005s",
            "--report",
            "page",
        ],
    );
    for words in [
        "u moved earlier by 0.5 samples (0.005 s), interpolated by a sinc function (error below 1e-4 up to 40 Hz)",
        "samples cut at the start",
    ] {
        assert!(text.contains(words), "{words}: {text}");
        assert!(
            fs::read_to_string(at.join("page/report.html")).unwrap().contains(words),
            "{words}"
        );
    }
    let tracked = json(
        at,
        &[
            "track",
            "run.csv",
            "--method",
            "rls",
            "--nk",
            "8",
            "--decimate",
            "4",
            "--out",
            "trace.csv",
            "--json",
        ],
    );
    let step = &tracked["records"][0]["preparation"][0];
    assert_eq!(
        (&step["step"], &step["to_hz"], &step["stop_hz"]),
        (&Value::from("rate"), &Value::from(25.0), &Value::from(15.0))
    );
    let trace = fs::read_to_string(at.join("trace.csv")).unwrap();
    assert!(
        trace.contains("# preparation: 100 Hz, filtered and decimated by 4 to 25 Hz"),
        "{}",
        &trace[..600]
    );
    let resampled = identify(at, &["--new-fs", "50"]);
    assert!((resampled["records"][0]["sample_time"].as_f64().unwrap() - 0.02).abs() < 1e-12);
}

#[test]
fn data_faults_are_shown_and_repaired_only_on_request() {
    // Every five hundredth row is duplicated, 20 rows are missing, and u is clipped.
    let directory = recording_folder(|k, [t, e, u]| {
        let values = [t, e, u.clamp(-0.15, 0.15)];
        match k {
            2500..2520 => vec![],
            k if k % 500 == 7 => vec![values, values],
            _ => vec![values],
        }
    });
    let at = directory.path();
    let found = json(at, &["info", "run.csv", "--json"]);
    let kinds: Vec<&str> = found["trouble"]
        .as_array()
        .unwrap()
        .iter()
        .map(|one| one["kind"].as_str().unwrap())
        .collect();
    assert_eq!(kinds, ["repeated", "gap", "saturated", "saturated"], "{found:#}");
    let gap = &found["trouble"][1];
    assert_eq!(
        (&gap["rows"], &gap["places"][0]["rows"]),
        (&Value::from(20), &Value::from(20))
    );
    assert!((gap["places"][0]["from_s"].as_f64().unwrap() - 124.99).abs() < 1e-9);
    let text = stdout_of(at, &["info", "run.csv"]);
    for words in [
        "Problems:",
        "7 rows are duplicated, including the time",
        "remedy: drop them with --drop-repeated",
        "20 rows missing in 1 place, the first after row",
        "u stays at its largest value, 0.15",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    // Data are repaired only on request.
    let (code, message) = failure_of(at, &["identify", "run.csv"]);
    assert!(code == 1 && message.contains("expected increasing time"), "{message}");
    let (code, message) = failure_of(at, &["identify", "run.csv", "--drop-repeated"]);
    assert!(code == 1 && message.contains("missing samples"), "{message}");
    let masked = identify(at, &["--drop-repeated", "--mask", "gap"]);
    let records = masked["records"].as_array().unwrap();
    assert_eq!(records.len(), 2);
    assert!(
        records[1]["file"].as_str().unwrap().starts_with("run.csv (125.2 to"),
        "{}",
        records[1]["file"]
    );
    let names: Vec<&str> = records[0]["preparation"]
        .as_array()
        .unwrap()
        .iter()
        .map(|step| step["step"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["mask", "drop-repeated"]);
    assert_eq!(masked["warnings"].as_array().unwrap().len(), 4);
    assert_eq!(records[0]["trouble"].as_array().unwrap().len(), 4);
    let resampled = hoid(
        at,
        &[&["identify"], &["--drop-repeated", "--resample"][..], &FIT_OPTIONS[..]].concat(),
    );
    let complaints = String::from_utf8(resampled.stderr).unwrap();
    assert!(complaints.contains("warning: run.csv: u stays at its"), "{complaints}");
}

#[test]
fn invalid_preparations_are_reported_in_plain_words() {
    let directory = recording_folder(|_, values| vec![values]);
    let at = directory.path();
    for (options, code, words) in [
        (&["--scale", "e=0"][..], 2, "finite nonzero factor"),
        (&["--scale", "e=NaN"], 2, "finite nonzero factor"),
        (&["--scale", "e"], 2, "names no channel"),
        (
            &["--scale", "q=2"],
            1,
            "there is no channel \"q\", expected one of e, u",
        ),
        (&["--scale", "e=2", "--scale", "e=3"], 2, "names e twice"),
        (&["--scale", "e=rad:N"], 2, "two units of the same kind"),
        (&["--offset", "u=4000"], 1, "u=4000 samples in a record of 3998 samples"),
        (&["--offset", "u=x"], 2, "expected a number of samples"),
        (&["--decimate", "0"], 2, "expected auto, off"),
        (&["--decimate", "5000"], 1, "a longer record"),
        (&["--decimate", "2", "--new-fs", "10"], 2, "cannot be used with"),
        (&["--new-fs", "-3"], 2, "write a positive number in Hz"),
        (&["--new-fs", "0"], 2, "write a positive number in Hz"),
        (&["--run-in", "50"], 1, "a run-in shorter than the record"),
        (&["--mask", "clock"], 2, "possible values"),
        (&["--mask", "gap", "--run-in", "3"], 1, "--from"),
    ] {
        let (found, message) = failure_of(at, &[&["identify", "run.csv"], options].concat());
        assert!(
            found == code && message.contains(words),
            "{options:?}: {found} {message}"
        );
    }
}

/// Eye and stick are in separate files, at 100 and 50 Hz; the message describes how to read them.
#[test]
fn two_files_at_two_rates_can_be_joined() {
    let directory = recording_folder(|k, [t, e, u]| {
        assert!(k >= 2);
        vec![[t, e.to_degrees(), u]]
    });
    let at = directory.path();
    let text = fs::read_to_string(at.join("run.csv")).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let write = |name: &str, header: &str, row: &dyn Fn(usize, &[&str]) -> Option<String>| {
        let lines: Vec<String> = rows.iter().enumerate().filter_map(|(k, cells)| row(k, cells)).collect();
        fs::write(at.join(name), format!("{header}\n{}\n", lines.join("\n"))).unwrap();
    };
    write("eye.csv", "t,e", &|_, cells| Some(format!("{},{}", cells[0], cells[1])));
    let slow = |k: usize, cells: &[&str]| k.is_multiple_of(2).then(|| format!("{},{}", cells[0], cells[2]));
    write("stick.csv", "t,u", &slow);
    let (code, message) = failure_of(at, &["identify", "eye.csv", "stick.csv"]);
    assert_eq!(code, 1);
    for part in [
        "no column \"u\"",
        "but stick.csv does",
        "pandas.read_csv(\"eye.csv\")",
        "how=\"outer\"",
    ] {
        assert!(message.contains(part), "{message}");
    }
    // This is the file that the line of pandas code writes.
    write("joined.csv", "t,e,u", &|k, cells| {
        let u = if k.is_multiple_of(2) { cells[2] } else { "" };
        Some(format!("{},{},{u}", cells[0], cells[1]))
    });
    let advised = message.split("joined.csv with ").nth(1).unwrap().trim();
    let advised: Vec<&str> = advised.split(' ').collect();
    let gain = |options: &[&str]| {
        let found = json_with_any_exit_code(at, &[&["identify", "--json"], options].concat());
        found["operator"]["K_e"]["value"].as_f64().unwrap()
    };
    let (joined, whole) = (gain(&[&["joined.csv"], &advised[..]].concat()), gain(&["run.csv"]));
    assert!((joined / whole - 1.0).abs() < 0.03, "{joined} {whole}");
    // Neither a single file nor two runs without the column are mistaken for such a pair.
    let (_, alone) = failure_of(at, &["identify", "eye.csv"]);
    assert!(!alone.contains("pandas"), "{alone}");
}
