//! A forcing function is designed, evaluated and simulated.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;

use common::{bad, good, json};
use tempfile::TempDir;

const PERSON: &str = "form = \"lead\"\n\n[initial]\nK = 1.0\nT_L_s = 0.4\nomega_nm_rad_s = 10\nzeta_nm = 0.3\ntau_e_s = 0.25\n\
                      controlled_element = \"4/(s(s+1))\"\n";

#[test]
fn a_design_is_judged_and_runs() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    fs::write(at.join("person.toml"), PERSON).unwrap();
    let arguments = [
        "design",
        "--people",
        "person.toml",
        "--for",
        "tau_e=1%,margin=1",
        "--against",
        "reference",
        "--out",
        "design",
    ];
    let said = good(at, &arguments);
    assert!(
        said.starts_with("Errors to be expected of") && said.contains("With reference it takes"),
        "{said}"
    );
    let object = json(
        at,
        &[&arguments[..], &["--json", "--runs", "4", "--table", "t.md"]].concat(),
    );
    assert_eq!(
        (object["kind"].as_str(), object["runs"].as_u64()),
        (Some("design"), Some(4))
    );
    let tau = object["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .find(|p| p["name"] == "tau_e")
        .unwrap();
    let of_text = object["against"]["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .find(|p| p["name"] == "tau_e")
        .unwrap();
    assert!(tau["standard_error"].as_f64().unwrap() < of_text["standard_error"].as_f64().unwrap());
    assert!(fs::read_to_string(at.join("t.md")).unwrap().contains("| tau_e | 0.25"));
    // The scenario contains the operator, and the lines are those of the design.
    good(
        at,
        &["simulate", "--scenario", "design/scenario.toml", "--out", "run.csv"],
    );
    let again = json(
        at,
        &[
            "design",
            "--people",
            "design/scenario.toml",
            "--against",
            "design/scenario.toml",
            "--json",
        ],
    );
    let of_design = good(
        at,
        &[
            "design",
            "--people",
            "person.toml",
            "--for",
            "tau_e=1%,margin=1",
            "--runs",
            "1",
            "--json",
        ],
    );
    let of_design: serde_json::Value = serde_json::from_str(&of_design).unwrap();
    let error = |o: &serde_json::Value| o["open_loop"]["crossover_rad_s"]["standard_error"].as_f64().unwrap();
    assert!((error(&again["against"]) / error(&of_design) - 1.0).abs() < 1e-6);
}

#[test]
fn mistakes_have_remedies() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    fs::write(at.join("person.toml"), PERSON).unwrap();
    for (arguments, code, word) in [
        (&["--for", "T_I=5%"][..], 2, "expected one of crossover"),
        (&["--for", "tau_e"], 2, "write NAME=5%"),
        (&["--lines", "1"], 1, "add lines"),
        (&["--remnant-share", "1"], 2, "below 1"),
        (&["--controlled-element", "900/(s(s+1))"], 1, "roots"),
        (&["--against", "nowhere.toml"], 1, "nowhere.toml"),
    ] {
        let all = [&["design", "--people", "person.toml"], arguments].concat();
        let (found, said) = bad(at, &all);
        assert!(found == code && said.contains(word), "{arguments:?}: {found}, {said}");
    }
}
