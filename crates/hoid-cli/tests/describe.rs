//! `hoid describe` from the command line: simulated runs, signals known in closed form, and rejected input.
#![allow(clippy::unwrap_used)]

mod common;

use std::{f64::consts::TAU, fmt::Write, fs, path::Path};

use common::{failure_of, hoid, json, stdout_of};
use serde_json::Value;
use tempfile::TempDir;

/// Writes a record with periods of 20 s at 10 Hz: `d` has five lines, `e = d`, and u is given.
fn write(at: &Path, name: &str, samples: usize, u: impl Fn(f64, usize) -> f64) {
    let mut text = String::from("t,e,u,d,r\n");
    for k in 0..samples {
        let t = 0.1 * k as f64;
        let e = excitation(t);
        writeln!(text, "{t:.1},{e},{},{e},0", u(t, k)).unwrap();
    }
    fs::write(at.join(name), text).unwrap();
}

fn excitation(t: f64) -> f64 {
    [2.0, 5.0, 9.0, 14.0, 23.0]
        .map(|h: f64| (TAU * h * t / 20.0 + h).sin())
        .iter()
        .sum()
}

/// Returns a value of a fixed pseudo-random sequence.
fn pseudo_noise(k: usize, stream: usize) -> f64 {
    (0.37 * (k * k) as f64 + (3 * stream) as f64).sin()
}

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap()
}

#[test]
fn describe_finds_the_simulated_loop() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    let names = ["1.csv", "2.csv", "3.csv", "4.csv"];
    for name in names {
        let r = &name[..1];
        stdout_of(
            at,
            &[
                "simulate",
                "--condition",
                "C1",
                "--seed",
                "5",
                "--replication",
                r,
                "--out",
                name,
            ],
        );
    }
    let options = ["--excitation", "f_t", "--controlled-element", "90/(s(s+6))"];
    let all = [&["describe"], &names[..], &options[..], &["--json"]].concat();
    let found = json(at, &all);
    assert_eq!(found["verdict"]["level"], "trustworthy", "{}", found["verdict"]);
    assert_eq!(found["lines"].as_array().unwrap().len(), 10);
    assert_eq!(
        (found["runs"].as_array().unwrap().len(), &found["errors_between"]),
        (4, &Value::from("records"))
    );
    // The expected values are those of `hoid margins` for C1; the half sample of the hold reduces the phase margin by
    // 0.45 deg from 76.67 deg.
    for (name, truth) in [("crossover_rad_s", 1.5635), ("phase_margin_deg", 76.2)] {
        let e = &found["open_loop"][name];
        let (value, error) = (number(&e["value"]), number(&e["standard_error"]));
        assert!(
            (value - truth).abs() < 3.0 * error && error < 0.1 * truth,
            "{name}: {e}"
        );
    }
    assert!(number(&found["open_loop"]["gain_margin_db"]["value"]) > 3.0);
    let line = &found["lines"][4];
    for key in [
        "omega_rad_s",
        "gain_db",
        "gain_se_db",
        "phase_deg",
        "phase_se_deg",
        "coherence",
    ] {
        assert!(number(&line[key]).is_finite(), "{key}");
    }
    // By definition a tenth of the variance is remnant, some of which is at the lines.
    let remnant = &found["remnant"];
    let (share, ratio) = (
        number(&remnant["share"]["value"]),
        number(&remnant["noise_ratio"]["value"]),
    );
    assert!(share < ratio && (0.07..0.13).contains(&ratio), "{share} {ratio}");
    // The result with automatic detection is the same, here as text.
    let page = stdout_of(at, &[&["describe", "-v"], &names[..], &options[2..]].concat());
    assert!(page.starts_with("Verdict: trustworthy\n"), "{page}");
    for text in [
        "10 lines, over 4 runs of one period of 81.92 s",
        "90/(s^2 + 6s)",
        "found in f_t",
    ] {
        assert!(page.contains(text), "{text}: {page}");
    }
    // Three or more runs give errors between runs; the result of a single run is doubtful.
    let one = json(at, &["describe", "1.csv", "--json"]);
    assert_eq!(one["verdict"]["level"], "doubtful");
    assert_eq!(one["verdict"]["findings"][0]["kind"], "few-runs");
    assert!(one["lines"][0]["gain_se_db"].is_null() && one.get("open_loop").is_none());
}

#[test]
fn recording_offset_is_compensated() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    write(at, "run.csv", 800, |t, k| {
        2.0 * excitation(t - 0.5) + 0.05 * pseudo_noise(k, 0)
    });
    let phases = |options: &[&str]| -> Vec<f64> {
        let found = json(at, &[&["describe", "run.csv", "--json"], options].concat());
        assert_eq!(found["verdict"]["level"], "trustworthy", "{}", found["verdict"]);
        assert_eq!(
            (&found["excitation"]["channel"], &found["errors_between"]),
            (&Value::from("d"), &Value::from("periods"))
        );
        let lines = found["lines"].as_array().unwrap();
        let degrees = |l: &Value| (number(&l["phase_deg"]), number(&l["omega_rad_s"]));
        lines
            .iter()
            .map(degrees)
            .map(|(p, w)| p + (0.5 * w).to_degrees())
            .collect()
    };
    // The span keeps its whole periods regardless of the offset. The delay is 5 samples; the last line is shifted by
    // 207 deg without a phase jump.
    for options in [&[][..], &["--from", "0", "--to", "60"], &["--from", "20"]] {
        for phase in phases(options) {
            assert!(phase.abs() < 1.0, "{options:?} {phase}");
        }
    }
    for (options, samples) in [
        (&["--offset", "u=2"][..], 2.0),
        (&["--offset", "u=0.5s", "--from", "20"], 5.0),
        (&["--offset", "e=-1.5"], 1.5),
        (&["--offset", "d=3"], 0.0),
    ] {
        let omega = [2.0, 5.0, 9.0, 14.0, 23.0].map(|h| TAU * h / 20.0);
        for (phase, w) in phases(options).iter().zip(omega) {
            assert!(
                (phase - (0.1 * samples * w).to_degrees()).abs() < 1.0,
                "{options:?} {phase}"
            );
        }
    }
    let (code, message) = failure_of(at, &["describe", "run.csv", "--offset", "w=1"]);
    assert!(code == 2 && message.contains("no channel \"w\""), "{message}");
    // Columns are selected by name, as in `identify`.
    let by_name = [
        "describe",
        "run.csv",
        "--input",
        "r-d",
        "--output",
        "-u",
        "--excitation",
        "d",
        "--json",
    ];
    assert!((number(&json(at, &by_name)["lines"][0]["gain_db"]) - 20.0 * 2.0_f64.log10()).abs() < 0.1);
}

#[test]
fn figure_is_an_svg_of_the_requested_width() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    write(at, "run.csv", 800, |t, k| {
        2.0 * excitation(t - 0.3) + 0.05 * pseudo_noise(k, 1)
    });
    stdout_of(at, &["describe", "run.csv", "--figure", "bode.svg", "--width", "85mm"]);
    let svg = fs::read_to_string(at.join("bode.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.contains("width=\"85mm\"") && svg.contains("coherence"));
    for (options, expected) in [
        #[cfg(not(feature = "pdf-png"))]
        (&["--figure", "bode.pdf"][..], ".svg"),
        (&["--figure", "bode"][..], ".svg"),
        (&["--figure", "b.svg", "--width", "85"], "85mm"),
        (&["--width", "85mm"], "--figure"),
    ] {
        let (code, message) = failure_of(at, &[&["describe", "run.csv"], options].concat());
        assert!(code == 2 && message.contains(expected), "{message}");
    }
}

#[test]
fn unrelated_control_exits_with_one() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    let names = ["a.csv", "b.csv", "c.csv"];
    for (stream, name) in names.iter().enumerate() {
        write(at, name, 400, |_, k| pseudo_noise(k, stream));
    }
    let output = hoid(at, &[&["describe"], &names[..], &["--json"]].concat());
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(found["verdict"]["level"], "not determined");
    assert!(
        found["verdict"]["reasons"][0]
            .as_str()
            .unwrap()
            .contains("does not follow the excitation")
    );
    assert!(String::from_utf8(output.stderr).unwrap().contains("do not determine"));
}

#[test]
fn unusable_records_are_errors() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    write(at, "good.csv", 400, |t, k| excitation(t) + 0.1 * pseudo_noise(k, 0));
    write(at, "long.csv", 450, |t, k| excitation(t) + 0.1 * pseudo_noise(k, 0));
    write(at, "flat.csv", 400, |_, _| 1.0);
    fs::write(at.join("bare.csv"), "t,e,u\n0,1,2\n0.1,2,3\n0.2,1,2\n0.3,2,2\n").unwrap();
    fs::write(at.join("empty.csv"), "t,e,u,d\n").unwrap();
    for (options, code, expected) in [
        (&["bare.csv"][..], 1, "none among e, u"),
        (&["empty.csv"], 1, "empty.csv"),
        (&["good.csv", "--excitation", "w"], 1, "one of e, u, d, r"),
        (&["good.csv", "--excitation", "r"], 1, "r"),
        (&["flat.csv"], 1, "u"),
        (&["long.csv"], 1, "whole periods"),
        (
            &["long.csv", "--period", "20"],
            1,
            "use 40 s, the longest span of whole periods: 2 periods from 0 s to 40 s",
        ),
        (&["good.csv", "--lines", "1.0"], 2, "--period"),
        (
            &["good.csv", "--lines", "1.0", "--period", "20"],
            1,
            "harmonic of the period 20 s",
        ),
        (&["good.csv", "--lines", "1,x", "--period", "20"], 2, "x"),
        (&["good.csv", "--period", "0"], 1, "period"),
        (&["good.csv", "--controlled-element", "1/(s"], 2, "at character 5"),
        (&["nothing.csv"], 1, "nothing.csv"),
        (&["good.csv", "--from", "50"], 1, "good"),
        (&[], 2, "RECORD"),
    ] {
        let (found, message) = failure_of(at, &[&["describe"], options].concat());
        assert!(
            found == code && message.contains(expected),
            "{options:?} {found}: {message}"
        );
    }
    // The given lines are at harmonics of the period; a missing line makes the result doubtful.
    let lines = ["0.62831853", "1.57079633", "2.82743339"].join(",");
    let found = json(
        at,
        &["describe", "good.csv", "--lines", &lines, "--period", "20", "--json"],
    );
    assert_eq!(found["excitation"]["harmonics"], serde_json::json!([2, 5, 9]));
    assert_eq!(found["verdict"]["level"], "doubtful");
}
