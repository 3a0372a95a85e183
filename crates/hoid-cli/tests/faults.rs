//! Faults of recorded data: no estimate deviates by more than four standard errors from the true value without a
//! finding.
#![allow(clippy::unwrap_used)]

mod common;

use std::{fs, path::Path};

use serde_json::Value;
use tempfile::TempDir;

use common::{hoid, json, json_with_any_exit_code, stdout_of};

/// Time, error and control of a run.
type Rows = Vec<[f64; 3]>;

fn simulated_rows(d: &Path, condition: &str, seed: &str) -> Rows {
    stdout_of(
        d,
        &["simulate", "--condition", condition, "--seed", seed, "--out", "run.csv"],
    );
    let text = fs::read_to_string(d.join("run.csv")).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let index = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let columns = ["t", "e", "u"].map(index);
    lines
        .map(|line| {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            columns.map(|c| cells[c])
        })
        .collect()
}

fn write_rows(d: &Path, rows: &Rows) {
    let lines: String = rows.iter().map(|[t, e, u]| format!("{t},{e},{u}\n")).collect();
    fs::write(d.join("c.csv"), "t,e,u\n".to_owned() + &lines).unwrap();
}

const BOX_JENKINS_OPTIONS: [&str; 4] = ["--structure", "bj", "--nk", "29"];

fn identify(d: &Path, how: &[&str]) -> Value {
    json_with_any_exit_code(d, &[&["identify", "c.csv", "--json"], how].concat())
}

/// Returns the operator parameters with their values and standard errors.
fn estimates(found: &Value) -> Vec<(String, f64, f64)> {
    let of = |name: &str, e: &Value| Some((name.to_owned(), e["value"].as_f64()?, e["standard_error"].as_f64()?));
    match found["parameters"][0]["determined"].as_bool() {
        Some(_) => {
            let all = found["parameters"].as_array().unwrap().iter();
            all.filter(|p| p["determined"] == true)
                .filter_map(|p| of(p["name"].as_str().unwrap(), p))
                .collect()
        }
        None => {
            let operator = found["operator"].as_object().unwrap();
            operator.iter().filter_map(|(name, e)| of(name, e)).collect()
        }
    }
}

/// Checks that the estimates are within four standard errors of the true values of C1, or that the result is not
/// trustworthy.
fn assert_correct_or_flagged(found: &Value, what: &str) {
    let truth = [
        ("K_e", 0.09),
        ("T_L", 0.4),
        ("K_e_dot", 0.036),
        ("omega_nm", 11.25),
        ("zeta_nm", 0.35),
        ("tau_e", 0.28),
    ];
    if found["verdict"]["level"] != "trustworthy" {
        return;
    }
    let estimates = estimates(found);
    assert!(estimates.len() > 2, "{what}: {found}");
    for (name, value, error) in estimates {
        if let Some((_, truth)) = truth.iter().find(|(known, _)| *known == name) {
            assert!(
                (value - truth).abs() < 4.0 * error,
                "{what}: {name} = {value} ± {error}"
            );
        }
    }
}

fn fault_kinds(found: &Value) -> Vec<&str> {
    let faults = found["faults"].as_array().unwrap().iter();
    faults.map(|f| f["kind"].as_str().unwrap()).collect()
}

#[test]
fn single_outlier_is_repaired() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let clean = simulated_rows(d, "C1", "71");
    write_rows(d, &clean);
    let before = identify(d, &BOX_JENKINS_OPTIONS);
    assert!(fault_kinds(&before).is_empty(), "{before}");
    for index in [1234, 4000] {
        let mut rows = clean.clone();
        rows[index][1] = 30.0;
        write_rows(d, &rows);
        let found = identify(d, &BOX_JENKINS_OPTIONS);
        assert_eq!(fault_kinds(&found), ["spike"]);
        let fault = &found["faults"][0];
        assert_eq!(
            (fault["channel"].as_str(), fault["action"].as_str()),
            (Some("e"), Some("bridged"))
        );
        assert!(
            (fault["from"].as_f64().unwrap() - rows[index][0]).abs() < 1e-9,
            "{fault}"
        );
        assert_correct_or_flagged(&found, "bridged");
        assert_eq!(found["verdict"]["level"], "trustworthy", "{}", found["verdict"]);
        for ((name, one, error), (_, other, _)) in estimates(&before).iter().zip(estimates(&found)) {
            assert!((one - other).abs() < 0.1 * error, "{name} {one} {other}");
        }
    }
    // The fault is also found by default, and is shown on the page, in the report and in `info`.
    let found = identify(d, &["--form", "lead"]);
    assert_eq!(fault_kinds(&found), ["spike"]);
    assert_correct_or_flagged(&found, "family");
    let page = stdout_of(
        d,
        &[&["identify", "c.csv", "--report", "page"], &BOX_JENKINS_OPTIONS[..]].concat(),
    );
    assert!(page.contains("spike in e at 40 s, off by"), "{page}");
    let report = fs::read_to_string(d.join("page/report.html")).unwrap();
    assert!(report.contains("spike in e at 40 s"));
    assert!(stdout_of(d, &["info", "c.csv"]).contains("spike in e at 40 s"));
    assert_eq!(fault_kinds(&json(d, &["info", "c.csv", "--json"])), ["spike"]);
}

#[test]
fn reported_faults_are_doubtful_and_kept_ones_ignored() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let mut rows = simulated_rows(d, "C1", "72");
    rows[4000][1] = 30.0;
    write_rows(d, &rows);
    let of = |handling: &str| identify(d, &[&BOX_JENKINS_OPTIONS[..], &["--faults", handling]].concat());
    let reported = of("report");
    assert_eq!(reported["verdict"]["level"], "doubtful");
    assert_eq!(reported["faults"][0]["action"], "reported");
    assert!(fault_kinds(&of("keep")).is_empty());
    let cut = of("cut");
    assert_eq!(
        (
            cut["faults"][0]["action"].as_str(),
            cut["records"].as_array().unwrap().len()
        ),
        (Some("cut"), 2)
    );
    assert_correct_or_flagged(&cut, "cut");
    assert_eq!(
        hoid(d, &["identify", "c.csv", "--faults", "mend"]).status.code(),
        Some(2)
    );
}

#[test]
fn rest_before_a_run_is_cut() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let run = simulated_rows(d, "C1", "73");
    let rest = (0..1500).map(|k| [f64::from(k) / 100.0, 0.0, 0.0]);
    let rows: Rows = rest.chain(run.iter().map(|[t, e, u]| [t + 15.0, *e, *u])).collect();
    write_rows(d, &rows);
    let found = identify(d, &BOX_JENKINS_OPTIONS);
    assert!(fault_kinds(&found).contains(&"idle"), "{found}");
    assert_eq!(found["records"][0]["samples"].as_u64().unwrap() / 10, 819);
    assert_correct_or_flagged(&found, "rest");
    assert_correct_or_flagged(&identify(d, &["--form", "lead"]), "rest, family");
}

#[test]
fn wrong_units_columns_and_sign_are_reported() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let run = simulated_rows(d, "C1", "74");
    let write = |change: fn(&[f64; 3]) -> [f64; 3]| write_rows(d, &run.iter().map(change).collect());
    write(|[t, e, u]| [1000.0 * t, *e, *u]);
    let found = identify(d, &[]);
    assert_eq!(found["verdict"]["level"], "not determined");
    assert_eq!(fault_kinds(&found)[0], "time-unit");
    // Polynomial models are used for any system, even a furnace, so there is only a note.
    let found = identify(d, &BOX_JENKINS_OPTIONS);
    assert_eq!(found["verdict"]["level"], "trustworthy", "{found}");
    assert!(fault_kinds(&found).contains(&"time-unit"), "{found}");
    write(|[t, e, u]| [*t, *u, *e]);
    let found = identify(d, &BOX_JENKINS_OPTIONS);
    assert!(fault_kinds(&found).contains(&"exchanged"), "{found}");
    assert_ne!(found["verdict"]["level"], "trustworthy");
    write(|[t, e, u]| [*t, *e, -u]);
    let found = identify(d, &BOX_JENKINS_OPTIONS);
    assert_eq!(
        (fault_kinds(&found), found["verdict"]["level"].as_str()),
        (vec!["sign"], Some("doubtful"))
    );
    let repaired = identify(d, &[&BOX_JENKINS_OPTIONS[..], &["--output=-u"]].concat());
    assert_eq!(repaired["verdict"]["level"], "trustworthy", "{}", repaired["verdict"]);
}

#[test]
fn too_short_record_is_not_determined() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let mut rows = simulated_rows(d, "C1", "75");
    rows.truncate(60);
    write_rows(d, &rows);
    let found = identify(d, &BOX_JENKINS_OPTIONS);
    assert_eq!(found["verdict"]["level"], "not determined");
    let findings = found["verdict"]["findings"].as_array().unwrap();
    assert!(findings.iter().any(|f| f["kind"] == "too-few"), "{findings:?}");
}

#[test]
fn offset_is_estimated_and_causes_no_bias() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let run = simulated_rows(d, "C1", "76");
    let deviation = |k: usize| (run.iter().map(|row| row[k] * row[k]).sum::<f64>() / run.len() as f64).sqrt();
    let (of_e, of_u) = (deviation(1), deviation(2));
    write_rows(d, &run);
    let clean = identify(d, &BOX_JENKINS_OPTIONS);
    let level = |found: &Value| {
        let level = &found["records"][0]["level"];
        (
            level["value"].as_f64().unwrap(),
            level["standard_error"].as_f64().unwrap(),
        )
    };
    for share in [0.03, 0.5] {
        let moved = |[t, e, u]: &[f64; 3]| [*t, e + share * of_e, u + share * of_u];
        write_rows(d, &run.iter().map(moved).collect());
        let found = identify(d, &BOX_JENKINS_OPTIONS);
        assert_eq!(found["verdict"]["level"], "trustworthy", "{}", found["verdict"]);
        for ((name, one, error), (_, other, _)) in estimates(&clean).iter().zip(estimates(&found)) {
            assert!((one - other).abs() < 0.01 * error, "{share}: {name} {one} {other}");
        }
        // c changes by the constant added to u minus the response to the constant added to e.
        let gain = estimates(&found).iter().find(|(name, ..)| name == "K_e").unwrap().1;
        let (by, (_, error)) = (level(&found).0 - level(&clean).0, level(&found));
        let added = share * of_u - gain * share * of_e;
        assert!(
            error > 0.0 && (by - added).abs() < 0.01 * added.abs().max(error),
            "{by} {added}"
        );
        // If the data are used unchanged, the level is reported where relevant.
        let kept = identify(d, &[&BOX_JENKINS_OPTIONS[..], &["--detrend", "mean"]].concat());
        assert!(kept["records"][0]["level"].is_null());
        let page = stdout_of(d, &[&["identify", "c.csv", "-v"], &BOX_JENKINS_OPTIONS[..]].concat());
        assert!(page.contains("level of u in addition to the response to e: "), "{page}");
        let family = identify(d, &["--form", "lead"]);
        assert!(family["records"][0]["level"]["value"].is_number());
    }
    // A simulated run, which contains its true values, has no level.
    let as_simulated = json(
        d,
        &[&["identify", "run.csv", "--json"], &BOX_JENKINS_OPTIONS[..]].concat(),
    );
    assert!(as_simulated["records"][0]["level"].is_null());
}

#[test]
fn jump_of_delay_or_operator_is_reported() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let (run, other) = (simulated_rows(d, "C1", "77"), simulated_rows(d, "C2", "78"));
    let finding = |how: &[&str]| {
        let found = identify(d, how);
        let findings = found["verdict"]["findings"].as_array().unwrap().clone();
        let mut words = findings.iter().filter(|f| f["kind"] == "not-constant");
        words.next().map(|f| f["words"].as_str().unwrap().to_owned())
    };
    let fits: [&[&str]; 3] = [&BOX_JENKINS_OPTIONS, &["--remnant-order", "1"], &["--form", "lead"]];
    let n = run.len();
    let late: Rows = (0..n)
        .map(|t| [run[t][0], run[t][1], run[if t < n / 2 { t } else { t - 20 }][2]])
        .collect();
    write_rows(d, &late);
    for how in fits {
        let words = finding(how).unwrap();
        assert!(words.contains("tau_e changes by about +"), "{how:?}: {words}");
    }
    let from = 2 * n / 3;
    let second: Rows = (0..n)
        .map(|t| {
            if t < from {
                run[t]
            } else {
                [run[t][0], other[t][1], other[t][2]]
            }
        })
        .collect();
    write_rows(d, &second);
    for how in fits {
        assert!(finding(how).is_some(), "{how:?}");
    }
    write_rows(d, &run);
    for how in fits {
        assert_eq!(finding(how), None, "{how:?}");
    }
}

#[test]
fn robust_fit_is_insensitive_to_a_single_sample() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let mut rows = simulated_rows(d, "C1", "79");
    let how = [&BOX_JENKINS_OPTIONS[..], &["--robust", "--faults", "keep"]].concat();
    write_rows(d, &rows);
    let before = estimates(&identify(d, &how));
    rows[4000][1] = 30.0;
    write_rows(d, &rows);
    let after = estimates(&identify(d, &how));
    assert!(before.len() > 3);
    for ((name, one, error), (_, other, _)) in before.iter().zip(&after) {
        assert!((one - other).abs() < 0.5 * error, "{name} {one} {other} ± {error}");
    }
}

#[test]
fn recorded_people_have_few_faults() {
    let Some(recordings) = std::env::var_os("HOID_HUMAN_DATA") else {
        eprintln!("skipped: HOID_HUMAN_DATA names no directory of recordings");
        return;
    };
    let (mut all, mut flagged) = (0, Vec::new());
    for entry in fs::read_dir(recordings).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        if !name.ends_with(".csv") || !name.starts_with('P') {
            continue;
        }
        let file = path.to_str().unwrap();
        let how = [
            "--structure",
            "arx",
            "--nk",
            "12",
            "--orders",
            "na=2,nb=2",
            "--input",
            "r-y",
            "--from",
            "5",
            "--to",
            "45",
        ];
        let found = json_with_any_exit_code(Path::new("."), &[&["identify", file, "--json"], &how[..]].concat());
        let of_values = |f: &&Value| {
            !matches!(
                f["kind"].as_str(),
                Some("quantised" | "saturated" | "clock" | "drift" | "jitter")
            )
        };
        let faults = found["faults"].as_array().unwrap();
        all += 1;
        if let Some(fault) = faults.iter().find(of_values) {
            flagged.push(format!("{name}: {}", fault["words"]));
        }
    }
    assert!(all > 50);
    assert!(flagged.len() <= 2, "{} of {all}: {flagged:#?}", flagged.len());
}
