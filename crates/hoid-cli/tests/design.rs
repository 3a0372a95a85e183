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

/// People of the population, and the files of a design.
#[test]
fn a_difference_has_its_people_and_the_files_are_readable() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    let arguments = [
        "design",
        "--controlled-element",
        "4/s",
        "--difference",
        "crossover=10%",
        "--out",
        "design",
        "--figure",
        "figure.svg",
    ];
    let page = good(at, &arguments);
    assert!(
        page.contains("A difference in crossover of") && page.contains("error of a run"),
        "{page}"
    );
    let object = json(at, &[&arguments[..], &["--json"]].concat());
    assert_eq!(object["form"], "gain");
    assert!(object["worst"]["name"].is_string() && object["difference"]["people"].as_u64().unwrap() > 2);
    for name in [
        "design.json",
        "design.csv",
        "design.md",
        "design.svg",
        "runs.svg",
        "power.csv",
        "scenario.toml",
        "lab.toml",
        "forcing.csv",
    ] {
        assert!(at.join("design").join(name).exists(), "{name}");
    }
    assert!(fs::read_to_string(at.join("figure.svg")).unwrap().contains("rad/s"));
    // The table of lines is a forcing function as the scenario is.
    let against = |file: &str| {
        let all = [&arguments[..5], &["--json", "--against", file]].concat();
        json(at, &all)["against"]["rms_e"].as_f64().unwrap()
    };
    let (table, scenario) = (against("design/forcing.csv"), against("design/scenario.toml"));
    assert!((table / scenario - 1.0).abs() < 1e-9);
    // The same seed is the same design, another has other phases.
    let phase = |seed: &str| {
        let all = [&arguments[..3], &["--json", "--seed", seed]].concat();
        json(at, &all)["lines"][3]["phase_rad"].as_f64().unwrap()
    };
    assert!(phase("1").to_bits() == phase("1").to_bits() && phase("1").to_bits() != phase("2").to_bits());
}

/// People of a group as it was printed, and its population.
#[test]
fn people_of_a_group_have_a_typical_and_a_worst_one() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    let person = |subject: &str, k: f64, tau: f64| {
        serde_json::json!({
            "subject": subject, "condition": "rate", "run": "all", "runs": 4, "form": "gain",
            "parameters": {"K": {"value": k}, "omega_nm": {"value": 10.0}, "zeta_nm": {"value": 0.3}, "tau_e": {"value": tau}},
            "verdict": {"level": "trustworthy", "reasons": []},
        })
    };
    let mut group = serde_json::json!({"hoid": "0", "group": "g", "people": [
        person("A", 0.5, 0.2), person("B", 0.6, 0.22), person("C", 0.3, 0.45), person("D", 3.0, 0.3),
    ]});
    let element = ["--controlled-element", "4/s", "--disturbance"];
    let of = |name: &str| json(at, &[&["design", "--people", name, "--json"], &element[..]].concat());
    fs::write(at.join("group.json"), group.to_string()).unwrap();
    let found = of("group.json");
    assert_eq!(found["person"], "typical of 4 people");
    assert_eq!(found["people"].as_array().unwrap().len(), 3);
    // D has no stable loop with this element.
    assert!(
        found["verdict"]["reasons"][0]
            .as_str()
            .unwrap()
            .starts_with("D is left out"),
        "{found}"
    );
    let (code, said) = bad(at, &["design", "--people", "group.json"]);
    assert!(code == 2 && said.contains("--controlled-element"), "{code} {said}");
    group["people"][1]["condition"] = "position".into();
    fs::write(at.join("group.json"), group.to_string()).unwrap();
    let (code, said) = bad(at, &[&["design", "--people", "group.json"], &element[..]].concat());
    assert!(code == 2 && said.contains("rate, position"), "{code} {said}");
    let parameter = |name: &str, value: f64| {
        let people: Vec<serde_json::Value> = [("A", 0.9), ("B", 1.1), ("C", 1.0)]
            .iter()
            .map(|(subject, by)| serde_json::json!({"subject": subject, "value": value * by}))
            .collect();
        serde_json::json!({"name": name, "value": value, "people": people})
    };
    let population = serde_json::json!({"kind": "population", "condition": "rate", "form": "gain", "parameters": [
        parameter("K", 0.8), parameter("omega_nm", 10.0), parameter("zeta_nm", 0.3), parameter("tau_e", 0.2),
    ]});
    fs::write(at.join("population.json"), population.to_string()).unwrap();
    let found = of("population.json");
    assert_eq!(found["person"], "typical of 3 people");
    assert!(found["worst"]["name"].is_string());
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
        (&["--form", "gain"], 2, "has its own"),
        (&["--display", "pursuit"], 2, "--disturbance"),
        (&["--difference", "crossover=0"], 2, "other than zero"),
        (&["--difference", "speed=1"], 2, "expected one of"),
        (&["--power", ".9"], 2, "--difference"),
    ] {
        let all = [&["design", "--people", "person.toml"], arguments].concat();
        let (found, said) = bad(at, &all);
        assert!(found == code && said.contains(word), "{arguments:?}: {found}, {said}");
    }
}
