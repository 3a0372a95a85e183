//! Simulation, conversion and margins from the command line.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use common::{failure_of, json, stdout_of};

#[test]
fn simulate_is_repeatable_and_takes_its_options() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let file = |name: &str, more: &[&str]| {
        let mut arguments = vec!["simulate", "--condition", "C4", "--out", name];
        arguments.extend(more);
        stdout_of(d, &arguments);
        fs::read_to_string(d.join(name)).unwrap()
    };
    let base = file("a.csv", &["--seed", "5"]);
    assert_eq!(base, file("b.csv", &["--seed", "5"]));
    assert_ne!(base, file("c.csv", &["--seed", "5", "--replication", "1"]));
    assert_ne!(base, file("d.csv", &["--seed", "5", "--realisation", "output"]));
    assert_ne!(
        base,
        file(
            "e.csv",
            &["--seed", "5", "--remnant-order", "3", "--noise-definition", "remnant"]
        )
    );
    let header = base.lines().find(|l| !l.starts_with('#')).unwrap();
    assert_eq!(
        header,
        "t,f_t,e,u,x,n,K_e,T_L,K_e_dot,omega_nm,zeta_nm,tau_e,T_n,K_n,K_c,omega_b"
    );
    let rows = |text: &str| text.lines().filter(|l| !l.starts_with('#')).count() - 1;
    assert_eq!(rows(&base), 8192);
    assert_eq!(rows(&file("f.csv", &["--keep-run-in"])), 9192);
    assert_eq!(rows(&file("g.csv", &["--sample-time", "0.02"])), 4096);
    fs::write(d.join("s.toml"), "condition = \"C2\"\n[remnant]\nnoise_level = 0.2\n").unwrap();
    stdout_of(d, &["simulate", "--scenario", "s.toml", "--out", "h.csv"]);
}

#[test]
fn convert_works_both_ways_or_gives_a_reason() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let operator = "K_e=.09,T_L=.4,omega_nm=11.25,zeta_nm=.35,tau_e=.28";
    let there = json(d, &["convert", "--operator", operator, "--json"]);
    assert!((there["discrete"]["f"][0].as_f64().unwrap() + 1.912_113_054_8).abs() < 5e-11);
    assert!((there["discrete"]["b"][1].as_f64().unwrap() + 0.043_182_380_6).abs() < 5e-11);
    assert_eq!(there["discrete"]["nk"], 29);
    let number = |v: &Value| v.as_f64().unwrap().to_string();
    let (f, b) = (&there["discrete"]["f"], &there["discrete"]["b"]);
    let f = format!("{},{}", number(&f[0]), number(&f[1]));
    let b = format!("{},{}", number(&b[0]), number(&b[1]));
    let back = json(
        d,
        &[
            "convert",
            "--f",
            &f,
            "--b",
            &b,
            "--nk",
            "29",
            "--sample-time",
            "0.01",
            "--json",
        ],
    );
    assert!((back["operator"]["T_L"]["value"].as_f64().unwrap() - 0.4).abs() < 1e-9);
    let none = json(d, &["convert", "--f", "-0.9,-0.05", "--b", "1,0", "--json"]);
    assert_eq!(none["operator"]["convertible"], false);
    assert!(
        none["operator"]["reason"]
            .as_str()
            .unwrap()
            .contains("negative real axis")
    );
    let held = json(
        d,
        &[
            "convert",
            "--transfer-function",
            "1/1,0",
            "--method",
            "tustin",
            "--sample-time",
            "0.2",
            "--json",
        ],
    );
    assert_eq!(held["transfer_function"]["num"], serde_json::json!([0.1, 0.1]));
}

#[test]
fn convert_identifies_the_lag_among_three_poles() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    // The operator is 25 (.6 s + 1)/(5 s + 1) with omega_nm = 12 rad/s, zeta_nm = .25 and tau_e = .137 s.
    let family = hoid::model::FamilyOperator::from_names(
        hoid::model::Form::LeadLag,
        &[
            ("K", 25.0),
            ("T_L", 0.6),
            ("T_I", 5.0),
            ("omega_nm", 12.0),
            ("zeta_nm", 0.25),
            ("tau_e", 0.137),
        ]
        .map(|(name, value)| (name.to_owned(), value)),
    )
    .unwrap();
    let held = family.zoh(hoid::model::SampleTime::AT_100_HZ).unwrap();
    let list = |c: &[f64]| c.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let (f, b, nk) = (list(&held.f), list(&held.b), held.nk.to_string());
    let arguments = ["convert", "--f", &f, "--b", &b, "--nk", &nk, "--sample-time", "0.01"];
    let found = json(d, &[&arguments[..], &["--json"]].concat());
    let operator = &found["operator"];
    assert_eq!(operator["form"], "lead-lag");
    for (name, value) in [("K_over_T_I", 5.0), ("T_L", 0.6), ("T_I", 5.0), ("tau_e", 0.137)] {
        let off = operator[name]["value"].as_f64().unwrap() - value;
        assert!(off.abs() < 1e-4 * value, "{name} {off}");
    }
    assert_eq!(operator["real_poles"][0]["role"], "lag");
    let page = stdout_of(d, &arguments);
    assert!(page.contains("is the lag, T_I = 5.0"), "{page}");
    assert!(page.contains("Form lead-lag"), "{page}");
    let none = json(d, &["convert", "--f", "-0.5,0.1,0,0.01", "--b", "1", "--json"]);
    assert!(
        none["operator"]["reason"]
            .as_str()
            .unwrap()
            .contains("one to three poles")
    );
}

#[test]
fn margins_match_the_reference_states() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let s1 = json(d, &["margins", "--condition", "C1", "--json"]);
    assert!((s1["crossover_rad_s"].as_f64().unwrap() - 1.5635).abs() < 5e-5);
    assert!((s1["phase_margin_deg"].as_f64().unwrap() - 76.67).abs() < 5e-3);
    assert_eq!(s1["remnant_gain"].as_array().unwrap().len(), 16);
    let s2 = json(
        d,
        &[
            "margins",
            "--condition",
            "C4",
            "--state",
            "last",
            "--noise-levels",
            "0.1",
            "--json",
        ],
    );
    assert!((s2["crossover_rad_s"].as_f64().unwrap() - 2.748).abs() < 5e-5);
    assert!((s2["remnant_gain"][1]["K_n"].as_f64().unwrap() - 0.165).abs() < 5e-6);
    let unreachable = json(
        d,
        &[
            "margins",
            "--condition",
            "C1",
            "--noise-definition",
            "remnant",
            "--noise-levels",
            "5",
            "--json",
        ],
    );
    assert!(unreachable["remnant_gain"][0]["K_n"].is_null());
    assert!(
        unreachable["remnant_gain"][0]["reason"]
            .as_str()
            .unwrap()
            .contains("largest reachable")
    );
}

#[test]
fn demo_writes_its_record_and_report() {
    let directory = TempDir::new().unwrap();
    let text = stdout_of(directory.path(), &["demo", "--out", "here"]);
    assert!(
        text.contains("before the change") && text.contains("after the change"),
        "{text}"
    );
    for file in ["here/c4.csv", "here/report.html"] {
        assert!(directory.path().join(file).is_file(), "{file}");
    }
}

/// A scenario of the family is simulated, and the reported margins are those of its loop.
#[test]
fn family_scenario_is_simulated() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let person = include_str!("../../../fixtures/scenario/person.toml");
    fs::write(d.join("person.toml"), person).unwrap();
    let printed = stdout_of(
        d,
        &["simulate", "--scenario", "person.toml", "--seed", "3", "--out", "p.csv"],
    );
    assert!(printed.contains("a person: 3600 samples"), "{printed}");
    let run = fs::read_to_string(d.join("p.csv")).unwrap();
    let header = run.lines().find(|line| !line.starts_with('#')).unwrap();
    for name in ["e", "u", "f_t", "d", "y", "n", "K_over_T_I", "T_I", "zeta_nm", "tau_e"] {
        assert!(header.split(',').any(|column| column == name), "{header} lacks {name}");
    }
    let initial = json(d, &["margins", "--scenario", "person.toml", "--json"]);
    let last = json(
        d,
        &["margins", "--scenario", "person.toml", "--state", "last", "--json"],
    );
    // |Y P| = K/T_I |0.6 jw + 1|/|jw + 0.2| |NM|/w, computed by hand, is 1 at the crossover.
    let omega = initial["crossover_rad_s"].as_f64().unwrap();
    let lead = (0.36 * omega * omega + 1.0).sqrt() / (omega * omega + 0.04).sqrt();
    let ratio = omega / 11.0;
    let muscles = ((1.0 - ratio * ratio).powi(2) + (0.5 * ratio).powi(2)).sqrt();
    assert!((4.0 * lead / muscles / omega - 1.0).abs() < 1e-6);
    assert_ne!(initial["phase_margin_deg"], last["phase_margin_deg"]);
    assert_eq!(initial["remnant_gain"].as_array().unwrap().len(), 3);
    assert_eq!(last["remnant_gain"][2]["gain"], 0.03);
    let table = stdout_of(d, &["margins", "--scenario", "person.toml"]);
    assert!(
        table.contains("Crossover frequency") && table.contains("given gain"),
        "{table}"
    );
    let (code, message) = failure_of(
        d,
        &[
            "simulate",
            "--scenario",
            "person.toml",
            "--noise-level",
            "0.1",
            "--out",
            "x.csv",
        ],
    );
    assert!(code == 2 && message.contains("[[remnant]]"), "{message}");
    fs::write(d.join("wild.toml"), person.replace("K = 20 ", "K = 200 ")).unwrap();
    let (code, message) = failure_of(d, &["simulate", "--scenario", "wild.toml", "--out", "x.csv"]);
    assert!(code == 1 && message.contains("not stable"), "{message}");
}
