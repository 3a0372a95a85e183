//! Messages about invalid files and arguments.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use common::{failure_of, json, row, simulated_run, stdout_of, wave, write_samples};

#[test]
fn info_describes_the_columns() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    write_samples(at, "run.csv", "t,e,u,k", 200, |k| {
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
    let text = stdout_of(at, &["info", "run.csv"]);
    for words in [
        "CSV, 4 columns",
        "1 gap (5 samples",
        "constant",
        "quantised in steps of 0.1",
        "saturated at 0.6",
        "█",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    fs::write(at.join("bad.mat"), "t,e,u").unwrap();
    assert!(
        failure_of(at, &["info", "bad.mat"])
            .1
            .contains("is not in MATLAB format")
    );
}

#[test]
fn bad_input_is_reported_in_plain_words() {
    let directory = simulated_run();
    let d = directory.path();
    let n = 400;
    fs::write(d.join("empty.csv"), "").unwrap();
    write_samples(d, "nocolumn.csv", "t,e,y", n, row);
    write_samples(d, "text.csv", "t,e,u", n, |k| {
        if k == 7 { "0.07,abc,1".to_owned() } else { row(k) }
    });
    write_samples(d, "nan.csv", "t,e,u", n, |k| {
        if k == 8 { "0.08,NaN,1".to_owned() } else { row(k) }
    });
    write_samples(d, "inf.csv", "t,e,u", n, |k| {
        if k == 9 { "0.09,1,inf".to_owned() } else { row(k) }
    });
    write_samples(d, "gap.csv", "t,e,u", n, |k| row(if k > 50 { k + 20 } else { k }));
    write_samples(d, "jitter.csv", "t,e,u", n, |k| {
        let (t, e, u) = wave(k);
        format!("{},{e},{u}", t + 0.003 * (k as f64 * 2.3).sin())
    });
    write_samples(d, "short.csv", "t,e,u", 33, row);
    write_samples(d, "zero.csv", "t,e,u", n, |k| format!("{},{},0", wave(k).0, wave(k).1));
    write_samples(d, "constant.csv", "t,e,u", n, |k| {
        format!("{},2.5,{}", wave(k).0, wave(k).2)
    });
    write_samples(d, "slow.csv", "t,e,u", n, |k| {
        format!("{},{},{}", 2.0 * wave(k).0, wave(k).1, wave(k).2)
    });
    write_samples(d, "one.csv", "t,e,u", n, row);
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
        (&["zero.csv"], &["u of record zero is constant"]),
        (&["constant.csv"], &["e of record constant is constant"]),
        (&["one.csv", "slow.csv"], &["0.02", "0.01", "--new-fs 50"]),
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
        let (code, message) = failure_of(d, &all);
        let usage = message.contains("--start lacks");
        assert_eq!(code, if usage { 2 } else { 1 }, "{arguments:?}: {message}");
        for part in expected {
            assert!(message.contains(part), "{arguments:?}: {part:?} is not in: {message}");
        }
    }
}

#[test]
fn output_that_is_a_multiple_of_the_input_is_named() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    stdout_of(at, &["simulate", "--condition", "C1", "--out", "run.csv"]);
    for (factor, text) in [(1.0, "1 times"), (-2.5, "-2.5 times")] {
        let run = fs::read_to_string(at.join("run.csv")).unwrap();
        let rows = run
            .lines()
            .filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
        let mut copy = "t,e,u\n".to_owned();
        for row in rows {
            let cells: Vec<f64> = row.split(',').take(3).map(|cell| cell.parse().unwrap()).collect();
            copy.push_str(&format!("{},{},{}\n", cells[0], cells[2], factor * cells[2]));
        }
        fs::write(at.join("copy.csv"), copy).unwrap();
        let (code, message) = failure_of(at, &["identify", "copy.csv"]);
        assert!(
            code == 1 && message.contains(text) && message.contains("--output"),
            "{message}"
        );
    }
}

#[test]
fn output_of_the_machine_as_control_is_doubtful() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    stdout_of(at, &["simulate", "--condition", "C1", "--out", "run.csv"]);
    for command in ["identify", "track", "describe"] {
        let found = json(at, &[command, "run.csv", "--input", "e", "--output", "f_t-e", "--json"]);
        let reasons = found["verdict"]["reasons"].as_array().unwrap();
        assert!(
            found["verdict"]["level"] != "trustworthy" && reasons.iter().any(|r| r["kind"] == "machine-output"),
            "{command}: {}",
            found["verdict"]
        );
    }
}

/// A remedy that has been followed is not repeated.
#[test]
fn remedies_for_times_can_be_followed() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    write_samples(d, "coarse.csv", "t,e,u", 400, |k| {
        let (t, e, u) = wave(k);
        format!("{t:.1},{e},{u}")
    });
    write_samples(d, "summary.csv", "t,e,u", 400, |k| {
        let (t, e, u) = wave(k);
        if k == 399 {
            format!(",{e},{u}")
        } else {
            format!("{t},{e},{u}")
        }
    });
    for (arguments, remedy, other) in [
        (
            &["coarse.csv"][..],
            "write t with more decimals, or give --fs",
            "--drop-repeated",
        ),
        (&["summary.csv"], "or remove these rows from the file", "--from"),
        (&["summary.csv", "--fill"], "remove these rows from the file", "--from"),
    ] {
        let (code, message) = failure_of(d, &[&["identify"], arguments].concat());
        assert!(
            code == 1 && message.contains(remedy) && !message.contains(other),
            "{message}"
        );
    }
}

#[test]
fn period_that_does_not_fit_is_a_note() {
    let directory = simulated_run();
    let text = stdout_of(directory.path(), &["identify", "c1.csv", "--period", "13"]);
    assert!(
        text.contains("no fit at the lines of the excitation") && text.contains("13 s"),
        "{text}"
    );
}

#[test]
fn wrong_usage_exits_with_two() {
    let directory = simulated_run();
    let d = directory.path();
    for arguments in [
        &["identify"][..],
        &["identify", "c1.csv", "./c1.csv"],
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
        &["identify", "c1.csv", "--structure", "bj", "--delay", "0.3..0.1"],
        &["identify", "c1.csv", "--structure", "bj", "--form", "lead-lag"],
        &["identify", "c1.csv", "--remnant-order", "1", "--form", "lead-lag"],
        &["identify", "c1.csv", "--prior", "omega_nm=1"],
        &["identify", "c1.csv", "--trace", "x.csv"],
        &["identify", "c1.csv", "--horizon", "10"],
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
        let (code, message) = failure_of(d, arguments);
        assert_eq!(code, 2, "{arguments:?}: {message}");
    }
}

#[test]
fn values_out_of_range_exit_with_two_and_write_nothing() {
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
        (&["--seed", "-1"], "--seed"),
    ] {
        let mut all = vec!["simulate", "--condition", "C1", "--out", "x.csv"];
        all.extend(arguments);
        let (code, message) = failure_of(d, &all);
        assert_eq!(code, 2, "{arguments:?}: {message}");
        assert!(message.contains(expected), "{arguments:?}: {message}");
    }
    stdout_of(d, &["simulate", "--condition", "C1", "--out", "run.csv"]);
    for option in ["--fs=-1", "--new-fs=0", "--run-in=-1", "--decimate=0"] {
        let (code, message) = failure_of(d, &["identify", "run.csv", option]);
        assert_eq!(code, 2, "{option}: {message}");
    }
    for option in ["--period=0", "--fs=nan"] {
        let (code, message) = failure_of(d, &["describe", "run.csv", "--excitation", "f_t", option]);
        assert_eq!(code, 2, "{option}: {message}");
    }
    let (code, _) = failure_of(d, &["simulate", "--condition", "C1", "--out", "no/such/place.csv"]);
    assert_eq!(code, 1);
}

#[test]
fn json_lines_and_matlab_headers_are_handled() {
    let directory = tempfile::tempdir().unwrap();
    let d = directory.path();
    let row = |k: usize| {
        let t = k as f64 / 100.0;
        (t, (3.0 * t).sin() + (7.0 * t).cos(), (3.0 * t - 0.9).sin())
    };
    let lines = |of: &dyn Fn((f64, f64, f64)) -> String| (0..1000).map(|k| of(row(k)) + "\n").collect::<String>();
    let json = lines(&|(t, e, u)| format!("{{\"t\": {t}, \"e\": {e}, \"u\": {u}}}"));
    std::fs::write(d.join("lines.txt"), json).unwrap();
    let (code, message) = failure_of(d, &["identify", "lines.txt"]);
    assert!(
        code > 0 && message.contains("lines.txt holds JSON, expected a table"),
        "{message}"
    );
    let matlab = lines(&|(t, e, u)| format!("  {t:.2}  {e:.6}  {u:.6}"));
    std::fs::write(d.join("saved.txt"), format!("% t e u\n{matlab}")).unwrap();
    let shown = stdout_of(d, &["info", "saved.txt"]);
    assert!(shown.contains("t: 1000 rows from 0 to 9.99 s"), "{shown}");
}
