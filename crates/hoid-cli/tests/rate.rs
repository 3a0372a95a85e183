//! At rates above 200 Hz, recordings are filtered and decimated automatically. The result states this, and the operator
//! is the same.
#![allow(clippy::unwrap_used)]

mod common;

use std::{
    fmt::Write as _,
    fs,
    io::Write as _,
    path::Path,
    process::{Command, Stdio},
};

use serde_json::Value;
use tempfile::TempDir;

use common::{failure_of, hoid, json, stdout_of};

/// Simulates a run of C1, or of a person with an element, at the given rate in Hz.
fn simulate(at: &Path, person: &str, hz: f64, seed: u64) -> String {
    let file = format!("{person}-{hz}-{seed}.csv");
    let (ts, seed) = (format!("{:?}", 1.0 / hz), seed.to_string());
    // The measurement has four periods, or three if four periods are not a whole number of samples.
    let (measurement_s, run_in_s) = if ts == "0.003" { (60.0, 6.0) } else { (80.0, 8.0) };
    let toml = |form: &str, gains: &str, element: &str| {
        format!(
            "form = \"{form}\"\nsample_time_s = {ts}\nmeasurement_s = {measurement_s}\nrun_in_s = {run_in_s}\n[initial]\n{gains}\n\
             omega_nm_rad_s = 12.0\nzeta_nm = 0.3\ntau_e_s = 0.15\ncontrolled_element = \"{element}\"\n\
             [disturbance]\nperiod_s = 20.0\nlargest_multiple = 60\nrms = 1.0\n\
             [[remnant]]\nshape = \"lag\"\nshare = 0.1\nT_n_s = 0.3\n"
        )
    };
    let scenario = match person {
        "lead" => toml("lead", "K = 0.5\nT_L_s = 2.0", "1/s^2"),
        "gain" => toml("gain", "K = 3.0", "1/s"),
        // The remnant is so smooth that nothing is determined at 1000 Hz.
        "smooth" => toml("gain", "K = 3.0", "1/s")
            .replace(
                "omega_nm_rad_s = 12.0\nzeta_nm = 0.3\ntau_e_s = 0.15",
                "omega_nm_rad_s = 11.0\nzeta_nm = 0.25\ntau_e_s = 0.2",
            )
            .replace("share = 0.1\nT_n_s = 0.3", "order = 3\nshare = 0.2\nT_n_s = 0.1"),
        _ => String::new(),
    };
    fs::write(at.join("person.toml"), &scenario).unwrap();
    let who: &[&str] = if scenario.is_empty() {
        &["--condition", "C1", "--sample-time", &ts]
    } else {
        &["--scenario", "person.toml"]
    };
    stdout_of(at, &[&["simulate", "--seed", &seed, "--out", &file], who].concat());
    file
}

fn value_and_error(found: &Value) -> (f64, f64) {
    (
        found["value"].as_f64().unwrap(),
        found["standard_error"].as_f64().unwrap(),
    )
}

#[test]
fn operator_at_1000_hz_matches_100_hz() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    // Each entry contains person, element, true crossover, margin and delay.
    for (person, element, truth) in [
        ("lead", "1/s^2", [1.1052, 52.97, 0.15]),
        ("gain", "1/s", [3.1805, 52.96, 0.15]),
        ("C1", "90/(s(s+6))", [1.5635, 76.67, 0.28]),
    ] {
        let found = [1000.0, 100.0].map(|hz| {
            let file = simulate(at, person, hz, 1);
            json(at, &["identify", &file, "--controlled-element", element, "--json"])
        });
        let numbers = |result: &Value| {
            let open_loop = &result["open_loop"];
            [
                value_and_error(&open_loop["crossover_rad_s"]),
                value_and_error(&open_loop["phase_margin_deg"]),
                value_and_error(&result["operator"]["tau_e"]),
            ]
        };
        let (fast, slow) = (numbers(&found[0]), numbers(&found[1]));
        for ((fast, slow), truth) in fast.into_iter().zip(slow).zip(truth) {
            assert!(
                (fast.0 - truth).abs() < 2.0 * fast.1,
                "{person}: {fast:?}, true {truth}"
            );
            assert!(
                (fast.0 - slow.0).abs() < 2.0 * fast.1.hypot(slow.1),
                "{person}: {fast:?} {slow:?}"
            );
        }
        assert_eq!(found[0]["verdict"]["level"], "trustworthy", "{person}");
        let record = &found[0]["records"][0];
        assert_eq!(record["sample_time"].as_f64().unwrap(), 0.01);
        let steps = record["preparation"].as_array().unwrap();
        let step = steps.iter().find(|step| step["step"] == "rate").unwrap();
        let of = |name: &str| step[name].as_f64().unwrap();
        assert_eq!((of("factor"), of("from_hz"), of("to_hz")), (10.0, 1000.0, 100.0));
        assert!((of("input_lead_s") - 0.0045).abs() < 1e-12);
        assert_eq!(found[1]["records"][0]["preparation"].as_array().unwrap().len(), 0);
    }
    let page = stdout_of(at, &["identify", "C1-1000-1.csv"]);
    assert!(
        page.contains("1000 Hz, filtered and decimated by 10 to 100 Hz"),
        "{page}"
    );
}

#[test]
fn describing_function_does_not_depend_on_the_rate() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    let file = simulate(at, "C1", 1000.0, 2);
    let described = |rate: &str| {
        let element = "90/(s(s+6))";
        json(
            at,
            &[
                "describe",
                &file,
                "--controlled-element",
                element,
                "--decimate",
                rate,
                "--json",
            ],
        )
    };
    let (auto, off) = (described("auto"), described("off"));
    assert_eq!(auto["records"][0]["samples"], 8192);
    assert_eq!(off["records"][0]["samples"], 81_920);
    let lines = |found: &Value| found["lines"].as_array().unwrap().clone();
    assert_eq!(lines(&auto).len(), lines(&off).len());
    for (a, b) in lines(&auto).iter().zip(lines(&off)) {
        let distance = |name: &str| (a[name].as_f64().unwrap() - b[name].as_f64().unwrap()).abs();
        // Without the correction, the lead of the input would be .0045 s, which is 1 deg at 4 rad/s.
        assert!(distance("gain_db") < 0.02 && distance("phase_deg") < 0.1, "{a} {b}");
    }
    let page = stdout_of(at, &["describe", &file]);
    assert!(page.contains("filtered and decimated by 10"), "{page}");
}

#[test]
fn track_at_1000_hz_is_determined() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    for seed in 1..=5 {
        let file = simulate(at, "smooth", 1000.0, seed);
        let arguments = ["track", &file, "--every", "100", "--out", "trace.csv", "--json"];
        let found = json(at, &arguments);
        assert_ne!(found["verdict"]["level"], "not determined", "{seed}");
        assert_eq!(found["records"][0]["preparation"][0]["to_hz"].as_f64().unwrap(), 100.0);
        // Rows are 100 samples of the file apart.
        let trace = fs::read_to_string(at.join("trace.csv")).unwrap();
        let times: Vec<f64> = trace
            .lines()
            .filter(|line| !line.starts_with('#'))
            .skip(1)
            .map(|line| line.split(',').next().unwrap().parse().unwrap())
            .collect();
        assert!(times.windows(2).all(|t| (t[1] - t[0] - 0.1).abs() < 1e-9), "{seed}");
    }
}

#[test]
fn options_in_samples_keep_the_rate() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    let file = simulate(at, "C1", 1000.0, 1);
    let fit = ["identify", &file, "--structure", "arx", "--nk", "281", "--json"];
    let output = hoid(at, &fit);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["records"][0]["sample_time"].as_f64().unwrap(), 0.001);
    let reported = String::from_utf8(output.stderr).unwrap();
    assert!(
        reported.contains("1000 Hz is kept") && reported.contains("--decimate 10"),
        "{reported}"
    );
    let fewer = [
        "identify",
        &file,
        "--structure",
        "arx",
        "--nk",
        "29",
        "--decimate",
        "10",
        "--json",
    ];
    assert_eq!(json(at, &fewer)["records"][0]["sample_time"].as_f64().unwrap(), 0.01);
    let reported = [
        "track", &file, "--nk", "281", "--every", "1000", "--out", "t.csv", "--json",
    ];
    assert_eq!(
        common::json_with_any_exit_code(at, &reported)["records"][0]["sample_time"]
            .as_f64()
            .unwrap(),
        0.001
    );
}

#[test]
fn common_rates_are_decimated() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    for (hz, factor) in [(200.0, 1), (250.0, 3), (1.0 / 0.003, 3), (2000.0, 20)] {
        let file = simulate(at, "gain", hz, 1);
        let found = json(at, &["describe", &file, "--json"]);
        let ts = found["records"][0]["sample_time"].as_f64().unwrap();
        assert!((ts * hz - f64::from(factor)).abs() < 1e-6, "{hz}: {ts}");
    }
    let file = simulate(at, "gain", 1000.0, 1);
    let (code, message) = failure_of(at, &["identify", &file, "--to", "0.1"]);
    assert!(
        code == 1 && message.contains("found 100 samples, but the filter"),
        "{message}"
    );
    for wrong in ["0", "on", "-3", "2.5"] {
        let (code, message) = failure_of(at, &["identify", &file, &format!("--decimate={wrong}")]);
        assert!(code == 2 && message.contains("expected auto, off"), "{message}");
    }
    // The record is cut at a gap, and each part is decimated.
    let text = fs::read_to_string(at.join(&file)).unwrap();
    let holed: String = text
        .lines()
        .enumerate()
        .filter(|(k, _)| !(30_000..30_400).contains(k))
        .fold(String::new(), |mut all, (_, line)| {
            writeln!(all, "{line}").unwrap();
            all
        });
    fs::write(at.join("holed.csv"), holed).unwrap();
    let found = json(at, &["identify", "holed.csv", "--mask", "gap", "--json"]);
    let records = found["records"].as_array().unwrap();
    assert_eq!(records.len(), 2);
    for record in records {
        assert_eq!(record["sample_time"].as_f64().unwrap(), 0.01);
    }
}

#[test]
fn stream_at_1000_hz_matches_track() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    let file = simulate(at, "lead", 1000.0, 1);
    // Any verdict is accepted, because 20 s are too short.
    hoid(at, &["track", &file, "--to", "20", "--out", "trace.csv"]);
    let text = fs::read_to_string(at.join(&file)).unwrap();
    let rows: Vec<&str> = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .take(20_001)
        .collect();
    let mut child = Command::new(env!("CARGO_BIN_EXE_hoid"))
        .args(["stream", "--fs", "1000"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    let lines = rows.join("\n") + "\n";
    let writer = std::thread::spawn(move || input.write_all(lines.as_bytes()).unwrap());
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    let answers: Vec<Value> = String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    // Each input line after the header is a sample and gives one output line.
    assert_eq!(answers.len(), rows.len() - 1);
    let last = &answers[answers.len() - 1];
    let decimated = &last["decimated"];
    assert_eq!(
        (decimated["factor"].as_f64(), decimated["to_hz"].as_f64()),
        (Some(10.0), Some(100.0))
    );
    let behind_s = decimated["behind_s"].as_f64().unwrap();
    assert!((0.1..0.2).contains(&behind_s), "{behind_s}");
    let reported = String::from_utf8(output.stderr).unwrap();
    assert!(
        reported.contains("filtered and decimated by 10 to 100 Hz"),
        "{reported}"
    );
    // For the same sample, the digits equal those of the trace.
    let trace = fs::read_to_string(at.join("trace.csv")).unwrap();
    let mut table = trace.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = table.next().unwrap().split(',').collect();
    let index = names.iter().position(|name| *name == "b0").unwrap();
    let value = last["parameters"]["b0"]["value"].as_f64().unwrap();
    // The gains are constant within a block, so the row is found by its time and not by its value.
    let at = last["t"].as_f64().unwrap() - behind_s;
    let row = table
        .map(|line| {
            line.split(',')
                .map(|cell| cell.parse().unwrap_or(f64::NAN))
                .collect::<Vec<f64>>()
        })
        .min_by(|a, b| (a[0] - at).abs().total_cmp(&(b[0] - at).abs()))
        .unwrap();
    assert!((row[0] - at).abs() < 0.0101, "{} {at}", row[0]);
    assert_eq!(row[index], value);
}
