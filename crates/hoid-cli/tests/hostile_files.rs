//! Damaged and unusual files: truncated, with decimal commas, without units, with cells that a
//! spreadsheet would execute.
#![allow(clippy::unwrap_used)]

mod common;

use std::{
    fs,
    io::Write,
    path::Path,
    process::{Command, Stdio},
};

use tempfile::TempDir;

use common::{BOX_JENKINS_OPTIONS, failure_of, json, stdout_of};

/// Returns a simulated run as text.
fn simulated_run_text(directory: &Path) -> String {
    stdout_of(directory, &["simulate", "--condition", "C1", "--out", "c1.csv"]);
    fs::read_to_string(directory.join("c1.csv")).unwrap()
}

#[test]
fn decimal_comma_is_explained_by_every_command() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    fs::write(d.join("comma.csv"), "t,e,u\n0.00,\"1,5\",2.5\n0.01,\"1,6\",2.6\n").unwrap();
    let info = stdout_of(d, &["info", "comma.csv"]);
    assert!(info.contains("decimal point instead of a comma"), "{info}");
    assert!(
        info.contains("column e, line 2: \"1,5\" is text (2 of 2 cells)"),
        "{info}"
    );
    let (_, message) = failure_of(d, &["identify", "comma.csv"]);
    assert!(message.contains("decimal point instead of a comma"), "{message}");
}

#[test]
fn truncated_files_are_reported() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let text = simulated_run_text(d);
    fs::write(d.join("cut.csv"), &text[..text.len() - 60]).unwrap();
    let (_, message) = failure_of(d, &["identify", "cut.csv"]);
    assert!(
        message.contains("cut.csv is truncated in line") && message.contains("remove that line"),
        "{message}"
    );
    for extension in ["parquet", "mat"] {
        let (whole, cut) = (format!("c1.{extension}"), format!("cut.{extension}"));
        stdout_of(d, &["simulate", "--condition", "C1", "--out", &whole]);
        let bytes = fs::read(d.join(&whole)).unwrap();
        fs::write(d.join(&cut), &bytes[..bytes.len() / 2]).unwrap();
        let (_, message) = failure_of(d, &["info", &cut]);
        assert!(message.contains("is truncated"), "{message}");
    }
    let xdf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/xdf/tracking.xdf");
    let bytes = fs::read(xdf).unwrap();
    fs::write(d.join("cut.xdf"), &bytes[..bytes.len() / 2]).unwrap();
    let info = stdout_of(d, &["info", "cut.xdf"]);
    assert!(info.contains("the file is truncated at byte"), "{info}");
}

#[test]
fn gains_without_units_are_not_in_degrees() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let text = simulated_run_text(d);
    let identify = [&["identify", "run.csv"][..], &BOX_JENKINS_OPTIONS].concat();
    for (units, declared, expected) in [
        ("# units: t s, e deg, u deg\n", None, Some("deg/deg")),
        ("# units: t s, e deg, u V\n", None, Some("V/deg")),
        ("", None, None),
        ("# units: e deg\n", None, None),
        ("# units: e deg\n", Some("u=V"), Some("V/deg")),
        ("", Some("e=mm,u=deg"), Some("deg/mm")),
        // Any word is accepted as a unit and kept unchanged.
        ("# units: e deg\n", Some("u=dog"), Some("dog/deg")),
    ] {
        let rest: String = text.lines().skip(1).map(|line| format!("{line}\n")).collect();
        fs::write(d.join("run.csv"), format!("{units}{rest}")).unwrap();
        let mut arguments = identify.to_vec();
        arguments.extend(declared.iter().flat_map(|units| ["--unit", units]));
        let page = stdout_of(d, &arguments);
        let gain = page.lines().find(|line| line.trim_start().starts_with("K_e ")).unwrap();
        match expected {
            Some(expected) => assert!(gain.contains(expected), "{units}: {gain}"),
            None => assert!(!gain.contains("deg"), "{gain}"),
        }
    }
    let found = json(d, &[&identify[..], &["--unit", "u=dog", "--json"]].concat());
    let units = serde_json::json!({"input": "deg", "output": "dog"});
    assert_eq!(found["records"][0]["units"], units);
    fs::write(d.join("run.csv"), text.replace("e deg", "e rad")).unwrap();
    let wrong = [&identify[..], &["--unit", "e=deg"]].concat();
    let (code, message) = failure_of(d, &wrong);
    assert!(code == 1 && message.contains("--scale e=rad:deg"), "{message}");
}

#[test]
fn formula_like_subjects_are_escaped_in_every_table() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    stdout_of(
        d,
        &[
            "simulate-group",
            "--subjects",
            "1",
            "--conditions",
            "C1",
            "--runs",
            "1",
            "--out",
            "h",
        ],
    );
    let manifest = d.join("h/group.toml");
    let text = fs::read_to_string(&manifest).unwrap();
    assert!(text.contains("\"S1\""), "{text}");
    fs::write(&manifest, text.replace("\"S1\"", "\"=1+1\"")).unwrap();
    stdout_of(d, &["group", "h", "--out", "results"]);
    let mut found = 0;
    for entry in fs::read_dir(d.join("results")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "csv") {
            let text = fs::read_to_string(&path).unwrap();
            found += text.matches("'=1+1").count();
            assert_eq!(
                text.matches("=1+1").count(),
                text.matches("'=1+1").count(),
                "{}",
                path.display()
            );
        }
    }
    assert!(found > 0, "no table names the subject");
}

#[test]
fn wrong_stream_rate_is_reported_once() {
    let mut stream = Command::new(env!("CARGO_BIN_EXE_hoid"))
        .args([
            "stream", "--fs", "100", "--method", "rpem", "--nk", "29", "--orders", "nd=1", "--start", "nothing",
        ])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = stream.stdin.take().unwrap();
    for k in 0..2000 {
        let t = 0.02 * f64::from(k);
        writeln!(input, "{t},{},{}", (1.7 * t).sin(), 0.1 * (1.7 * t - 0.8).sin()).unwrap();
    }
    drop(input);
    let printed = String::from_utf8(stream.wait_with_output().unwrap().stderr).unwrap();
    assert_eq!(printed.matches("warning").count(), 1, "{printed}");
    assert!(printed.contains("t gives a sampling rate of 50.0000 Hz"), "{printed}");
}
