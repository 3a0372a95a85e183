//! `hoid identify` from the command line.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use common::{failure_of, hoid, json, setting, simulated_run, stdout_of, wave, write_samples};

#[test]
fn identify_prints_the_documented_json() {
    let directory = simulated_run();
    let found = json(
        directory.path(),
        &["identify", "c1.csv", "--nk", "29", "--orders", "nd=1", "--json"],
    );
    assert_eq!(found["structure"], "bj");
    assert!(
        found["verdict"]["of"]["response"]["level"].is_string(),
        "{}",
        found["verdict"]
    );
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

/// The first bytes of a figure file identify its format, and the figure has the requested width.
#[test]
#[cfg(feature = "pdf-png")]
fn figure_format_follows_the_file_name() {
    let directory = simulated_run();
    let d = directory.path();
    let draw = |name: &str| {
        let fit = ["identify", "c1.csv", "--nk", "29", "--orders", "nd=1"];
        stdout_of(d, &[&fit[..], &["--figure", name, "--width", "85mm"]].concat());
        fs::read(d.join(name)).unwrap()
    };
    let pdf = draw("bode.pdf");
    let text = String::from_utf8_lossy(&pdf);
    // A width of 85 mm is 240.9 pt.
    assert!(pdf.starts_with(b"%PDF-") && text.contains("/MediaBox [0 0 240.9") && text.contains("/Font"));
    let png = draw("bode.png");
    assert!(png.starts_with(b"\x89PNG\r\n\x1a\n"));
    // The resolution is 300 dots per inch; the first chunk contains the width.
    let width = u32::from_be_bytes(png[16..20].try_into().unwrap());
    assert!(width.abs_diff(1004) <= 4, "{width}");
}

#[test]
fn range_search_reports_its_candidates() {
    let directory = simulated_run();
    let found = json(
        directory.path(),
        &["identify", "c1.csv", "--nk", "27..31", "--orders", "nd=1..2", "--json"],
    );
    assert_eq!(found["candidates"].as_array().unwrap().len(), 10);
    assert_eq!(found["orders"]["nk"], 29);
    assert_eq!(found["orders"]["nd"], 1);
    let text = stdout_of(
        directory.path(),
        &["identify", "c1.csv", "--structure", "arx", "--nk", "27..31", "-v"],
    );
    assert!(text.contains("Searched 5 candidates"), "{text}");
}

#[test]
fn search_options_reach_the_fit() {
    let directory = simulated_run();
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
    let (code, message) = failure_of(
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
    let directory = simulated_run();
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
    // A model of an output alone requires no column e.
    let text = fs::read_to_string(d.join("c1.csv")).unwrap();
    fs::write(d.join("alone.csv"), text.replace(",e,", ",was_e,")).unwrap();
    for name in ["ar", "ma", "arma"] {
        let found = json(d, &["identify", "alone.csv", "--structure", name, "--json"]);
        assert_eq!(found["structure"], name);
        assert!(found["operator"].is_null());
    }
    let (code, message) = failure_of(d, &["identify", "alone.csv", "--structure", "arx"]);
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
fn grey_box_gives_the_delay_a_standard_error() {
    let directory = simulated_run();
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
    assert_eq!(
        (&found["kind"], &found["structure"]),
        (&"operator".into(), &"operator".into())
    );
    assert_eq!(found["candidates"].as_array().unwrap().len(), 2);
    let delay = &found["operator"]["tau_e"];
    let off = delay["value"].as_f64().unwrap() - 0.28;
    // The tolerance is four standard errors.
    assert!(off.abs() < 4.0 * delay["standard_error"].as_f64().unwrap(), "{delay}");
    assert!(found["remnant"]["T_n"]["standard_error"].is_number());
    let page = fs::read_to_string(d.join("out/report.html")).unwrap();
    assert!(page.contains("Grey box with a remnant of order m = 1"));
}

#[test]
fn change_is_found_and_its_gains_are_written() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    stdout_of(d, &["simulate", "--condition", "C4", "--seed", "3", "--out", "c4.csv"]);
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
    // There are 8192 rows after two comments and the header.
    assert_eq!(trace.lines().count(), 8195);
}

/// The example of the book, a lead-lag whose gain and lead change, is identified.
#[test]
fn documented_lead_lag_change_is_found() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let page = include_str!("../../../docs/src/methods/time-varying.md");
    let scenario = page
        .split("<<'END'\n")
        .nth(1)
        .and_then(|rest| rest.split("END\n").next());
    fs::write(d.join("learns.toml"), scenario.unwrap()).unwrap();
    stdout_of(
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
        setting(&found, "prior"),
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
    let printed = stdout_of(d, &arguments);
    for part in ["of the form lead-lag", "before the change", "after it", "T_I"] {
        assert!(printed.contains(part), "{printed} lacks {part}");
    }
}

#[test]
fn validation_file_is_reported_once() {
    let directory = tempfile::tempdir().unwrap();
    let d = directory.path();
    for name in ["run.csv", "again.csv"] {
        write_samples(d, name, "t,e,u", 2000, |k| {
            let (t, e, u) = wave(k);
            let u = if name == "again.csv" { u.clamp(-0.8, 0.8) } else { u };
            format!("{t},{e},{u}")
        });
    }
    for structure in [
        &["--form", "lead", "--orders", "nd=1"][..],
        &["--nk", "29", "--orders", "nd=1"],
    ] {
        let arguments = [&["identify", "run.csv", "--validate", "again.csv"], structure].concat();
        let output = hoid(d, &arguments);
        let warnings = String::from_utf8(output.stderr).unwrap();
        let count = warnings.matches("again.csv: u stays at its largest value").count();
        assert_eq!(count, 1, "{structure:?}: {warnings}");
    }
}

#[test]
fn several_records_with_all_outputs_are_identified() {
    let directory = simulated_run();
    let d = directory.path();
    stdout_of(
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
    // There are two records; the tolerance is five standard errors.
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

/// With this element, the gain of the loop is one at three frequencies. The margin at the lowest crossover is positive,
/// but the loop is unstable. There is little noise, so the loop is not stable within the errors either.
#[test]
fn unstable_loop_is_doubtful() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let simulate = [
        "simulate",
        "--condition",
        "C1",
        "--seed",
        "1",
        "--noise-level",
        "0.02",
        "--out",
        "c1.csv",
    ];
    stdout_of(d, &simulate);
    let arguments = [
        "identify",
        "c1.csv",
        "--form",
        "lead",
        "--orders",
        "nd=1",
        "--controlled-element",
        "20/s",
    ];
    let found = json(d, &[&arguments[..], &["--json"]].concat());
    let open_loop = &found["open_loop"];
    let crossovers = open_loop["crossovers"].as_array().unwrap();
    assert!(crossovers.len() == 3 && open_loop["stable"] == false, "{open_loop}");
    let value = |of: &serde_json::Value| of["crossover_rad_s"]["value"].as_f64().unwrap();
    assert!(
        (value(&crossovers[0]) / value(open_loop) - 1.0).abs() < 1e-12,
        "{open_loop}"
    );
    assert!(open_loop["gain_margin_db"]["value"].as_f64().unwrap() < 0.0);
    let findings = found["verdict"]["findings"].as_array().unwrap();
    assert!(
        findings
            .iter()
            .any(|f| f["kind"] == "unstable-loop" && f["severity"] == "doubt"),
        "{findings:?}"
    );
    let text = stdout_of(d, &arguments);
    assert!(
        text.contains("This loop: unit gain also at") && text.contains("is not stable"),
        "{text}"
    );
}

/// From a simulation without noise the exact operator is identified, and the result reports that there is no noise.
#[test]
fn noise_free_simulation_gives_the_exact_operator() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let elements = ["90/(s(s+6))", "30/(s(s+.2))"];
    for ((condition, gain), element) in [("C1", [0.09, 0.4]), ("C2", [0.07, 1.2])].into_iter().zip(elements) {
        let simulate = [
            "simulate",
            "--condition",
            condition,
            "--noise-level",
            "0",
            "--out",
            "run.csv",
        ];
        stdout_of(d, &simulate);
        let found = json(d, &["identify", "run.csv", "--controlled-element", element, "--json"]);
        let verdict = &found["verdict"];
        assert_eq!(
            (&found["form"], &verdict["level"]),
            (&"lead".into(), &"trustworthy".into())
        );
        let truth = [
            ("omega_nm", 11.25),
            ("zeta_nm", 0.35),
            ("tau_e", 0.28),
            ("K_e", gain[0]),
            ("T_L", gain[1]),
        ];
        for (name, expected) in truth {
            let value = found["operator"][name]["value"].as_f64().unwrap();
            assert!((value / expected - 1.0).abs() < 1e-9, "{condition} {name}: {value}");
        }
        let notes = verdict["notes"].as_array().unwrap();
        assert!(notes.iter().any(|note| note["kind"] == "no-noise"), "{verdict}");
        let weights: Vec<f64> = (found["forms"].as_array().unwrap().iter())
            .filter_map(|form| form["weight"].as_f64().filter(|w| *w > 0.0))
            .collect();
        assert_eq!(weights, [1.0]);
        assert_eq!(found["open_loop"]["stable"], true);
    }
}

/// With noise of any share of the power of u, from rounding errors to a thousandth, the form is the same, and there is
/// no warning.
#[test]
fn simulation_with_little_noise_is_identified() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    for level in ["1e-12", "1e-9", "1e-6", "1e-3"] {
        let simulate = [
            "simulate",
            "--condition",
            "C1",
            "--seed",
            "3",
            "--noise-level",
            level,
            "--out",
            "run.csv",
        ];
        stdout_of(d, &simulate);
        let found = json(d, &["identify", "run.csv", "--json"]);
        let verdict = &found["verdict"]["level"];
        assert_eq!(
            (&found["form"], verdict),
            (&"lead".into(), &"trustworthy".into()),
            "{level}"
        );
        // The relative tolerance is 0.3 times the square root of the noise level.
        let allowed = 0.3 * level.parse::<f64>().unwrap().sqrt();
        for (name, expected) in [("K_e", 0.09), ("K_e_dot", 0.036), ("tau_e", 0.28)] {
            let value = found["operator"][name]["value"].as_f64().unwrap();
            assert!((value / expected - 1.0).abs() < allowed, "{level} {name}: {value}");
        }
    }
}

/// If the error is logged at a tenth of its rate, one of the two reported delays is correct, as is the delay for the
/// given intersample behaviour.
#[test]
fn intersample_behaviour_shifts_the_delay_by_half_a_sample() {
    let directory = simulated_run();
    let d = directory.path();
    let arguments = ["identify", "c1.csv", "--form", "lead", "--orders", "nd=1", "--json"];
    let of = |course: &str| json(d, &[&arguments[..], &["--intersample", course]].concat());
    let (auto, held, straight) = (of("auto"), of("zoh"), of("foh"));
    let tau = |found: &Value| found["operator"]["tau_e"]["value"].as_f64().unwrap();
    assert_eq!(auto["intersample"]["used"], "auto");
    assert_eq!(
        auto["intersample"]["tau_e_if_straight"].as_f64().unwrap(),
        tau(&auto) + 0.005
    );
    assert_eq!(straight["intersample"]["tau_e_if_straight"], Value::Null);
    // There is only one model; the remaining difference is due to the centre of the prior.
    assert!((tau(&straight) - tau(&auto) - 0.005).abs() < 1e-4 && (tau(&held) - tau(&auto)).abs() < 1e-3);
    let text = stdout_of(
        d,
        &[
            "identify",
            "c1.csv",
            "--form",
            "lead",
            "--orders",
            "nd=1",
            "--intersample",
            "foh",
        ],
    );
    assert!(text.contains("an error that is linear between its samples"), "{text}");
    let (code, words) = failure_of(d, &[&arguments[..], &["--intersample", "cubic"]].concat());
    assert!(code == 2 && words.contains("zoh"), "{words}");
}

/// Without the excitation, other forms may be as likely as the form with K_e, so the interval of K_e is conditional on
/// this form.
#[test]
fn parameters_of_an_uncertain_form_are_conditional() {
    let directory = tempfile::tempdir().unwrap();
    let d = directory.path();
    stdout_of(d, &["simulate", "--condition", "C1", "--seed", "5", "--out", "c1.csv"]);
    let out = stdout_of(d, &["identify", "c1.csv", "--excitation", "none"]);
    for note in [
        "other forms are likely too: K_e; the intervals apply only if the form is lead or lead-droop (weight 0.45): use \
         --form lead to report them",
        "other forms are likely too: K_e_dot; the intervals apply only if the form is lead (weight 0.32): use --form \
         lead to report them",
    ] {
        assert!(out.contains(note), "{out}");
    }
    assert!(
        !out.contains("K_e is not determined, but") && !out.contains("not determined by the data"),
        "{out}"
    );
    let out = stdout_of(d, &["identify", "c1.csv", "--excitation", "none", "--form", "lead"]);
    assert!(
        out.contains("K_e (deg/deg)") && !out.contains("not determined"),
        "{out}"
    );
}
