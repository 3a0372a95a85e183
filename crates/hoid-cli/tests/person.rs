//! `hoid identify` by default: the operator of a person.
#![allow(clippy::unwrap_used)]

mod common;

use common::{failure_of, hoid, json, stdout_of};
use serde_json::Value;
use tempfile::TempDir;

/// Simulates five runs with the element 1/s of one virtual person, who has a lag and a lead.
fn runs() -> TempDir {
    let directory = TempDir::new().unwrap();
    stdout_of(
        directory.path(),
        &[
            "simulate-group",
            "--people",
            "--out",
            "people",
            "--subjects",
            "1",
            "--runs",
            "5",
            "--plants",
            "integrator",
            "--form",
            "lead-lag",
            "--seed",
            "7",
        ],
    );
    directory
}

fn file_names(directory: &TempDir) -> Vec<String> {
    let mut all: Vec<String> = std::fs::read_dir(directory.path().join("people"))
        .unwrap()
        .map(|f| f.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.starts_with('S') && name.ends_with(".csv"))
        .map(|name| format!("people/{name}"))
        .collect();
    all.sort();
    all
}

fn of<'v>(found: &'v Value, name: &str) -> &'v Value {
    let all = found["parameters"].as_array().unwrap();
    all.iter().find(|p| p["name"] == name).unwrap()
}

#[test]
fn operator_is_identified_with_defaults() {
    let directory = runs();
    let at = directory.path();
    let files = file_names(&directory);
    let mut arguments = vec!["identify"];
    arguments.extend(files.iter().map(String::as_str));
    arguments.extend(["--excitation", "d", "--controlled-element", "1/s"]);
    let found = json(at, &[&arguments[..], &["--json"]].concat());
    assert_eq!(
        (&found["structure"], &found["form"]),
        (&Value::from("operator"), &Value::from("lead-lag"))
    );
    let truth = std::fs::read_to_string(at.join("people/truth.csv")).unwrap();
    let mut rows = truth.lines();
    let head: Vec<&str> = rows.next().unwrap().split(',').collect();
    let row: Vec<&str> = rows.next().unwrap().split(',').collect();
    let true_value = |name: &str| -> f64 { row[head.iter().position(|h| *h == name).unwrap()].parse().unwrap() };
    for name in ["T_L", "tau_e"] {
        let p = of(&found, name);
        let (low, high) = (p["interval"][0].as_f64().unwrap(), p["interval"][1].as_f64().unwrap());
        // The person has a fixed seed; the values of a run differ from those of the first run by a few percent.
        let margin = 0.15 * true_value(name);
        assert!(
            low - margin < true_value(name) && true_value(name) < high + margin,
            "{name}: {p}"
        );
        if name == "tau_e" {
            assert_eq!(p["determined"], true, "{name}");
        }
    }
    // One of the forms that the data do not reject has no lead.
    let in_form = json(at, &[&arguments[..], &["--form", "lead-lag", "--json"]].concat());
    assert_eq!(of(&in_form, "T_L")["determined"], true);
    let measured = found["open_loop"]["crossover_rad_s"]["value"].as_f64().unwrap();
    let at_lines = found["lines"]["open_loop"]["crossover_rad_s"]["value"]
        .as_f64()
        .unwrap();
    assert!((measured / at_lines - 1.0).abs() < 0.1, "{measured} {at_lines}");
    for key in [
        "verdict",
        "forms",
        "agreement",
        "riv_bj",
        "covariance",
        "prior",
        "box_jenkins",
        "errors",
        "settings",
    ] {
        assert!(!found[key].is_null(), "{key}");
    }
    assert!(found["forms"].as_array().unwrap().len() == 8);
    // The element is 1/s; with ten times its gain, or with 1/s^2, the loop would be unstable.
    for wrong in ["10/s", "1/s^2", "0.001/s"] {
        let last = arguments.len() - 1;
        arguments[last] = wrong;
        let found = json(at, &[&arguments[..], &["--json"]].concat());
        let reasons = found["verdict"].to_string();
        let reported = reasons.contains("unstable-loop") || reasons.contains("no-crossover");
        assert!(
            reported && found["verdict"]["level"] != "trustworthy",
            "{wrong}: {reasons}"
        );
    }
    // The result is used as a prior for another fit.
    std::fs::write(at.join("person.json"), in_form.to_string()).unwrap();
    let one = json(
        at,
        &[
            "identify",
            &files[0],
            "--prior",
            "person.json",
            "--form",
            "lead-lag",
            "--excitation",
            "none",
            "--json",
        ],
    );
    let sources = one["prior"].as_array().unwrap();
    assert!(sources.iter().all(|p| p["source"] == "person.json") && !sources.is_empty());
    assert!(of(&one, "T_L")["prior_share"].as_f64().unwrap() > 0.0);

    let page = stdout_of(
        at,
        &[&arguments[..], &["--figure", "person.svg", "--report", "out", "-v"]].concat(),
    );
    assert!(page.starts_with("Verdict: "), "{page}");
    for part in [
        "K_over_T_I",
        "at the lines",
        "chosen",
        "Prior: omega_nm = 10.5",
        "crossover",
    ] {
        assert!(page.contains(part), "{part}: {page}");
    }
    assert!(
        std::fs::read_to_string(at.join("person.svg"))
            .unwrap()
            .contains("prediction error")
    );
    assert!(at.join("out").join("index.html").exists() || at.join("out").read_dir().unwrap().count() > 0);
}

#[test]
fn unrelated_signals_are_not_determined() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    let mut state = 11_u64;
    let mut uniform = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    // u is independent of e.
    let (mut e, mut u, mut text) = (0.0, 0.0, String::from("t,e,u\n"));
    for k in 0..2400 {
        e = 0.98 * e + uniform();
        u = 0.95 * u + uniform();
        text.push_str(&format!("{},{e},{u}\n", f64::from(k) / 60.0));
    }
    std::fs::write(at.join("noise.csv"), text).unwrap();
    let output = hoid(at, &["identify", "noise.csv", "--json"]);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["verdict"]["level"], "not determined", "{}", found["verdict"]);
    assert_eq!(output.status.code(), Some(1));
    // A person without a response, and a person without data.
    std::fs::write(at.join("still.csv"), "t,e,u\n0,1,2\n0.1,1,2\n0.2,1,2\n").unwrap();
    let (code, message) = failure_of(at, &["identify", "still.csv"]);
    assert_eq!(code, 1, "{message}");
    let (code, message) = failure_of(
        at,
        &["identify", "noise.csv", "--form", "lead", "--neuromuscular", "no"],
    );
    assert_eq!(code, 1, "{message}");
    let (code, _) = failure_of(at, &["identify", "noise.csv", "--individual", "K_q"]);
    assert_eq!(code, 2);
    // Without lines, the figure shows the response; for a changing operator there is no figure.
    let output = hoid(at, &["identify", "noise.csv", "--figure", "a.svg"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(std::fs::read_to_string(at.join("a.svg")).unwrap().starts_with("<svg"));
    let changing = [
        "identify",
        "noise.csv",
        "--structure",
        "time-varying",
        "--figure",
        "b.svg",
    ];
    let (code, message) = failure_of(at, &changing);
    assert_eq!(code, 2, "{message}");
}
