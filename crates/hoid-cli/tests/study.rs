//! Studies and the reproduction from the command line.
#![allow(clippy::unwrap_used)]

mod common;

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use tempfile::TempDir;

use common::{failure_of, json, stdout_of};

const PLAN: &str = r#"
name = "short"
seed = 3
replications = 40
block = 2

[[scenarios]]
condition = ["C1", "C2"]
remnant.noise_level = 0.1

[[estimators]]
name = "BJ"
method = "fit"
structure = "bj"
orders.nd = [1, 2]
"#;

fn plan_folder() -> TempDir {
    let directory = TempDir::new().unwrap();
    fs::write(directory.path().join("plan.toml"), PLAN).unwrap();
    directory
}

fn part_count(directory: &Path) -> usize {
    fs::read_dir(directory.join("parts")).map_or(0, |entries| {
        entries
            .filter(|e| e.as_ref().unwrap().path().extension().is_some_and(|x| x == "parquet"))
            .count()
    })
}

#[test]
fn killed_study_resumes_to_identical_files() {
    let directory = plan_folder();
    let at = directory.path();
    stdout_of(at, &["study", "run", "plan.toml", "--out", "whole"]);
    let mut killed = 0;
    // The study is killed at several instants, regardless of what it writes at that time.
    for wait_ms in [0, 35, 71, 13] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_hoid"))
            .args([
                "study",
                "run",
                "plan.toml",
                "--out",
                "killed",
                "--resume",
                "--jobs",
                "1",
            ])
            .current_dir(at)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let (before, start_time) = (part_count(&at.join("killed")), Instant::now());
        while part_count(&at.join("killed")) <= before && child.try_wait().unwrap().is_none() {
            assert!(start_time.elapsed() < Duration::from_secs(60), "nothing is written");
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_millis(wait_ms));
        // After SIGKILL, the program cannot clean up.
        if child.kill().is_ok() && !child.wait().unwrap().success() {
            killed += 1;
        }
    }
    assert!(killed > 0, "the study was over before it could be killed");
    let (_, message) = failure_of(at, &["study", "run", "plan.toml", "--out", "killed"]);
    assert!(message.contains("--resume"), "{message}");
    stdout_of(at, &["study", "run", "plan.toml", "--out", "killed", "--resume"]);
    for name in [
        "cells.parquet",
        "fits.parquet",
        "summary.parquet",
        "study.json",
        "plan.toml",
    ] {
        let read = |study: &str| fs::read(at.join(study).join(name)).unwrap();
        assert!(read("whole") == read("killed"), "{name}");
    }
    assert!(!at.join("killed/parts").exists());
}

#[test]
fn shards_are_merged_and_missing_ones_reported() {
    let directory = plan_folder();
    let at = directory.path();
    let few = ["--replications", "3"];
    stdout_of(
        at,
        &[&["study", "run", "plan.toml", "--out", "whole", "--csv"], &few[..]].concat(),
    );
    for shard in ["1/2", "2/2"] {
        let out = &shard[..1];
        stdout_of(
            at,
            &[&["study", "run", "plan.toml", "--out", out, "--shard", shard], &few[..]].concat(),
        );
    }
    let (code, message) = failure_of(at, &["study", "merge", "1", "--out", "merged"]);
    assert!(code == 1 && message.contains("are missing"), "{message}");
    let merged = json(at, &["study", "merge", "2", "1", "--out", "merged", "--csv", "--json"]);
    assert_eq!(merged["estimates"], 2 * 2 * 3);
    for name in ["cells.csv", "fits.csv", "summary.csv"] {
        let read = |study: &str| fs::read_to_string(at.join(study).join(name)).unwrap();
        assert!(read("whole") == read("merged"), "{name}");
        assert!(read("whole").contains("plan sha256"), "{name}");
    }
}

#[test]
fn single_run_of_a_study_can_be_repeated() {
    let directory = plan_folder();
    let at = directory.path();
    stdout_of(
        at,
        &[
            "study",
            "run",
            "plan.toml",
            "--out",
            "s",
            "--csv",
            "--replications",
            "2",
        ],
    );
    stdout_of(
        at,
        &[
            "simulate",
            "--condition",
            "C2",
            "--noise-level",
            "0.1",
            "--seed",
            "3",
            "--cell",
            "1",
            "--replication",
            "1",
            "--out",
            "run.csv",
        ],
    );
    let fit = json(
        at,
        &[
            "identify",
            "run.csv",
            "--structure",
            "bj",
            "--orders",
            "nb=2,nc=0,nd=2,nf=2",
            "--nk",
            "29",
            "--json",
        ],
    );
    let value = fit["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .find(|p| p["name"] == "f1")
        .unwrap()["value"]
        .as_f64()
        .unwrap();
    let table = fs::read_to_string(at.join("s/fits.csv")).unwrap();
    let lines: Vec<Vec<&str>> = table
        .lines()
        .filter(|l| !l.starts_with('#'))
        .map(|l| l.split(',').collect())
        .collect();
    let column = |name: &str| lines[0].iter().position(|c| *c == name).unwrap();
    let row = lines[1..]
        .iter()
        .find(|l| l[column("cell")] == "1" && l[column("replication")] == "1" && l[column("nd")] == "2.0")
        .unwrap();
    // A study fits its runs together, so its results differ from a separate fit by rounding errors: by less than 1e-7
    // of a standard error, which is about 0.01 here.
    let of_study = row[column("f1")].parse::<f64>().unwrap();
    assert!((of_study - value).abs() < 1e-9, "{of_study} {value}");
}

/// A study gives the same result as `hoid identify` for the same run in a file, digit for digit, including the verdict.
#[test]
fn study_and_identify_give_the_same_result() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    let plan = r#"
name = "twins"
seed = 3
replications = 1
[[scenarios]]
condition = ["C1", "C4"]
remnant.noise_level = 0.1
[[estimators]]
name = "operator"
method = "operator"
[[estimators]]
name = "change"
method = "operator"
change = "sigmoid"
[[estimators]]
name = "SRIV"
method = "sriv"
"#;
    fs::write(at.join("twins.toml"), plan).unwrap();
    let printed = stdout_of(at, &["study", "run", "twins.toml", "--out", "s", "--csv"]);
    assert!(printed.contains("trustworthy"), "{printed}");
    let table = hoid::io::read_table(&at.join("s/fits.csv")).unwrap();
    let texts = |column: &str| match table.column(column) {
        Some(hoid::io::ColumnValues::Text(values)) => values.clone(),
        other => panic!("{column}: {other:?}"),
    };
    let (conditions, names, verdicts) = (texts("condition"), texts("name"), texts("verdict"));
    for (cell, condition) in [("0", "C1"), ("1", "C4")] {
        let simulate =
            format!("simulate --condition {condition} --noise-level 0.1 --seed 3 --cell {cell} --out run.csv");
        stdout_of(at, &simulate.split(' ').collect::<Vec<_>>());
        for (name, options) in [
            ("operator", "--prior none"),
            ("change", "--change sigmoid"),
            ("SRIV", "--method sriv --nk 29"),
        ] {
            let call = format!("identify run.csv --json {options}");
            let out = Command::new(env!("CARGO_BIN_EXE_hoid"))
                .args(call.split(' '))
                .current_dir(at)
                .output()
                .unwrap();
            let found: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
            let row = (0..names.len()).find(|row| conditions[*row] == condition && names[*row] == name);
            let row = row.unwrap();
            assert_eq!(found["verdict"]["level"], verdicts[row], "{condition} {name}");
            let parameters = found["parameters"].as_array().unwrap();
            assert!(parameters.len() > 3, "{condition} {name}");
            for p in parameters {
                let column = p["name"].as_str().unwrap();
                let Some(hoid::io::ColumnValues::Real(of_study)) = table.column(column) else {
                    panic!("no column {column}");
                };
                let (a, b) = (of_study[row], p["value"].as_f64().unwrap());
                assert_eq!(a, b, "{condition} {name} {column}");
            }
        }
    }
}

#[test]
fn wrong_plans_and_names_are_refused() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    fs::write(
        at.join("bad.toml"),
        PLAN.replace("noise_level = 0.1", "noise_level = 1.5"),
    )
    .unwrap();
    let (code, message) = failure_of(at, &["study", "run", "bad.toml", "--out", "x"]);
    assert!(code == 2 && message.contains("bad.toml, line 9"), "{message}");
    let (code, message) = failure_of(at, &["study", "check", "nothing.toml"]);
    assert!(code == 1 && message.contains("nothing.toml"), "{message}");
    let (code, message) = failure_of(at, &["study", "plans", "nothing"]);
    assert!(code == 2 && message.contains("recursive"), "{message}");
    let (code, message) = failure_of(at, &["reproduce", "--only", "fig-99"]);
    assert!(code == 2 && message.contains("--list"), "{message}");
    let (code, _) = failure_of(at, &["study", "run", "bias", "--out", "x", "--shard", "3/2"]);
    assert_eq!(code, 2);
}

#[test]
fn reproduction_draws_the_requested_items() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    let list = stdout_of(at, &["reproduce", "--list"]);
    for name in ["table-2", "fig-12", "C.16", "D.18", "E.16", "F.8", "G.8", "H.12", "A.1"] {
        assert!(list.lines().any(|line| line.starts_with(&format!("{name} "))), "{name}");
    }
    let arguments = [
        "reproduce",
        "--only",
        "table-2,fig-3,A.1",
        "--replications",
        "2",
        "--out",
        "r",
    ];
    stdout_of(at, &arguments);
    let page = fs::read_to_string(at.join("r/index.html")).unwrap();
    for part in [
        "figures/fig-3.svg",
        "figures/A.1.svg",
        "tables/table-2.csv",
        "1.56349",
        "studies/noise-level/plan.toml",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let read = || {
        ["r/figures/A.1.svg", "r/figures/A.1.csv", "r/figures/fig-3.svg"].map(|name| fs::read(at.join(name)).unwrap())
    };
    let before = read();
    stdout_of(at, &arguments);
    assert!(read() == before, "drawn again from the study that is there");
    let (_, message) = failure_of(at, &["reproduce", "--only", "A.1", "--replications", "3", "--out", "r"]);
    assert!(message.contains("replications is 2, but this run has 3"), "{message}");
}
