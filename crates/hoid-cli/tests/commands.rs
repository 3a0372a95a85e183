//! The commands as a user runs them.
#![allow(clippy::unwrap_used)]

mod common;

use std::{fs, path::Path};

use serde_json::Value;
use tempfile::TempDir;

use common::{bad, good, json};

fn simulated() -> TempDir {
    let directory = TempDir::new().unwrap();
    good(
        directory.path(),
        &["simulate", "--condition", "C1", "--seed", "1", "--out", "c1.csv"],
    );
    directory
}

/// A file of `rows` samples at 100 Hz, each line made by `row` from its number.
fn write(directory: &Path, name: &str, header: &str, rows: usize, row: impl Fn(usize) -> String) {
    let lines: Vec<String> = std::iter::once(header.to_owned()).chain((0..rows).map(row)).collect();
    fs::write(directory.join(name), lines.join("\n") + "\n").unwrap();
}

fn wave(k: usize) -> (f64, f64, f64) {
    let t = k as f64 / 100.0;
    (
        t,
        (1.7 * t).sin() + 0.5 * (9.1 * t).sin(),
        (1.7 * t - 0.8).sin() + 0.3 * (23.0 * t).cos(),
    )
}

fn row(k: usize) -> String {
    let (t, e, u) = wave(k);
    format!("{t},{e},{u}")
}

#[test]
fn identify_prints_the_json_of_the_contract() {
    let directory = simulated();
    let found = json(
        directory.path(),
        &["identify", "c1.csv", "--nk", "29", "--orders", "nd=1", "--json"],
    );
    assert_eq!(found["structure"], "bj");
    assert_eq!(
        found["orders"],
        serde_json::json!({"na": 0, "nb": 2, "nc": 0, "nd": 1, "nf": 2, "nk": 29})
    );
    assert_eq!(found["records"][0]["samples"], 8192);
    let names: Vec<&str> = found["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| p["name"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["b0", "b1", "d1", "f1", "f2"]);
    assert_eq!(found["termination"]["converged"], true);
    assert_eq!(found["operator"]["convertible"], true);
    for (name, truth) in [
        ("K_e", 0.09),
        ("T_L", 0.4),
        ("K_e_dot", 0.036),
        ("omega_nm", 11.25),
        ("zeta_nm", 0.35),
    ] {
        let (value, error) = (
            &found["operator"][name]["value"],
            &found["operator"][name]["standard_error"],
        );
        let distance = (value.as_f64().unwrap() - truth) / error.as_f64().unwrap();
        assert!(distance.abs() < 4.0, "{name} lies {distance} standard errors off");
    }
    let close = |value: &Value, truth: f64| {
        (value["value"].as_f64().unwrap() - truth).abs() < 4.0 * value["standard_error"].as_f64().unwrap()
    };
    assert!((found["operator"]["tau_e"]["value"].as_f64().unwrap() - 0.28).abs() < 1e-12);
    assert!(close(&found["remnant"]["T_n"], 0.06));
    assert!(close(&found["remnant"]["K_n"], 0.076_36));
    for key in [
        "vaf_simulation",
        "vaf_prediction",
        "nrmse_simulation",
        "nrmse_prediction",
        "aic",
        "bic",
        "fpe",
    ] {
        assert!(found["fit"][key].is_number(), "{key}");
    }
    assert_eq!(found["candidates"], serde_json::json!([]));
}

#[test]
fn a_range_is_searched_and_its_table_is_part_of_the_result() {
    let directory = simulated();
    let found = json(
        directory.path(),
        &["identify", "c1.csv", "--nk", "27..31", "--orders", "nd=1..2", "--json"],
    );
    assert_eq!(found["candidates"].as_array().unwrap().len(), 10);
    assert_eq!(found["orders"]["nk"], 29);
    assert_eq!(found["orders"]["nd"], 1);
    let text = good(
        directory.path(),
        &["identify", "c1.csv", "--structure", "arx", "--nk", "27..31", "-v"],
    );
    assert!(text.contains("Searched 5 candidates"), "{text}");
}

#[test]
fn options_of_the_search_reach_the_fit() {
    let directory = simulated();
    let d = directory.path();
    let run = |more: &[&str]| {
        let mut all = vec!["identify", "c1.csv", "--nk", "29", "--orders", "nd=1", "--json"];
        all.extend(more);
        json(d, &all)
    };
    let plain = run(&[]);
    let value = |found: &Value, name: &str| {
        let all = found["parameters"].as_array().unwrap();
        let p = all.iter().find(|p| p["name"] == name).unwrap().clone();
        (p["value"].as_f64().unwrap(), p["standard_error"].as_f64())
    };
    let fixed = run(&["--fix", "d1=-0.8", "--bound", "f2=..0.92"]);
    assert_eq!(value(&fixed, "d1"), (-0.8, None));
    assert_eq!(value(&fixed, "f2"), (0.92, None));
    for same in [
        &["--search-method", "gn"][..],
        &["--search-method", "lm", "--tolerance", "1e-13"],
        &["--bound", "f2=0.."],
        &["--stable"],
        &["--initial-state", "estimate"],
    ] {
        let found = run(same);
        let ratio = found["loss"].as_f64().unwrap() / plain["loss"].as_f64().unwrap();
        assert!((ratio - 1.0).abs() < 1e-9, "{same:?}: {ratio}");
    }
    for other in [
        &["--initial-state", "zero"][..],
        &["--initial-state", "backcast"],
        &["--robust"],
        &["--robust", "2"],
        &["--coefficient-prior", "f2=0.9:1"],
        &["--focus", "simulation"],
    ] {
        let found = run(other);
        assert!(found["termination"]["converged"].as_bool().unwrap(), "{other:?}");
        assert_ne!(value(&found, "f1").0, value(&plain, "f1").0, "{other:?}");
        assert!((value(&found, "f1").0 + 1.912).abs() < 0.05, "{other:?}");
    }
    let (code, message) = bad(
        d,
        &["identify", "c1.csv", "--nk", "29", "--orders", "nd=1", "--fix", "x1=0"],
    );
    assert!(code == 1 && message.contains("b0, b1, d1, f1, f2"), "{message}");
    let steps = run(&["--horizon", "1"]);
    let ahead = steps["prediction_ahead"]["vaf"].as_f64().unwrap();
    assert!((ahead - steps["fit"]["vaf_prediction"].as_f64().unwrap()).abs() < 1e-9);
}

#[test]
fn every_structure_and_method_runs_from_the_command_line() {
    let directory = simulated();
    let d = directory.path();
    for name in ["arx", "armax", "oe", "bj", "fir", "ararx", "ararmax", "general"] {
        let orders = if name == "bj" { "nd=1" } else { "nb=2" };
        let found = json(
            d,
            &[
                "identify",
                "c1.csv",
                "--structure",
                name,
                "--nk",
                "29",
                "--orders",
                orders,
                "--json",
            ],
        );
        assert_eq!(found["structure"], name);
        assert!(found["fit"]["vaf_prediction"].as_f64().unwrap() > 50.0, "{name}");
    }
    // An output alone needs no column e.
    let text = fs::read_to_string(d.join("c1.csv")).unwrap();
    fs::write(d.join("alone.csv"), text.replace(",e,", ",was_e,")).unwrap();
    for name in ["ar", "ma", "arma"] {
        let found = json(d, &["identify", "alone.csv", "--structure", name, "--json"]);
        assert_eq!(found["structure"], name);
        assert!(found["operator"].is_null());
    }
    let (code, message) = bad(d, &["identify", "alone.csv", "--structure", "arx"]);
    assert!(code == 1 && message.contains('e'), "{message}");
    for (method, structure) in [("iv4", "arx"), ("sriv", "oe"), ("rivbj", "bj")] {
        let orders = if method == "rivbj" { "nd=1" } else { "nb=2" };
        let found = json(
            d,
            &[
                "identify", "c1.csv", "--method", method, "--nk", "29", "--orders", orders, "--json",
            ],
        );
        assert_eq!(found["structure"], structure);
        assert!(found["start"].as_str().unwrap().contains("f_t"));
        let k_e = found["operator"]["K_e"]["value"].as_f64().unwrap();
        assert!((k_e - 0.09).abs() < 0.02, "{method}: {k_e}");
    }
}

#[test]
fn a_grey_box_gives_the_delay_an_error_bar_and_reports() {
    let directory = simulated();
    let d = directory.path();
    let found = json(
        d,
        &[
            "identify",
            "c1.csv",
            "--structure",
            "grey-box",
            "--remnant-order",
            "1..2",
            "--delay",
            "0.2..0.4",
            "--report",
            "out",
            "--json",
        ],
    );
    assert_eq!(found["structure"], "grey-box");
    assert_eq!(found["candidates"].as_array().unwrap().len(), 2);
    let delay = &found["operator"]["tau_e"];
    let off = delay["value"].as_f64().unwrap() - 0.28;
    // Four standard errors.
    assert!(off.abs() < 4.0 * delay["standard_error"].as_f64().unwrap(), "{delay}");
    assert!(found["remnant"]["T_n"]["standard_error"].is_number());
    let page = fs::read_to_string(d.join("out/report.html")).unwrap();
    assert!(page.contains("Grey box with a remnant of order m = 1"));
}

#[test]
fn a_change_is_found_and_its_gains_are_written() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    good(d, &["simulate", "--condition", "C4", "--seed", "3", "--out", "c4.csv"]);
    let arguments = [
        "identify",
        "c4.csv",
        "--structure",
        "time-varying",
        "--trace",
        "trace.csv",
        "--json",
    ];
    let found = json(d, &arguments);
    assert_eq!(found["change"]["found"], true);
    let all = found["parameters"].as_array().unwrap();
    let midpoint = all.iter().find(|p| p["name"] == "t_M").unwrap();
    assert!((midpoint["value"].as_f64().unwrap() - 40.96).abs() < 3.0, "{midpoint}");
    let trace = fs::read_to_string(d.join("trace.csv")).unwrap();
    assert!(trace.contains("t,K_e,K_e_se,T_L,T_L_se,K_e_dot,K_e_dot_se"));
    // 8192 rows behind two comments and the header.
    assert_eq!(trace.lines().count(), 8195);
}

/// The example of the book: a lead-lag whose gain and lead change.
#[test]
fn a_change_of_another_form_is_found() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let page = include_str!("../../../docs/src/methods/time-varying.md");
    let scenario = page
        .split("<<'END'\n")
        .nth(1)
        .and_then(|rest| rest.split("END\n").next());
    fs::write(d.join("learns.toml"), scenario.unwrap()).unwrap();
    good(
        d,
        &[
            "simulate",
            "--scenario",
            "learns.toml",
            "--seed",
            "3",
            "--out",
            "learns.csv",
        ],
    );
    let arguments = [
        "identify",
        "learns.csv",
        "--structure",
        "time-varying",
        "--form",
        "lead-lag",
        "--prior",
        "population",
        "--trace",
        "trace.csv",
    ];
    let found = json(d, &[&arguments[..], &["--json"]].concat());
    assert_eq!(
        (&found["form"], &found["change"]["found"]),
        (&"lead-lag".into(), &true.into())
    );
    assert_eq!(
        found["settings"]["prior"],
        "omega_nm=10.5:0.3,zeta_nm=0.3:0.5,tau_e=0.2:0.7"
    );
    for (end, name, truth) in [
        ("initial", "K_over_T_I", 4.0),
        ("last", "K_over_T_I", 2.0),
        ("initial", "T_L", 0.3),
        ("last", "T_L", 1.0),
        ("last", "T_I", 5.0),
        ("last", "K", 10.0),
    ] {
        let estimate = &found[end][name];
        let (value, error) = (
            estimate["value"].as_f64().unwrap(),
            estimate["standard_error"].as_f64().unwrap(),
        );
        assert!(
            (value - truth).abs() < 4.0 * error && error < 0.5 * truth,
            "{end} {name}: {estimate}"
        );
    }
    let trace = fs::read_to_string(d.join("trace.csv")).unwrap();
    assert!(trace.contains("t,K,K_se,K_over_T_I,K_over_T_I_se,T_L,T_L_se"));
    let said = good(d, &arguments);
    for part in ["of the form lead-lag", "before the change", "after it", "T_I"] {
        assert!(said.contains(part), "{said} lacks {part}");
    }
}

#[test]
fn several_records_start_validation_report_and_margins() {
    let directory = simulated();
    let d = directory.path();
    good(
        d,
        &["simulate", "--condition", "C1", "--seed", "2", "--out", "again.csv"],
    );
    let arguments = [
        "identify",
        "c1.csv",
        "again.csv",
        "--nk",
        "29",
        "--orders",
        "nd=1",
        "--validate",
        "again.csv",
        "--report",
        "out",
        "--controlled-element",
        "90/1,6,0",
        "--start",
        "b0=.04,b1=-.04,d1=-.5,f1=-1.8,f2=.85",
        "--json",
    ];
    let found = json(d, &arguments);
    assert_eq!(found["records"].as_array().unwrap().len(), 2);
    assert_eq!(found["start"], "given");
    let crossover = &found["open_loop"]["crossover_rad_s"];
    let (value, error) = (&crossover["value"], &crossover["standard_error"]);
    let off = value.as_f64().unwrap() - 1.5635;
    // Two records; five standard errors.
    assert!(
        off.abs() < 0.1 && off.abs() < 5.0 * error.as_f64().unwrap(),
        "{crossover}"
    );
    assert_eq!(found["residual_tests"].as_array().unwrap().len(), 2);
    assert!(
        found["roots"]
            .as_array()
            .unwrap()
            .iter()
            .any(|r| r["polynomial"] == "f")
    );
    assert!(found["validation"]["vaf_simulation"].as_f64().unwrap() > 85.0);
    let page = fs::read_to_string(d.join("out/report.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("again.csv"), "{}", page.len());
}

#[test]
fn simulate_is_repeatable_and_takes_its_options() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let file = |name: &str, more: &[&str]| {
        let mut arguments = vec!["simulate", "--condition", "C4", "--out", name];
        arguments.extend(more);
        good(d, &arguments);
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
    good(d, &["simulate", "--scenario", "s.toml", "--out", "h.csv"]);
}

#[test]
fn convert_goes_both_ways_and_says_what_does_not_convert() {
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
fn convert_gives_the_operator_behind_three_poles_and_says_which_is_the_lag() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    // 25 (.6 s + 1)/(5 s + 1) with omega_nm = 12 rad/s, zeta_nm = .25, tau_e = .137 s.
    let family = hoid_model::FamilyOperator::of_names(
        hoid_model::Form::LeadLag,
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
    let held = family.hold(hoid_model::SampleTime::HUNDREDTH).unwrap();
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
    let page = good(d, &arguments);
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
fn info_shows_what_is_inside() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    write(at, "run.csv", "t,e,u,k", 200, |k| {
        let (t, e, u) = wave(k);
        let t = if k < 150 { t } else { t + 0.05 };
        format!("{t},{:.1},{},7", e, u.min(0.6))
    });
    let found = json(at, &["info", "run.csv", "--json"]);
    assert_eq!(found["format"], "CSV");
    let sampling = &found["samplings"][0];
    assert_eq!(
        (&sampling["gaps"], &sampling["missing"]),
        (&Value::from(1), &Value::from(5))
    );
    assert!((sampling["sample_time"].as_f64().unwrap() - 0.01).abs() < 1e-9);
    let column = |name: &str| {
        found["columns"]
            .as_array()
            .unwrap()
            .iter()
            .find(|c| c["path"] == name)
            .unwrap()["values"]
            .clone()
    };
    assert!((column("e")["quantum"].as_f64().unwrap() - 0.1).abs() < 1e-9);
    assert!(column("u")["saturated_high"].as_u64().unwrap() > 10 && column("u")["quantum"].is_null());
    assert_eq!(column("k")["constant"], true);
    let text = good(at, &["info", "run.csv"]);
    for words in [
        "CSV, 4 columns",
        "1 gaps (5 samples",
        "constant",
        "quantised in steps of 0.1",
        "saturated at 0.6",
        "█",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    fs::write(at.join("bad.mat"), "t,e,u").unwrap();
    assert!(bad(at, &["info", "bad.mat"]).1.contains("is no MATLAB file"));
}

#[test]
fn margins_of_both_states() {
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
    let text = good(directory.path(), &["demo", "--out", "here"]);
    assert!(
        text.contains("before the change") && text.contains("after the change"),
        "{text}"
    );
    for file in ["here/c4.csv", "here/report.html"] {
        assert!(directory.path().join(file).is_file(), "{file}");
    }
}

#[test]
fn bad_input_is_told_in_the_users_words() {
    let directory = simulated();
    let d = directory.path();
    let n = 400;
    fs::write(d.join("empty.csv"), "").unwrap();
    write(d, "nocolumn.csv", "t,e,y", n, row);
    write(d, "text.csv", "t,e,u", n, |k| {
        if k == 7 { "0.07,abc,1".to_owned() } else { row(k) }
    });
    write(d, "nan.csv", "t,e,u", n, |k| {
        if k == 8 { "0.08,NaN,1".to_owned() } else { row(k) }
    });
    write(d, "inf.csv", "t,e,u", n, |k| {
        if k == 9 { "0.09,1,inf".to_owned() } else { row(k) }
    });
    write(d, "gap.csv", "t,e,u", n, |k| row(if k > 50 { k + 20 } else { k }));
    write(d, "jitter.csv", "t,e,u", n, |k| {
        let (t, e, u) = wave(k);
        format!("{},{e},{u}", t + 0.003 * (k as f64 * 2.3).sin())
    });
    write(d, "short.csv", "t,e,u", 33, row);
    write(d, "zero.csv", "t,e,u", n, |k| format!("{},{},0", wave(k).0, wave(k).1));
    write(d, "constant.csv", "t,e,u", n, |k| {
        format!("{},2.5,{}", wave(k).0, wave(k).2)
    });
    write(d, "slow.csv", "t,e,u", n, |k| {
        format!("{},{},{}", 2.0 * wave(k).0, wave(k).1, wave(k).2)
    });
    write(d, "one.csv", "t,e,u", n, row);
    let cases: [(&[&str], &[&str]); 17] = [
        (&["empty.csv"], &["empty.csv", "empty"]),
        (&["absent.csv"], &["absent.csv", "cannot be read"]),
        (&["nocolumn.csv"], &["u", "t, e, y"]),
        (&["text.csv"], &["line 9", "abc"]),
        (&["nan.csv"], &["line 10", "--fill"]),
        (&["inf.csv"], &["line 11", "inf"]),
        (&["gap.csv"], &["line 52", "--resample"]),
        (&["jitter.csv"], &["--resample"]),
        (&["short.csv"], &["33 samples"]),
        (&["one.csv", "--nk", "500"], &["nk = 500", "400 samples"]),
        (&["zero.csv"], &["u", "0 in every sample"]),
        (&["constant.csv"], &["e", "2.5 in every sample"]),
        (&["one.csv", "slow.csv"], &["0.02", "0.01", "resample"]),
        (&["one.csv", "--from", "90", "--to", "95"], &["90", "95"]),
        (&["one.csv", "--input", "q"], &["q", "t, e, u"]),
        (
            &["one.csv", "--start", "f1=2", "--nk", "5", "--orders", "nd=1"],
            &["--start lacks b0"],
        ),
        (
            &[
                "one.csv",
                "--start",
                "b0=1,b1=1,d1=0,f1=-2.1,f2=1.2",
                "--nk",
                "5",
                "--orders",
                "nd=1",
            ],
            &["unit circle"],
        ),
    ];
    for (arguments, expected) in cases {
        let mut all = vec!["identify", "--nk", "29", "--orders", "nd=1"];
        if arguments.contains(&"--nk") {
            all.truncate(1);
        }
        if arguments.contains(&"--orders") {
            all.truncate(1);
        }
        all.extend(arguments);
        let (code, message) = bad(d, &all);
        let usage = message.contains("--start lacks");
        assert_eq!(code, if usage { 2 } else { 1 }, "{arguments:?}: {message}");
        for part in expected {
            assert!(message.contains(part), "{arguments:?}: {part:?} is not in: {message}");
        }
    }
}

#[test]
fn wrong_usage_ends_with_two() {
    let directory = simulated();
    let d = directory.path();
    for arguments in [
        &["identify"][..],
        &["identify", "c1.csv", "--nk", "5..2"],
        &["identify", "c1.csv", "--orders", "nx=2"],
        &["identify", "c1.csv", "--orders", "nk=3", "--nk", "4"],
        &["identify", "c1.csv", "--structure", "narmax"],
        &["identify", "c1.csv", "--start", "b0=1"],
        &["identify", "c1.csv", "--method", "iv4", "--structure", "bj"],
        &["identify", "c1.csv", "--instruments", "f_t"],
        &["identify", "c1.csv", "--orders", "nc=1,nd=99"],
        &["identify", "c1.csv", "--structure", "grey-box", "--nk", "29"],
        &["identify", "c1.csv", "--structure", "grey-box", "--orders", "nb=2"],
        &["identify", "c1.csv", "--structure", "bj", "--remnant-order", "1"],
        &["identify", "c1.csv", "--structure", "bj", "--delay", "0.1..0.3"],
        &["identify", "c1.csv", "--structure", "bj", "--form", "lead-lag"],
        &["identify", "c1.csv", "--remnant-order", "1", "--form", "lead-lag"],
        &["identify", "c1.csv", "--prior", "omega_nm=1"],
        &["identify", "c1.csv", "--trace", "x.csv"],
        &["identify", "c1.csv", "--structure", "time-varying", "--report", "out"],
        &["identify", "c1.csv", "--structure", "time-varying", "--orders", "nb=2"],
        &["identify", "c1.csv", "--nk", "29", "--fix", "d1"],
        &["identify", "c1.csv", "--nk", "29", "--bound", "d1=2..1"],
        &[
            "identify", "c1.csv", "--nk", "29", "--fix", "d1=0", "--bound", "d1=0..1",
        ],
        &["simulate", "--out", "x.csv"],
        &["simulate", "--condition", "C9", "--out", "x.csv"],
        &["convert", "--f", "1,2"],
        &["convert", "--operator", "K_e=1"],
        &["convert", "--operator", "K_e=x"],
        &["convert", "--transfer-function", "1/1,2", "--method", "prewarped"],
        &["margins"],
        &["nonsense"],
    ] {
        let (code, message) = bad(d, arguments);
        assert_eq!(code, 2, "{arguments:?}: {message}");
    }
}

#[test]
fn what_cannot_be_simulated_ends_with_one_and_writes_nothing() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    for (arguments, expected) in [
        (&["--noise-level", "1.5"][..], "P_n"),
        (&["--remnant-order", "7"], "order"),
        (
            &["--noise-level", "5", "--noise-definition", "remnant"],
            "largest reachable",
        ),
        (&["--sample-time", "0.013"], "whole number of samples"),
        (&["--sample-time", "-1"], "Ts"),
        (&["--remnant-time-constant", "0"], "T_n"),
    ] {
        let mut all = vec!["simulate", "--condition", "C1", "--out", "x.csv"];
        all.extend(arguments);
        let (code, message) = bad(d, &all);
        assert_eq!(code, 1, "{arguments:?}: {message}");
        assert!(message.contains(expected), "{arguments:?}: {message}");
    }
    let (code, _) = bad(d, &["simulate", "--condition", "C1", "--out", "no/such/place.csv"]);
    assert_eq!(code, 1);
}

/// A scenario of the family is simulated, and its margins are those of its loop.
#[test]
fn a_person_of_the_family_is_simulated() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let person = include_str!("../../../fixtures/scenario/person.toml");
    fs::write(d.join("person.toml"), person).unwrap();
    let said = good(
        d,
        &["simulate", "--scenario", "person.toml", "--seed", "3", "--out", "p.csv"],
    );
    assert!(said.contains("a person: 3600 samples"), "{said}");
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
    // |Y P| = 1 at the crossover, by hand: K/T_I |0.6 jw + 1|/|jw + 0.2| |NM|/w.
    let omega = initial["crossover_rad_s"].as_f64().unwrap();
    let lead = (0.36 * omega * omega + 1.0).sqrt() / (omega * omega + 0.04).sqrt();
    let ratio = omega / 11.0;
    let muscles = ((1.0 - ratio * ratio).powi(2) + (0.5 * ratio).powi(2)).sqrt();
    assert!((4.0 * lead / muscles / omega - 1.0).abs() < 1e-6);
    assert_ne!(initial["phase_margin_deg"], last["phase_margin_deg"]);
    assert_eq!(initial["remnant_gain"].as_array().unwrap().len(), 3);
    assert_eq!(last["remnant_gain"][2]["gain"], 0.03);
    let table = good(d, &["margins", "--scenario", "person.toml"]);
    assert!(
        table.contains("Crossover frequency") && table.contains("given gain"),
        "{table}"
    );
    let (code, message) = bad(
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
    let (code, message) = bad(d, &["simulate", "--scenario", "wild.toml", "--out", "x.csv"]);
    assert!(code == 1 && message.contains("not stable"), "{message}");
}
