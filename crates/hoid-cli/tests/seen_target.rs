//! Conditions of the thesis with a displayed target: `hoid simulate`, then `hoid identify` of both responses.
#![allow(clippy::unwrap_used)]

mod common;

use std::{fs, path::Path};

use common::{failure_of, json, stdout_of};
use serde_json::Value;
use tempfile::TempDir;

const DISPLAY_OPTIONS: [&str; 4] = [
    "--feedforward",
    "derivative:0.05,tau_f=0.1,preview=0.25",
    "--disturbance",
    "0.1",
];
const ELEMENTS: [(&str, &str); 2] = [("C1", "90/(s(s+6))"), ("C2", "30/(s(s+0.2))")];

fn simulate(at: &Path, condition: &str, seed: &str, others: &[&str]) {
    let base = ["simulate", "--condition", condition, "--seed", seed, "--out", "run.csv"];
    stdout_of(at, &[&base[..], &DISPLAY_OPTIONS, others].concat());
}

fn identify(at: &Path, element: &str, others: &[&str]) -> Value {
    let base = [
        "identify",
        "run.csv",
        "--input",
        "e",
        "--input",
        "f_t",
        "--intersample",
        "zoh",
        "--json",
    ];
    let roles = ["--role", "f_t=feedforward:0.25", "--controlled-element", element];
    json(at, &[&base[..], &roles, others].concat())
}

fn parameter<'v>(found: &'v Value, channel: usize, name: &str) -> &'v Value {
    let all = found["channels"][channel]["parameters"].as_array().unwrap();
    all.iter().find(|p| p["name"] == name).unwrap()
}

fn value(estimate: &Value) -> f64 {
    estimate["value"].as_f64().unwrap()
}

/// Crossover and phase margin, computed by hand, are 1.5635 rad/s and 76.67 deg in C1, and 2.7480 rad/s and 22.90 deg
/// in C2.
#[test]
fn both_responses_are_found_within_their_errors() {
    let at = TempDir::new().unwrap();
    let mut squares = [0.0; 4];
    let runs = [(0, "1"), (0, "2"), (0, "3"), (1, "1"), (1, "2")];
    for (index, seed) in runs {
        let (condition, element) = ELEMENTS[index];
        simulate(at.path(), condition, seed, &[]);
        let found = identify(at.path(), element, &[]);
        assert_eq!(found["channels"][0]["form"], "lead", "{condition} {seed}");
        assert_eq!(found["channels"][1]["form"], "derivative", "{condition} {seed}");
        assert_eq!(found["verdict"]["level"], "trustworthy", "{}", found["verdict"]);
        let crossover = &found["open_loop"]["crossover_rad_s"];
        let margin = &found["open_loop"]["phase_margin_deg"];
        for (k, (estimate, truth)) in [
            (crossover, [1.5635, 2.7480][index]),
            (margin, [76.67, 22.90][index]),
            (parameter(&found, 1, "K_d"), 0.05),
            (parameter(&found, 1, "tau_f"), 0.1),
        ]
        .into_iter()
        .enumerate()
        {
            let off = (value(estimate) - truth) / estimate["standard_error"].as_f64().unwrap();
            assert!(off.abs() < 3.5, "{condition} {seed} {k}: {off} errors");
            squares[k] += off * off;
        }
    }
    // The 0.1 % quantile of chi-square with five degrees of freedom is 20.5.
    assert!(squares.iter().all(|sum| *sum < 20.5), "{squares:?}");
}

#[test]
fn both_responses_are_exact_without_noise() {
    let at = TempDir::new().unwrap();
    for (condition, element) in ELEMENTS {
        simulate(at.path(), condition, "1", &["--noise-level", "0"]);
        let found = identify(at.path(), element, &["--form", "lead"]);
        let truth = if condition == "C1" { [0.09, 0.4] } else { [0.07, 1.2] };
        for (channel, name, truth, error) in [
            (0, "K_e", truth[0], 1e-5),
            (0, "T_L", truth[1], 1e-4),
            (0, "omega_nm", 11.25, 1e-4),
            (0, "zeta_nm", 0.35, 1e-4),
            (0, "tau_e", 0.28, 1e-4),
            (1, "K_d", 0.05, 1e-4),
            (1, "tau_f", 0.1, 1e-4),
        ] {
            let off = value(parameter(&found, channel, name)) / truth - 1.0;
            assert!(off.abs() < error, "{condition} {name}: {off}");
        }
        assert_eq!(found["channels"][1]["form"], "derivative");
    }
}

/// At 81.92 s both the condition and the response to the target change; the response is found in both halves.
#[test]
fn changed_response_is_found_in_both_halves() {
    let at = TempDir::new().unwrap();
    let text = "condition = \"C4\"\nmeasurement_s = 163.84\ndisturbance_rms_deg = 0.1\nremnant.noise_level = 0.01\n\
                [schedule]\nmidpoint_s = 81.92\n[feedforward]\nform = \"derivative\"\nK_d_s = 0.03\ntau_f_s = 0.1\n\
                [feedforward.last]\nK_d_s = 0.06\n";
    fs::write(at.path().join("task.toml"), text).unwrap();
    stdout_of(
        at.path(),
        &["simulate", "--scenario", "task.toml", "--seed", "4", "--out", "run.csv"],
    );
    let record = fs::read_to_string(at.path().join("run.csv")).unwrap();
    assert!(record.contains("# roles: f_t feedforward\n"), "{}", &record[..400]);
    for (from, to, truth) in [("0", "81.92", 0.03), ("87", "163.84", 0.06)] {
        let found = json(
            at.path(),
            &[
                "identify",
                "run.csv",
                "--role",
                "f_t=feedforward/derivative",
                "--from",
                from,
                "--to",
                to,
                "--intersample",
                "zoh",
                "--form",
                "lead",
                "--json",
            ],
        );
        let k_d = parameter(&found, 1, "K_d");
        let off = (value(k_d) - truth) / k_d["standard_error"].as_f64().unwrap();
        assert!(
            off.abs() < 3.5 && (value(k_d) / truth - 1.0).abs() < 0.1,
            "{from}: {k_d}"
        );
    }
}

#[test]
fn recording_states_the_display() {
    let at = TempDir::new().unwrap();
    simulate(at.path(), "C4", "1", &[]);
    let record = fs::read_to_string(at.path().join("run.csv")).unwrap();
    assert!(record.contains("# roles: f_t feedforward:0.25\n"), "{}", &record[..400]);
    let header = record.lines().find(|line| !line.starts_with('#')).unwrap();
    for column in ["f_t", "d", "f_t_K_d", "f_t_tau_f"] {
        assert!(header.split(',').any(|name| name == column), "{header}");
    }
    // A fit that does not use the target is doubtful.
    let one = json(at.path(), &["identify", "run.csv", "--json"]);
    assert!(
        one["verdict"].to_string().contains("f_t=feedforward:0.25"),
        "{}",
        one["verdict"]
    );
}

#[test]
fn plan_with_displays_is_simulated_and_analysed() {
    let at = TempDir::new().unwrap();
    let plan = "name = \"display\"\ntitle = \"A displayed target\"\nseed = 5\nreplications = 2\n\
                [[scenarios]]\nname = \"seen\"\ncondition = \"C1\"\ndisturbance_rms_deg = 0.1\n\
                feedforward.form = \"derivative\"\nfeedforward.K_d_s = [0.0, 0.05]\nfeedforward.tau_f_s = 0.1\n\
                feedforward.preview_s = 0.25\n\
                [[estimators]]\nname = \"person\"\nmethod = \"operator\"\nform = \"lead\"\nintersample = \"zoh\"\n\
                role = [\"f_t=feedforward:0.25\"]\n";
    fs::write(at.path().join("plan.toml"), plan).unwrap();
    stdout_of(at.path(), &["study", "run", "plan.toml", "--out", "out", "--csv"]);
    let fits = fs::read_to_string(at.path().join("out/fits.csv")).unwrap();
    let mut rows = fits.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = rows.next().unwrap().split(',').collect();
    let index = |name: &str| header.iter().position(|column| *column == name).unwrap();
    let mut count = 0;
    for row in rows {
        let row: Vec<&str> = row.split(',').collect();
        assert_eq!(row[index("status")], "ok", "{row:?}");
        let number = |name: &str| row[index(name)].parse::<f64>().unwrap();
        let off = (number("K_e") - 0.09) / number("K_e_se");
        assert!(off.abs() < 3.5, "{off}");
        count += 1;
    }
    assert_eq!(count, 4);
}

#[test]
fn invalid_displays_are_refused() {
    let at = TempDir::new().unwrap();
    let simulate = ["simulate", "--condition", "C4", "--out", "run.csv"];
    for (options, words) in [
        (["--feedforward", "derivative"], "--feedforward is wrong"),
        (
            ["--feedforward", "derivative:0.05,preview=0.255"],
            "whole number of samples",
        ),
        (
            ["--feedforward", "derivative:0.05,tau_f=-0.1"],
            "before it is displayed",
        ),
        (["--disturbance", "-1"], "--disturbance is wrong"),
        (["--disturbance", "nan"], "--disturbance is wrong"),
    ] {
        let message = failure_of(at.path(), &[&simulate[..], &options].concat());
        let message = format!("{message:?}");
        assert!(message.contains(words), "{options:?}: {message}");
    }
    assert!(!at.path().join("run.csv").exists());
}

/// Values that the data do not determine are in parentheses; the page has a curve of each parameter of F and of F at
/// each frequency.
#[test]
fn tracked_response_to_the_target_is_printed_and_drawn() {
    let at = TempDir::new().unwrap();
    simulate(at.path(), "C1", "1", &[]);
    let options = [
        "track",
        "run.csv",
        "--input",
        "e",
        "--input",
        "f_t",
        "--role",
        "f_t=feedforward:0.25",
        "--at",
        "2",
    ];
    let text = stdout_of(at.path(), &[&options[..], &["--report", "page"]].concat());
    let table = text.split_once("Response to f_t.").unwrap().1;
    let first = table.lines().find(|line| line.contains('±')).unwrap();
    assert!(first.contains('('), "{text}");
    assert!(
        table.contains("In parentheses: not determined by the data so far."),
        "{text}"
    );
    let page = fs::read_to_string(at.path().join("page/report.html")).unwrap();
    assert!(page.contains("Subscript f: the response to f_t."));
    for label in ["|F(2)|", "\u{2220}F(2)", "\u{1e1f}</tspan>"] {
        assert!(page.contains(label), "{label}");
    }
    let found = json(at.path(), &[&options[..], &["--json"]].concat());
    let determined = |name: &str| parameter(&found, 1, name)["determined"].as_bool().unwrap();
    assert!(determined("K_f_dot") && !determined("K_f"), "{}", found["channels"]);
}
