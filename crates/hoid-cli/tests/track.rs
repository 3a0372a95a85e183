//! `hoid track` from the command line.
#![allow(clippy::unwrap_used)]

mod common;

use std::{fs, path::Path};

use serde_json::Value;
use tempfile::TempDir;

use common::{failure_of, hoid, json, setting, stdout_of, with_physical_method};

const KNOWN_ORDERS: [&str; 4] = ["--nk", "29", "--orders", "nd=1"];

fn simulated_run(condition: &str) -> TempDir {
    let directory = TempDir::new().unwrap();
    let arguments = ["simulate", "--condition", condition, "--seed", "1", "--out", "c.csv"];
    stdout_of(directory.path(), &arguments);
    directory
}

/// Runs `track` with the trace in `trace.csv`.
fn track_json(directory: &Path, more: &[&str]) -> Value {
    let mut arguments = vec!["track", "c.csv", "--out", "trace.csv", "--json"];
    arguments.extend(more);
    json(directory, &with_physical_method(&arguments))
}

/// Returns the header and rows of a trace; an empty cell is NaN.
fn trace(directory: &Path) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = fs::read_to_string(directory.join("trace.csv")).unwrap();
    let mut lines = text.lines().filter(|l| !l.starts_with('#'));
    let header = lines.next().unwrap().split(',').map(str::to_owned).collect();
    let number = |cell: &str| {
        if cell.is_empty() {
            f64::NAN
        } else {
            cell.parse().unwrap()
        }
    };
    (header, lines.map(|l| l.split(',').map(number).collect()).collect())
}

fn column(trace: &(Vec<String>, Vec<Vec<f64>>), name: &str) -> Vec<f64> {
    let index = trace.0.iter().position(|n| n == name).unwrap();
    trace.1.iter().map(|row| row[index]).collect()
}

/// The result is printed in any case; its rows are written only if a file is given.
#[test]
fn answer_needs_no_trace_file() {
    let directory = simulated_run("C1");
    let d = directory.path();
    let with = stdout_of(d, &["track", "c.csv", "--out", "trace.csv"]);
    fs::remove_file(d.join("trace.csv")).unwrap();
    let without = stdout_of(d, &["track", "c.csv"]);
    assert!(without.contains("--out TRACE.csv"), "{without}");
    let named = |line: &&str| !line.contains("trace.csv") && !line.contains("TRACE.csv");
    let [with, without] =
        [&with, &without].map(|text| text.lines().filter(named).map(str::to_owned).collect::<Vec<_>>());
    assert_eq!(with, without);
    assert!(json(d, &["track", "c.csv", "--json"])["trace"].is_null());
    assert_eq!(fs::read_dir(d).unwrap().count(), 1, "only the recording");
}

#[test]
fn start_fit_finds_the_operator_and_its_change() {
    let directory = simulated_run("C4");
    let d = directory.path();
    let found = track_json(d, &[]);
    assert_eq!(found["method"], "physical");
    assert_eq!(
        found["orders"],
        serde_json::json!({"na": 0, "nb": 2, "nc": 0, "nd": 1, "nf": 2, "nk": 29})
    );
    // The start fit equals the fit of `identify`, with the table of the search over nk 6..61 and nd 1..4.
    assert_eq!(found["start"]["candidates"].as_array().unwrap().len(), 224);
    assert_eq!(found["start"]["records"][0]["samples"], 2731);
    assert_eq!(found["start"]["operator"]["convertible"], true);
    assert_eq!((&found["samples"], &found["skipped"]), (&8192.into(), &0.into()));
    assert_eq!(found["rows_not_convertible"], 0);
    assert!(found["steps_shortened"].is_u64() && found["not_convertible_reason"].is_null());
    for name in ["K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm"] {
        let error = found["rms_relative_error"][name].as_f64().unwrap();
        assert!(error > 0.0 && error < 0.3, "{name}: {error}");
    }
    let trace = trace(d);
    assert_eq!(
        trace.0.join(","),
        "t,b0,b0_se,b1,b1_se,d1,d1_se,f1,f1_se,f2,f2_se,K_e,K_e_se,T_L,T_L_se,K_e_dot,K_e_dot_se,\
         omega_nm,omega_nm_se,zeta_nm,zeta_nm_se,convertible,innovation,held,steps_shortened"
    );
    assert_eq!(trace.1.len(), 8192);
    // Until the end of the start span the estimate is constant.
    let gain = column(&trace, "K_e");
    assert!((0..2730).all(|k| gain[k] == gain[0]) && gain[2800] != gain[0]);
    // Before and long after the change of C4, the estimates are within five standard errors.
    for (k, truth) in [(3500, 0.036), (8191, 0.084)] {
        let (value, error) = (column(&trace, "K_e_dot")[k], column(&trace, "K_e_dot_se")[k]);
        assert!((value - truth).abs() < 5.0 * error, "{k}: {value} +- {error}");
    }
    let last = trace.1.last().unwrap();
    let of = |value: &Value| value["value"].as_f64().unwrap();
    assert_eq!(of(&found["last"]["parameters"]["b0"]), last[1]);
    assert_eq!(of(&found["last"]["operator"]["K_e"]), last[11]);
    assert_eq!(found["last"]["t"].as_f64().unwrap(), last[0]);
}

/// Writes the run with changed rows to `c.csv`.
fn modify_record(directory: &Path, change: &mut dyn FnMut(Vec<String>) -> Vec<String>) {
    let file = directory.join("c.csv");
    let text = fs::read_to_string(&file).unwrap();
    let (head, rows): (Vec<&str>, Vec<&str>) = text.lines().partition(|l| l.starts_with('#') || l.starts_with('t'));
    let rows = change(rows.iter().map(|r| (*r).to_owned()).collect());
    fs::write(file, format!("{}\n{}\n", head.join("\n"), rows.join("\n"))).unwrap();
}

#[test]
fn single_outlier_is_held_back_and_reported() {
    let directory = simulated_run("C1");
    let d = directory.path();
    let mut arguments = KNOWN_ORDERS.to_vec();
    let clean = track_json(d, &arguments);
    assert_eq!(clean["faults"], serde_json::json!([]));
    assert_eq!((&clean["held"], &clean["restarts"]), (&0.into(), &0.into()));
    modify_record(d, &mut |mut rows| {
        let mut cells: Vec<&str> = rows[5000].split(',').collect();
        cells[2] = "100";
        rows[5000] = cells.join(",");
        rows
    });
    let found = track_json(d, &arguments);
    let fault = &found["faults"][0];
    assert_eq!((&fault["kind"], &fault["channel"]), (&"spike".into(), &"e".into()));
    assert_eq!(
        (&fault["from"], &fault["action"]),
        (&50.0.into(), &"held".into()),
        "{fault}"
    );
    assert!((fault["size"].as_f64().unwrap() - 100.0).abs() < 5.0, "{fault}");
    assert_eq!(found["held"], 1);
    let last = |all: &Value, name: &str, what: &str| all["last"]["operator"][name][what].as_f64().unwrap();
    for name in ["K_e", "K_e_dot", "omega_nm", "zeta_nm"] {
        let moved = (last(&found, name, "value") - last(&clean, name, "value")).abs();
        assert!(moved < 0.1 * last(&clean, name, "standard_error"), "{name}: {moved}");
    }
    // Without the guard the estimate differs.
    arguments.extend(["--guard", "no"]);
    let bare = track_json(d, &arguments);
    assert_eq!((&bare["held"], &bare["faults"]), (&0.into(), &serde_json::json!([])));
    let moved = (last(&bare, "omega_nm", "value") - last(&clean, "omega_nm", "value")).abs();
    assert!(moved > 3.0 * last(&clean, "omega_nm", "standard_error"), "{moved}");
    assert!(!trace(d).0.contains(&"held".to_owned()));
}

#[test]
fn idle_start_is_excluded_from_the_start_fit() {
    let directory = simulated_run("C1");
    let d = directory.path();
    modify_record(d, &mut |rows| {
        let columns = rows[0].split(',').count();
        let idle = (0..1500).map(|k| {
            let rest = vec!["0"; columns - 1].join(",");
            format!("{},{rest}", f64::from(k) / 100.0)
        });
        let later = rows.iter().map(|row| {
            let (t, rest) = row.split_once(',').unwrap();
            format!(
                "{},{rest}",
                ((t.parse::<f64>().unwrap() + 15.0) * 100.0).round() / 100.0
            )
        });
        idle.chain(later).collect()
    });
    let found = track_json(d, &["--orders", "nd=1"]);
    assert_eq!(found["orders"]["nk"], 29);
    assert!((found["idle_head"].as_f64().unwrap() - 15.0).abs() < 0.5);
    let updated = found["updated_from"].as_f64().unwrap();
    assert!((updated - 15.0 - 27.31).abs() < 0.7, "{updated}");
    let notes = found["verdict"].to_string();
    assert!(notes.contains("left out of the start fit"), "{notes}");
}

#[test]
fn page_contains_the_expected_text() {
    let directory = simulated_run("C4");
    let d = directory.path();
    let mut arguments = vec!["track", "c.csv", "--out", "trace.csv"];
    arguments.extend(KNOWN_ORDERS);
    arguments.extend(["--method", "physical", "-v"]);
    let page = stdout_of(d, &arguments);
    for part in [
        "8192 samples of 0.01 s",
        "Start: batch fit of 0.00 to 27.31 s, BJ(nb=2, nd=1, nf=2, nk=29)",
        "omega_nm (rad/s)",
        "RMS relative error",
        "0 skipped for a fault in e or u",
        "0 of 8192 rows have no operator",
        "K_e 5 s (500 samples)",
        "estimate moves from: 27.31 s",
        "Trace: trace.csv",
    ] {
        assert!(page.contains(part), "{part:?} is not in:\n{page}");
    }
    assert_eq!(page.lines().filter(|l| l.contains('±')).count(), 8);
    // The record has no true values.
    let text = fs::read_to_string(d.join("c.csv")).unwrap();
    let renamed = ["K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm"]
        .iter()
        .fold(text, |t, n| t.replace(&format!(",{n},"), &format!(",was_{n},")));
    fs::write(d.join("c.csv"), renamed).unwrap();
    assert!(!stdout_of(d, &arguments).contains("RMS relative error"));
}

#[test]
fn every_method_structure_and_forgetting_rule_runs() {
    let directory = simulated_run("C4");
    let d = directory.path();
    let cases: [&[&str]; 17] = [
        &["--method", "rls"],
        &["--method", "rls", "--structure", "fir", "--orders", "nb=3"],
        &["--method", "rls", "--forgetting", "window", "--covariance", "0.1"],
        &["--method", "rpem", "--orders", "nd=1"],
        &["--method", "rpem", "--structure", "oe"],
        &[
            "--method",
            "rpem",
            "--structure",
            "armax",
            "--regressor",
            "pseudo-linear",
        ],
        &["--method", "rpem", "--structure", "ararx", "--stable", "noise"],
        &["--method", "rpem", "--orders", "nd=1", "--forgetting", "variable"],
        &["--method", "rpem", "--orders", "nd=1", "--forgetting", "directional"],
        &[
            "--method",
            "rpem",
            "--orders",
            "nd=1",
            "--forgetting",
            "random-walk",
            "--drift",
            "b0=.01,b1=.01",
        ],
        &["--method", "rls", "--forgetting", "gradient", "--rate", ".01"],
        &[
            "--method", "window", "--orders", "nd=1", "--window", "15s", "--refit", "400",
        ],
        &["--method", "rriv", "--orders", "nd=1"],
        &["--orders", "nd=2", "--memory-of", "K_e=5s,d=1000,zeta_nm=inf"],
        &["--orders", "nd=1", "--bound", "omega_nm=5..30,zeta_nm=.1..1"],
        &["--orders", "nd=1", "--moving-average", "1.28", "--start-span", "0..15"],
        &["--orders", "nd=1", "--start", "nothing", "--update-from", "1"],
    ];
    for case in cases {
        let mut arguments = vec!["--nk", "29", "--to", "30", "--every", "7"];
        arguments.extend(case);
        let found = track_json(d, &arguments);
        let trace = trace(d);
        // Of 3000 samples, every seventh and the last are rows.
        assert_eq!(trace.1.len(), 429, "{case:?}");
        assert_eq!(found["rows"], 429);
        let names = found["last"]["parameters"].as_object().unwrap();
        assert!(names.values().all(|p| p["value"].is_f64()), "{case:?}");
        for name in names.keys() {
            assert!(column(&trace, name).iter().all(|v| v.is_finite()), "{case:?} {name}");
        }
        let convertible: f64 = column(&trace, "convertible").iter().sum();
        assert_eq!(found["rows_not_convertible"], 429 - convertible as u64, "{case:?}");
        assert_eq!(
            found["not_convertible_reason"].is_null(),
            convertible == 429.0,
            "{case:?}"
        );
    }
    let found = track_json(d, &["--orders", "nd=1", "--track-delay", ".2...4", "--to", "30"]);
    assert!((found["last"]["operator"]["tau_e"]["value"].as_f64().unwrap() - 0.28).abs() < 0.03);
    assert!(column(&trace(d), "tau_e_se").iter().all(|e| *e > 0.0));
}

/// Returns the value and standard error in the columns of a quantity in the last row.
fn last_value(trace: &(Vec<String>, Vec<Vec<f64>>), name: &str) -> (f64, f64) {
    let of = |name: &str| *column(trace, name).last().unwrap();
    (of(name), of(&format!("{name}_se")))
}

#[test]
fn default_method_needs_no_start_and_reports_the_loop() {
    let directory = simulated_run("C4");
    let d = directory.path();
    let arguments = [
        "track",
        "c.csv",
        "--out",
        "trace.csv",
        "--json",
        "--at",
        "1,2.5",
        "--controlled-element",
        "90/(s(s+6))",
    ];
    let found = json(d, &arguments);
    assert_eq!(found["method"], "adaptive");
    assert!(found["start"].is_null());
    assert_eq!(setting(&found, "start"), "the defaults for people");
    assert_eq!(setting(&found, "response at"), "1, 2.5 rad/s");
    let trace = trace(d);
    // The first second determines the scale of the gains; after that there are error bands, which become narrower.
    let errors = column(&trace, "gain_db@2.5_se");
    assert!(errors[..98].iter().all(|e| e.is_nan()) && errors[102] > 2.0 * errors[3000]);
    let crossover = column(&trace, "crossover_rad_s");
    // The controlled element is the element before the change.
    assert!(crossover[3000..4000].iter().all(|w| (w - 1.56).abs() < 0.5));
    for name in ["crossover_rad_s", "phase_margin_deg"] {
        let (value, error) = last_value(&trace, name);
        let told = &found["last"]["open_loop"][name];
        assert_eq!(told["value"].as_f64().unwrap(), value);
        assert_eq!(told["standard_error"].as_f64().unwrap(), error);
    }
    let without = column(&trace, "crossover_rad_s").iter().filter(|w| w.is_nan()).count();
    assert_eq!(found["rows_without_crossover"], without);
    assert!(without == 0 || found["no_crossover_reason"].is_string());
    // As long as the data contain no information about the neuromuscular system, this is reported.
    let determined = column(&trace, "omega_nm_determined");
    assert!(determined[..300].iter().all(|v| *v == 0.0));
    assert!(determined[1500..].iter().all(|v| *v == 1.0));
    assert_eq!(
        found["last"]["operator"]["K_e"]["determined"],
        column(&trace, "K_e_determined").last() == Some(&1.0)
    );
    let page = stdout_of(
        d,
        &[
            "track",
            "c.csv",
            "--out",
            "trace.csv",
            "--controlled-element",
            "90/(s(s+6))",
        ],
    );
    assert!(page.contains("Open loop at 81.91 s: crossover"), "{page}");
}

/// An earlier name of a method gives the same numbers; a note on standard error reports it.
#[test]
fn former_method_name_is_accepted_with_a_notice() {
    let directory = simulated_run("C1");
    let d = directory.path();
    let by = |method: &str| {
        let output = hoid(
            d,
            &["track", "c.csv", "--method", method, "--to", "20", "--out", "trace.csv"],
        );
        assert!(output.status.success());
        let trace = fs::read(d.join("trace.csv")).unwrap();
        (trace, output.stdout, String::from_utf8(output.stderr).unwrap())
    };
    let (now, before) = (by("adaptive"), by("population"));
    assert_eq!((&now.0, &now.1), (&before.0, &before.1));
    let note = "note: the method `population` is now called `adaptive`";
    assert_eq!(before.2.lines().filter(|line| *line == note).count(), 1, "{}", before.2);
    assert!(!now.2.contains("is now called"), "{}", now.2);
}

#[test]
fn earlier_fit_is_a_prior_for_tracking() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    for (seed, file) in [("1", "earlier.csv"), ("2", "c.csv")] {
        stdout_of(d, &["simulate", "--condition", "C1", "--seed", seed, "--out", file]);
    }
    let fit = json(d, &["identify", "earlier.csv", "--form", "lead", "--json"]);
    fs::write(d.join("fit.json"), fit.to_string()).unwrap();
    let with = [
        "track",
        "c.csv",
        "--out",
        "trace.csv",
        "--json",
        "--at",
        "2.5",
        "--prior",
        "fit.json",
    ];
    let found = json(d, &with);
    let start = setting(&found, "start");
    assert!(start.contains("fit.json") && start.contains("form lead"), "{start}");
    assert_eq!(setting(&found, "prior"), "fit.json");
    let known = trace(d);
    json(d, &["track", "c.csv", "--out", "trace.csv", "--json", "--at", "2.5"]);
    let default = trace(d);
    // The estimate is available from the first sample on, and its errors in the first seconds are smaller than without
    // a prior.
    let (of_known, of_usual) = (column(&known, "gain_db@2.5_se"), column(&default, "gain_db@2.5_se"));
    assert!(of_known[0].is_finite() && of_usual[0].is_nan());
    assert!(
        (150..800).all(|k| of_known[k] < of_usual[k]),
        "{} {}",
        of_known[150],
        of_usual[150]
    );
    // K_e_dot is .036 s; the fit of the other run is close to this value, and the estimate stays close.
    let (gain, error) = (column(&known, "K_e_dot"), column(&known, "K_e_dot_se"));
    let off = |k: usize| (gain[k] - 0.036).abs();
    assert!((0..gain.len()).all(|k| off(k) < 2.0 * error[k] && off(k) < 0.02));
    assert!(off(8191) < 0.003, "{}", gain[8191]);
    // Inconsistent options are reported before the work.
    stdout_of(
        d,
        &[
            "simulate",
            "--condition",
            "C1",
            "--sample-time",
            "0.02",
            "--out",
            "slow.csv",
        ],
    );
    fs::write(d.join("no.json"), "{}").unwrap();
    for (file, prior, expected) in [
        ("slow.csv", "fit.json", "100.000000 Hz"),
        ("c.csv", "no.json", "hoid identify --json"),
        ("c.csv", "T_L=1:0.2", "T_L"),
        ("c.csv", "absent.json", "cannot be read"),
    ] {
        let (_, message) = failure_of(d, &["track", file, "--out", "trace.csv", "--prior", prior]);
        assert!(message.contains(expected), "{prior}: {message}");
    }
    let (code, message) = failure_of(
        d,
        &[
            "track", "c.csv", "--out", "t.csv", "--method", "physical", "--prior", "none",
        ],
    );
    assert!(code == 2 && message.contains("--method adaptive"), "{message}");
    let (code, message) = failure_of(d, &["track", "c.csv", "--out", "fit.json", "--prior", "fit.json"]);
    assert!(code != 0 && !message.is_empty());
    assert!(fs::read_to_string(d.join("fit.json")).unwrap().contains("covariance"));
}

#[test]
fn memory_units_are_equivalent() {
    let directory = simulated_run("C1");
    let d = directory.path();
    let rows = |more: &[&str]| {
        let mut arguments = vec!["--method", "rpem", "--every", "50"];
        arguments.extend(KNOWN_ORDERS);
        arguments.extend(more);
        track_json(d, &arguments);
        trace(d).1
    };
    let samples = rows(&["--memory", "256"]);
    assert_eq!(rows(&["--lambda", "0.99609375"]), samples);
    assert_eq!(rows(&["--memory", "2.56s"]), samples);
    assert_eq!(rows(&["--memory-of", "b=256,d1=256,f=2.56s"]), samples);
    assert_ne!(rows(&[]), samples);
    assert_ne!(rows(&["--memory", "inf"]), samples);
    // The recursion starts from the same numbers, but theta is updated from the first sample on.
    let given = rows(&[
        "--start",
        "b0=.044,b1=-.043,d1=-.85,f1=-1.91,f2=.92",
        "--covariance",
        ".1",
    ]);
    assert!(given[2][1] != given[0][1]);
}

#[test]
fn report_contains_the_batch_fits() {
    let directory = simulated_run("C4");
    let d = directory.path();
    let page = |more: &[&str]| {
        let mut arguments = KNOWN_ORDERS.to_vec();
        arguments.extend(["--every", "8", "--report", "out"]);
        arguments.extend(more);
        track_json(d, &arguments);
        fs::read_to_string(d.join("out/report.html")).unwrap()
    };
    let own = page(&[]);
    assert!(own.contains("<svg") && own.contains("c tracked by physical"));
    let typed = page(&["--batch", "0..30.72,51.2..81.92"]);
    assert!(typed.contains("51.2") && typed != own);
    let (code, message) = failure_of(
        d,
        &[
            "track", "c.csv", "--out", "x.csv", "--method", "physical", "--nk", "29", "--report", "r", "--batch",
            "90..95",
        ],
    );
    assert!(code == 1 && message.contains("90"), "{message}");
}

#[test]
fn contradictory_options_exit_with_two() {
    let directory = simulated_run("C1");
    let d = directory.path();
    for (arguments, expected) in [
        (&["--method", "rls", "--structure", "bj"][..], "arx or fir"),
        (&["--method", "rls", "--structure", "arx", "--orders", "nd=1"], "nd"),
        (&["--memory-of", "x=256"], "K_e, K_e_dot, omega_nm, zeta_nm"),
        (&["--memory-of", "b0=256"], "K_e, K_e_dot, omega_nm, zeta_nm"),
        (&["--memory-of", "K_e=0"], "for K_e: more than 1 sample"),
        (&["--memory-of", "K_e=5,K_e=6"], "twice"),
        (&["--memory", "0"], "more than 1 sample"),
        (&["--memory", "0.001s"], "memory"),
        (&["--memory", "256", "--lambda", "0.9"], "--lambda"),
        (&["--lambda", "1.5"], "above 0 and up to 1"),
        (&["--method", "kalman"], "rpem"),
        (&["--structure", "arx"], "bj with nb = 2"),
        (&["--structure", "grey-box"], "bj"),
        (&["--forgetting", "random-walk"], "drift K_e=.01"),
        (
            &["--drift", "K_e=.1"],
            "forgetting = random-walk, to which this option belongs",
        ),
        (&["--forgetting", "random-walk", "--drift", "b0=.1"], "K_e"),
        (&["--rate", ".1"], "forgetting = gradient, to which this option belongs"),
        (&["--forgetting", "gradient", "--rate", "3"], "between 0 and 2"),
        (&["--covariance", "-1"], "positive"),
        (&["--largest", "0"], "positive"),
        (&["--window", "10s"], "--method window"),
        (&["--method", "window", "--memory", "256"], "--method rls or rpem"),
        (&["--method", "window", "--window", "inf"], "seconds"),
        (&["--method", "window", "--refit", "0"], "1 or more"),
        (&["--method", "rpem", "--bound", "omega_nm=5..30"], "--method physical"),
        (&["--bound", "K_x=5..30"], "K_e_dot"),
        (&["--method", "rls", "--track-delay", ".1...3"], "--method rpem"),
        (&["--start", "b0=1"], "--start: a start applies to a single model"),
        (&["--start", "b0=1", "--nk", "29"], "--start: it lacks b1"),
        (
            &[
                "--start",
                "b0=1,b1=1,d1=0,f1=0,f2=0",
                "--nk",
                "29",
                "--start-span",
                "0..5",
            ],
            "drop one",
        ),
        (&["--every", "0"], "1 or more"),
        (&["--batch", "0..20"], "--report"),
        (&["--update-from", "100"], "81.92"),
        (&["--moving-average", "-1"], "--moving-average"),
        (&["--nk", "5..2"], "LO <= HI"),
        (&["--method", "rpem", "--orders", "nx=2"], "nx"),
    ] {
        let mut all = vec!["track", "c.csv", "--out", "trace.csv"];
        all.extend(arguments);
        let (code, message) = failure_of(d, &with_physical_method(&all));
        assert_eq!(code, 2, "{arguments:?}: {message}");
        assert!(message.contains(expected), "{arguments:?}: {message}");
    }
}

#[test]
fn missing_results_exit_with_one() {
    let directory = simulated_run("C1");
    let d = directory.path();
    let text = fs::read_to_string(d.join("c.csv")).unwrap();
    fs::write(d.join("silent.csv"), "e,u\n".to_owned() + &"0,0\n".repeat(500)).unwrap();
    fs::write(d.join("hole.csv"), text.replacen(",0.0", ",nan", 3000)).unwrap();
    for (arguments, expected) in [
        (&["absent.csv"][..], "cannot be read"),
        (&["silent.csv", "--fs", "100"], "is constant"),
        (&["hole.csv"], "--fill"),
        (&["c.csv", "--to", "0.5"], "samples"),
        (&["c.csv", "--start-span", "500..600"], "500"),
        (&["c.csv", "--input", "nobody"], "nobody"),
        (
            &["c.csv", "--nk", "29", "--start", "b0=1,b1=1,d1=0,f1=-2.1,f2=1.2"],
            "start",
        ),
    ] {
        let mut all = vec!["track", "--out", "trace.csv"];
        all.extend(arguments);
        let (code, message) = failure_of(d, &with_physical_method(&all));
        assert_eq!(code, 1, "{arguments:?}: {message}");
        assert!(message.contains(expected), "{arguments:?}: {message}");
    }
    for out in ["trace.xyz", "trace", "."] {
        assert_eq!(failure_of(d, &["track", "c.csv", "--out", out]).0, 1, "{out}");
    }
    assert_eq!(
        failure_of(d, &["track", "c.csv", "--nk", "29", "--out", "no/such/place.csv"]).0,
        1
    );
}

#[test]
fn other_rates_need_no_extra_options() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    for sample_time in ["0.004", "0.001"] {
        let run = [
            "simulate",
            "--condition",
            "C1",
            "--seed",
            "3",
            "--sample-time",
            sample_time,
            "--out",
            "c.csv",
        ];
        stdout_of(d, &run);
        let with = ["--nk", "0.28s", "--every", "100", "--controlled-element", "90/(s(s+6))"];
        let track = ["track", "c.csv", "--out", "trace.csv", "--json"];
        json(d, &[&track[..], &with[..]].concat());
        let found = trace(d);
        for (name, truth) in [
            ("K_e", 0.09),
            ("omega_nm", 11.25),
            ("tau_e", 0.28),
            ("crossover_rad_s", 1.5635),
        ] {
            let last = |name: &str| *column(&found, name).last().unwrap();
            let off = (last(name) - truth) / last(&format!("{name}_se"));
            assert!(off.abs() < 3.0, "{name} at {sample_time} s: {off} standard errors");
        }
    }
}

#[test]
fn second_run_selects_the_start_covariance() {
    let directory = simulated_run("C4");
    let d = directory.path();
    stdout_of(
        d,
        &["simulate", "--condition", "C4", "--seed", "2", "--out", "second.csv"],
    );
    let arguments = [
        "track",
        "c.csv",
        "--method",
        "rpem",
        "--nk",
        "29",
        "--orders",
        "nd=1",
        "--every",
        "8",
        "--validate",
        "second.csv",
        "--out",
        "trace.csv",
    ];
    let with = |more: &[&'static str]| {
        arguments
            .iter()
            .copied()
            .chain(more.iter().copied())
            .collect::<Vec<_>>()
    };
    let found = json(d, &with(&["--json"]));
    let choice = &found["covariance_choice"];
    assert_eq!(choice["file"], "second.csv");
    let candidates = choice["candidates"].as_array().unwrap();
    let vaf = |one: &Value| one["vaf"].as_f64().unwrap();
    let best = candidates.iter().max_by(|a, b| vaf(a).total_cmp(&vaf(b))).unwrap();
    assert_eq!((candidates.len(), &best["covariance"]), (9, &choice["covariance"]));
    assert!((0.0..=100.0).contains(&vaf(best)) && vaf(best) > 80.0, "{choice}");
    let said: f64 = setting(&found, "covariance").parse().unwrap();
    assert_eq!(Some(said), choice["covariance"].as_f64());
    let page = stdout_of(d, &arguments);
    assert!(
        page.contains("P0") && page.contains("chosen") && page.contains("second.csv"),
        "{page}"
    );
    let (status, warnings) = failure_of(d, &with(&["--covariance", "0.1"]));
    assert!(status == 2 && warnings.contains("--covariance"), "{warnings}");
    // The result is independent of the initial P.
    let updated = json(d, &with(&["--json", "--update-covariance", "--covariance", "0.1"]));
    assert!(updated["covariance_choice"].is_null());
    assert!(setting(&updated, "covariance updated").contains("second.csv"));
    let (status, warnings) = failure_of(
        d,
        &[
            "track",
            "c.csv",
            "--method",
            "rpem",
            "--update-covariance",
            "--out",
            "trace.csv",
        ],
    );
    assert!(status == 2 && warnings.contains("--validate"), "{warnings}");
    let (status, warnings) = failure_of(d, &with(&["--track-delay", "0.2..0.4"]));
    assert!(status == 1 && warnings.contains("without track_delay"), "{warnings}");
    fs::write(d.join("second.csv"), "t,e,u\n0,1,1\n0.01,2,1\n").unwrap();
    let (_, warnings) = failure_of(d, &arguments);
    assert!(warnings.contains("in common"), "{warnings}");
}

#[test]
fn rpem_tracks_a_delay_and_reports_the_windup_guard() {
    let directory = simulated_run("C4");
    let d = directory.path();
    let text = [
        "--method",
        "rpem",
        "--nk",
        "29",
        "--orders",
        "nd=1",
        "--covariance",
        "0.1",
        "--limit",
        "inf",
    ];
    let of = |more: &[&str]| {
        let mut arguments = vec!["track", "c.csv", "--out", "trace.csv", "--every", "16", "--json"];
        arguments.extend(text);
        arguments.extend(more);
        json(d, &arguments)
    };
    let memory = |found: &Value| setting(found, "memory");
    assert!(memory(&of(&[])).contains("without a windup guard"));
    let guarded = of(&["--windup-guard", "1e4"]);
    assert!(!memory(&guarded).contains("without"));
    assert_eq!(setting(&guarded, "windup guard"), "1e4");
    let followed = of(&["--track-delay", "0.2..0.4"]);
    let tau = followed["last"]["operator"]["tau_e"]["value"].as_f64().unwrap();
    assert!((tau - 0.28).abs() < 0.03, "{tau}");
    assert!(column(&trace(d), "tau_e").iter().all(|tau| (0.2..=0.4).contains(tau)));
}

#[test]
fn methods_are_listed_without_a_record() {
    let directory = TempDir::new().unwrap();
    let text = stdout_of(directory.path(), &["track", "--methods"]);
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].starts_with("adaptive        default"), "{text}");
    assert!(
        lines.iter().any(|line| line.starts_with("dual-ekf        survey")),
        "{text}"
    );
    // Options that only methods for comparison have are listed here, and not in help.
    let window = lines.iter().find(|line| line.starts_with("window ")).unwrap();
    assert!(window.ends_with("further options: --window, --refit)"), "{window}");
    let help = stdout_of(directory.path(), &["track", "--help"]);
    assert!(!help.contains("--refit") && help.contains("--memory"), "{help}");
    let all = json(directory.path(), &["track", "--methods", "--json"]);
    let all = all.as_array().unwrap();
    assert_eq!(all.len(), lines.len());
    assert_eq!(all[0]["name"], "adaptive");
    assert_eq!(all[0]["default"], true);
    assert!(all.iter().all(|one| !one["structures"].as_array().unwrap().is_empty()));
    // The command without `--methods` requires a record.
    let (code, message) = failure_of(directory.path(), &["track"]);
    assert!(code == 2 && message.contains("RECORD"), "{message}");
    assert_eq!(failure_of(directory.path(), &["track", "c.csv", "--methods"]).0, 2);
}

#[test]
fn non_recursive_methods_are_refused_with_advice() {
    let directory = TempDir::new().unwrap();
    for (typed, name) in [
        ("wavelet", "wavelet is not a recursion"),
        ("lpv", "lpv-subspace is not a recursion"),
        ("rls-fir", "rls-fir does not track recordings"),
    ] {
        let (code, message) = failure_of(directory.path(), &["track", "c.csv", "--method", typed]);
        assert_eq!(code, 2);
        assert!(message.contains(name), "{message}");
        assert!(message.contains("survey_methods"), "{message}");
    }
}
