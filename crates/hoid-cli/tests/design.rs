//! A forcing function is designed, evaluated and simulated.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;

use common::{failure_of, json, stdout_of};
use tempfile::TempDir;

const PERSON: &str = "form = \"lead\"\n\n[initial]\nK = 1.0\nT_L_s = 0.4\nomega_nm_rad_s = 10\nzeta_nm = 0.3\ntau_e_s = 0.25\n\
                      controlled_element = \"4/(s(s+1))\"\n";

#[test]
fn design_is_reported_and_can_be_simulated() {
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
    let message = stdout_of(at, &arguments);
    assert!(
        message.starts_with("Expected errors of") && message.contains("With reference they require"),
        "{message}"
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
    // The scenario contains the operator and the lines of the design.
    stdout_of(
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
    let of_design = stdout_of(
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

/// The number of people for a difference is computed for the population, and the files of a design can be read.
#[test]
fn difference_gives_the_number_of_people() {
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
    let page = stdout_of(at, &arguments);
    assert!(
        page.contains("Detecting a difference in crossover of") && page.contains("error of a run"),
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
    // The table has the errors for the person, with the variation from run to run.
    let table = fs::read_to_string(at.join("design/design.csv")).unwrap();
    assert!(
        table.contains("quantity,value,standard_error_person,low,high"),
        "{table}"
    );
    let crossover = &object["open_loop"]["crossover_rad_s"];
    let [own, person] = ["standard_error", "standard_error_person"].map(|key| crossover[key].as_f64().unwrap());
    let (value, runs) = (crossover["value"].as_f64().unwrap(), object["runs"].as_f64().unwrap());
    assert!(
        (person - own.hypot(0.13 * value / runs.sqrt())).abs() < 1e-9 * person,
        "{object}"
    );
    // The table of lines can be used as a forcing function, like the scenario.
    let against = |file: &str| {
        let all = [&arguments[..5], &["--json", "--against", file]].concat();
        json(at, &all)["against"]["rms_e"].as_f64().unwrap()
    };
    let (table, scenario) = (against("design/forcing.csv"), against("design/scenario.toml"));
    assert!((table / scenario - 1.0).abs() < 1e-9);
    // The same seed gives the same design; another seed gives other phases.
    let phase = |seed: &str| {
        let all = [&arguments[..3], &["--json", "--seed", seed]].concat();
        json(at, &all)["lines"][3]["phase_rad"].as_f64().unwrap()
    };
    assert!(phase("1").to_bits() == phase("1").to_bits() && phase("1").to_bits() != phase("2").to_bits());
}

/// A design for people, given by the printed result of a group or by a population, has a typical and a worst person.
#[test]
fn group_design_has_a_typical_and_a_worst_person() {
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
        found["verdict"]["reasons"][0]["message"]
            .as_str()
            .unwrap()
            .starts_with("D is left out"),
        "{found}"
    );
    let (code, message) = failure_of(at, &["design", "--people", "group.json"]);
    assert!(
        code == 2 && message.contains("--controlled-element"),
        "{code} {message}"
    );
    group["people"][1]["condition"] = "position".into();
    fs::write(at.join("group.json"), group.to_string()).unwrap();
    let (code, message) = failure_of(at, &[&["design", "--people", "group.json"], &element[..]].concat());
    assert!(code == 2 && message.contains("rate, position"), "{code} {message}");
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

/// With a displayed target, both responses have expected errors, and the experiment can be simulated and identified.
#[test]
fn both_responses_to_a_displayed_target_are_designed() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    let arguments = ["design", "--controlled-element", "4/s", "--display", "pursuit"];
    let all = [&arguments[..], &["--remnant-share", ".1", "--out", "design"]].concat();
    let page = stdout_of(at, &all);
    for words in [
        "K_f (s)",
        "tau_f (s)",
        "response to the target (derivative",
        "disturbance",
    ] {
        assert!(page.contains(words), "{words}: {page}");
    }
    let object = json(at, &[&all[..], &["--json"]].concat());
    assert_eq!(object["feedforward"]["form"], "derivative");
    let lab = fs::read_to_string(at.join("design/lab.toml")).unwrap();
    assert!(lab.contains("display = \"pursuit\""), "{lab}");
    assert!(
        fs::read_to_string(at.join("design/design.svg"))
            .unwrap()
            .contains("gain of F")
    );
    stdout_of(
        at,
        &["simulate", "--scenario", "design/scenario.toml", "--out", "run.csv"],
    );
    let fit = json(
        at,
        &[
            "identify",
            "run.csv",
            "--role",
            "f_t=feedforward/derivative",
            "--form",
            "gain",
            "--intersample",
            "zoh",
            "--json",
        ],
    );
    // The gain of the response to the target is within four of the expected standard errors.
    let named = |all: &serde_json::Value, name: &str| {
        let found = all.as_array().unwrap().iter().find(|p| p["name"] == name);
        found.unwrap().clone()
    };
    let designed = named(&object["parameters"], "K_f");
    let found = named(&fit["channels"][1]["parameters"], "K_d");
    let off = (found["value"].as_f64().unwrap() - designed["value"].as_f64().unwrap()).abs();
    assert!(
        off < 4.0 * designed["standard_error"].as_f64().unwrap(),
        "{found} {designed}"
    );
    // The same task is designed for the identified person.
    fs::write(at.join("fit.json"), fit.to_string()).unwrap();
    let again = json(at, &[&arguments[..], &["--people", "fit.json", "--json"]].concat());
    assert_eq!(named(&again["parameters"], "K_f")["value"], found["value"]);
    // A pair of forcing functions is evaluated from a scenario, because a table contains only one.
    let again = json(
        at,
        &[&arguments[..], &["--against", "design/scenario.toml", "--json"]].concat(),
    );
    assert!((again["against"]["rms_e"].as_f64().unwrap() / again["rms_e"].as_f64().unwrap() - 1.0).abs() < 1e-6);
}

/// The spread of a difference between people can come from a comparison, a group or a population.
#[test]
fn spread_of_a_difference_comes_from_the_people() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    let person = |subject: &str, condition: &str, tau: f64| {
        serde_json::json!({
            "subject": subject, "condition": condition, "run": "all", "runs": 4, "form": "gain",
            "parameters": {
                "K": {"value": 0.6, "standard_error": 0.01}, "omega_nm": {"value": 10.0, "standard_error": 0.1},
                "zeta_nm": {"value": 0.3, "standard_error": 0.01}, "tau_e": {"value": tau, "standard_error": 0.002},
            },
            "verdict": {"level": "trustworthy", "reasons": []},
        })
    };
    let group = serde_json::json!({"hoid": "0", "group": "g", "people": [
        person("A", "rate", 0.2), person("B", "rate", 0.22), person("C", "rate", 0.18), person("D", "rate", 0.2),
        person("A", "slow", 0.24), person("B", "slow", 0.31), person("C", "slow", 0.26), person("D", "slow", 0.22),
    ]});
    fs::write(at.join("group.json"), group.to_string()).unwrap();
    let compared = stdout_of(at, &["compare", "group.json", "--of", "tau_e", "--json"]);
    fs::write(at.join("comparison.json"), &compared).unwrap();
    let compared: serde_json::Value = serde_json::from_str(&compared).unwrap();
    let tau = compared["differences"][0]["tau"].as_f64().unwrap();
    assert!(tau > 0.02, "{tau}");
    let design = [
        "design",
        "--controlled-element",
        "4/s",
        "--difference",
        "tau_e=10%",
        "--json",
    ];
    let plan = |more: &[&str]| json(at, &[&design[..], more].concat())["difference"].clone();
    let spread = |plan: &serde_json::Value| plan["between_people"].as_f64().unwrap();
    let of = |plan: &serde_json::Value| plan["between_source"].as_str().unwrap().to_owned();
    let given = plan(&["--between-people", "comparison.json"]);
    assert!((spread(&given) / tau - 1.0).abs() < 1e-12 && of(&given).contains("4 people in comparison.json"));
    let of_people = plan(&["--people", "group.json", "--condition", "rate"]);
    assert!(
        (spread(&of_people) / tau - 1.0).abs() < 1e-12 && of(&of_people).contains("group.json"),
        "{of_people}"
    );
    let default = plan(&[]);
    assert!(
        of(&default) == "a default" && (spread(&default) - 0.02).abs() < 1e-12,
        "{default}"
    );
    let part = plan(&[
        "--people",
        "group.json",
        "--condition",
        "rate",
        "--between-people",
        ".3",
    ]);
    assert!(
        (spread(&part) - 0.06).abs() < 1e-12 && of(&part) == "as given",
        "{part}"
    );
    let population = serde_json::json!({"kind": "population", "condition": "rate", "form": "gain", "parameters": [
        {"name": "tau_e", "value": 0.2, "spread": 0.25, "people": []},
    ]});
    fs::write(at.join("population.json"), population.to_string()).unwrap();
    let bound = plan(&["--between-people", "population.json"]);
    assert!(
        (spread(&bound) - 0.05).abs() < 1e-12 && of(&bound).starts_with("at most"),
        "{bound}"
    );
    // The JSON of a group has no single runs.
    let (code, message) = failure_of(
        at,
        &["design", "--controlled-element", "4/s", "--run-to-run", "group.json"],
    );
    assert!(
        code == 2 && message.contains("crossover from three runs"),
        "{code} {message}"
    );
    let given = json(
        at,
        &["design", "--controlled-element", "4/s", "--run-to-run", ".2", "--json"],
    );
    assert_eq!(
        (&given["run_to_run"], &given["run_to_run_source"]),
        (&0.2.into(), &"as given".into())
    );
    // The crossover is not a parameter of a population.
    let all = ["design", "--controlled-element", "4/s", "--difference", "crossover=10%"];
    let (code, message) = failure_of(at, &[&all[..], &["--between-people", "population.json"]].concat());
    assert!(
        code == 2 && message.contains("no spread of crossover between people"),
        "{code} {message}"
    );
}

#[test]
fn mistakes_are_explained_with_a_remedy() {
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
        (
            &["--display", "pursuit", "--against", "reference"],
            2,
            "no lines for a disturbance",
        ),
        (&["--lines", "60", "--spacing", "9"], 2, "--spacing"),
        (
            &["--difference", "crossover=.5", "--between-people", "person.toml"],
            2,
            "hoid compare --of crossover",
        ),
        (&["--difference", "crossover=0"], 2, "other than zero"),
        (&["--difference", "speed=1"], 2, "expected one of"),
        (&["--power", ".9"], 2, "--difference"),
        (&["--lines", "0"], 2, "number of lines is 0, expected a number above 0"),
        (&["--max-rms-e", "0"], 2, "largest rms of the error is 0"),
        (&["--max-u", "-1"], 2, "largest rms of the control is -1"),
        (&["--length", "0"], 2, "length of a run in s is 0"),
        (
            &["--controlled-element", "-4/s"],
            1,
            "the closed loop of operator and controlled element is not stable",
        ),
    ] {
        let all = [&["design", "--people", "person.toml"], arguments].concat();
        let (found, message) = failure_of(at, &all);
        assert!(
            found == code && message.contains(word),
            "{arguments:?}: {found}, {message}"
        );
    }
}
