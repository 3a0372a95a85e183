//! Verdicts on results, as shown to the user.
#![allow(clippy::unwrap_used)]

mod common;

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
};

use serde_json::Value;
use tempfile::TempDir;

use common::{BOX_JENKINS_OPTIONS, hoid, json, stdout_of};

fn simulated_run(condition: &str) -> TempDir {
    let directory = TempDir::new().unwrap();
    let arguments = ["simulate", "--condition", condition, "--seed", "1", "--out", "c.csv"];
    stdout_of(directory.path(), &arguments);
    directory
}

/// Writes a run with the same errors and an independent output.
fn remove_response(directory: &Path) {
    let mut state = 11_u64;
    let mut draw = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let lines = (0..4000).map(|k| {
        let t = f64::from(k) / 100.0;
        format!(
            "{t},{},{}\n",
            (1.7 * t).sin() + 0.5 * (9.1 * t).sin() + 0.1 * draw(),
            draw()
        )
    });
    fs::write(
        directory.join("n.csv"),
        "t,e,u\n".to_owned() + &lines.collect::<String>(),
    )
    .unwrap();
}

#[test]
fn clean_run_is_trustworthy_in_text_and_json() {
    let directory = simulated_run("C1");
    let d = directory.path();
    let mut arguments = vec!["identify", "c.csv"];
    arguments.extend(BOX_JENKINS_OPTIONS);
    let page = stdout_of(d, &arguments);
    assert!(
        page.starts_with("Verdict: trustworthy\n\nBJ(nb=2, nd=1, nf=2, nk=29)\n")
            && page.contains("c.csv: 8192 samples"),
        "{page}"
    );
    arguments.push("--json");
    let found = json(d, &arguments);
    assert_eq!(found["verdict"]["level"], "trustworthy");
    assert_eq!(found["verdict"]["reasons"], serde_json::json!([]));
    let grey = [
        "identify",
        "c.csv",
        "--structure",
        "grey-box",
        "--remnant-order",
        "1",
        "--json",
    ];
    assert_eq!(json(d, &grey)["verdict"]["level"], "trustworthy");
}

#[test]
fn delay_at_its_bound_is_the_first_finding() {
    let directory = simulated_run("C1");
    let d = directory.path();
    let arguments = [
        "identify",
        "c.csv",
        "--structure",
        "bj",
        "--nk",
        "20..24",
        "--orders",
        "nd=1",
    ];
    let page = stdout_of(d, &arguments);
    assert!(page.starts_with("Verdict: doubtful\n- "), "{page}");
    assert!(
        page.contains("is at an end of its search range, 0.190 to 0.230 s"),
        "{page}"
    );
    let oe = json(d, &["identify", "c.csv", "--structure", "oe", "--nk", "29", "--json"]);
    let kinds: Vec<&str> = oe["verdict"]["findings"]
        .as_array()
        .unwrap()
        .iter()
        .map(|f| f["kind"].as_str().unwrap())
        .collect();
    assert!(kinds.contains(&"residuals-not-white"), "{kinds:?}");
}

#[test]
fn undetermined_result_is_printed_and_exits_with_one() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    remove_response(d);
    let arguments = [
        "identify",
        "n.csv",
        "--structure",
        "fir",
        "--nk",
        "29",
        "--orders",
        "nb=3",
    ];
    let output = hoid(d, &arguments);
    assert_eq!(output.status.code(), Some(1));
    let (page, stderr) = (
        String::from_utf8(output.stdout).unwrap(),
        String::from_utf8(output.stderr).unwrap(),
    );
    assert!(
        page.starts_with("Verdict: not determined\n- B does not differ"),
        "{page}"
    );
    assert!(
        page.contains("b0") && stderr.contains("the data do not determine"),
        "{stderr}"
    );
}

#[test]
fn trace_includes_the_findings_of_its_start() {
    let directory = simulated_run("C4");
    let d = directory.path();
    let physical = [
        "track",
        "c.csv",
        "--method",
        "physical",
        "--nk",
        "29",
        "--orders",
        "nd=1",
        "--out",
        "trace.csv",
    ];
    let page = stdout_of(d, &physical);
    assert!(page.starts_with("Verdict: trustworthy\n"), "{page}");
    let rls = json(
        d,
        &[
            "track",
            "c.csv",
            "--method",
            "rls",
            "--nk",
            "29",
            "--out",
            "trace.csv",
            "--json",
        ],
    );
    assert_eq!(rls["verdict"]["level"], "doubtful");
    let reasons = rls["verdict"]["reasons"].as_array().unwrap();
    assert!(
        reasons
            .iter()
            .any(|r| r["message"].as_str().unwrap().starts_with("start fit: ")),
        "{reasons:?}"
    );
    assert!(rls["start"]["verdict"]["level"].is_string());
}

/// Returns the lines of a stream and its exit code.
fn run_stream(directory: &Path, more: &[&str]) -> (Vec<Value>, Option<i32>) {
    let output = Command::new(env!("CARGO_BIN_EXE_hoid"))
        .args([
            "stream", "--fs", "100", "--method", "physical", "--nk", "29", "--orders", "nd=1", "--every", "500",
        ])
        .args(more)
        .stdin(fs::File::open(directory.join("c.csv")).unwrap())
        .stderr(Stdio::null())
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let lines = text.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    (lines, output.status.code())
}

#[test]
fn stream_lines_have_a_level_that_sets_the_exit_code() {
    let directory = simulated_run("C1");
    let (lines, code) = run_stream(directory.path(), &[]);
    assert_eq!(code, Some(0));
    assert_eq!(lines[0]["level"], "not determined");
    assert_eq!(
        lines.last().unwrap()["level"],
        "trustworthy",
        "{}",
        lines.last().unwrap()
    );
    let (lines, code) = run_stream(directory.path(), &["--warm-up", "200"]);
    assert_eq!(code, Some(1));
    assert!(lines.iter().all(|line| line["level"] == "not determined"));
}

#[test]
fn wrong_controlled_element_is_doubtful_in_every_command() {
    let directory = simulated_run("C1");
    let d = directory.path();
    let box_jenkins = [&["identify", "c.csv"][..], &BOX_JENKINS_OPTIONS].concat();
    let commands: [&[&str]; 4] = [
        &["identify", "c.csv"],
        &box_jenkins,
        &["describe", "c.csv", "--excitation", "f_t"],
        &["track", "c.csv"],
    ];
    let found = |command: &[&str], element: &str| -> Vec<String> {
        let printed = json(d, &[command, &["--controlled-element", element, "--json"]].concat());
        let findings = printed["verdict"]["findings"].as_array().unwrap();
        let of_element = findings
            .iter()
            .filter(|finding| finding["kind"] == "controlled-element");
        of_element
            .map(|finding| finding["message"].as_str().unwrap().to_owned())
            .collect()
    };
    for command in commands {
        assert_eq!(found(command, "90/(s(s+6))"), [""; 0], "{command:?}");
        let [message] = found(command, "45/(s(s+6))").try_into().unwrap();
        assert!(
            message.starts_with("the recorded element is 90/(s^2 + 6s), not 45/(s^2 + 6s)"),
            "{command:?}: {message}"
        );
    }
}

/// Checks that a verdict has the shape of the interface: reasons as objects, and a verdict on each of these answers.
fn check_shape(verdict: &Value, answers: &[&str], of: &str) {
    let check = |found: &Value, lists: &[&str]| {
        assert!(found["level"].is_string(), "{of}: {found}");
        for one in lists.iter().flat_map(|list| found[list].as_array().unwrap()) {
            let keys: Vec<&String> = one.as_object().unwrap().keys().collect();
            assert_eq!(keys, ["kind", "severity", "message", "from", "to"], "{of}: {one}");
            assert!(!one["kind"].as_str().unwrap().is_empty(), "{of}: {one}");
            assert_eq!(one["from"].is_number(), one["to"].is_number(), "{of}: {one}");
        }
    };
    check(verdict, &["reasons", "notes"]);
    for answer in answers {
        check(&verdict["of"][answer], &["reasons"]);
    }
    // A reason against the whole result is a reason against each answer.
    let level = &verdict["of"]["response"]["level"];
    assert!(*level == verdict["level"] || *level == "trustworthy", "{of}: {verdict}");
}

/// Writes the run with a sensor of e that freezes from 40 to 46 s.
fn freeze_error(directory: &Path) {
    let text = fs::read_to_string(directory.join("c.csv")).unwrap();
    let mut column = None;
    let mut held = String::new();
    let line = |line: &str| {
        let mut cells: Vec<&str> = line.split(',').collect();
        let Some(e) = column.or_else(|| cells.iter().position(|cell| *cell == "e")) else {
            return format!("{line}\n");
        };
        match cells[0].parse::<f64>() {
            Ok(t) if (40.0..46.0).contains(&t) => cells[e] = &held,
            _ => cells[e].clone_into(&mut held),
        }
        column = Some(e);
        format!("{}\n", cells.join(","))
    };
    let frozen: String = text.lines().map(line).collect();
    fs::write(directory.join("frozen.csv"), frozen).unwrap();
}

#[test]
fn every_result_has_reasons_with_kinds_and_a_verdict_on_each_answer() {
    let directory = simulated_run("C1");
    let d = directory.path();
    freeze_error(d);
    let of_loop = ["response", "crossover", "phase_margin", "K_e", "tau_e"];
    let box_jenkins = [&["identify", "frozen.csv"][..], &BOX_JENKINS_OPTIONS].concat();
    let commands: [(&[&str], &[&str]); 5] = [
        (&["identify", "frozen.csv"], &of_loop),
        (&box_jenkins, &of_loop[..4]),
        (
            &["identify", "frozen.csv", "--noise", "remnant", "--remnant-order", "1"],
            &of_loop,
        ),
        (&["describe", "frozen.csv", "--excitation", "f_t"], &of_loop[..3]),
        (&["track", "frozen.csv"], &of_loop),
    ];
    for (command, answers) in commands {
        let element: &[&str] = &["--controlled-element", "90/(s(s+6))", "--json"];
        let faults: &[&str] = if command[0] == "track" {
            &[]
        } else {
            &["--faults", "report"]
        };
        let found = json(d, &[command, element, faults].concat());
        let verdict = &found["verdict"];
        check_shape(verdict, answers, &command.join(" "));
        let spans: Vec<[f64; 2]> = (verdict["reasons"].as_array().unwrap().iter())
            .filter_map(|reason| Some([reason["from"].as_f64()?, reason["to"].as_f64()?]))
            .collect();
        let is_meant = |span: &[f64; 2]| (span[0] - 40.0).abs() < 1.5 && (span[1] - 46.0).abs() < 1.5;
        assert!(spans.iter().any(is_meant), "{command:?}: {verdict}");
    }
}
