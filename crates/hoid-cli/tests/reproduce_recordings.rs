//! `hoid reproduce --only experiment --recordings`: the experiment of the thesis with recorded people, who are
//! simulated here.
#![allow(clippy::unwrap_used)]

mod common;

use std::{fs, path::Path};

use common::{failure_of, stdout_of};
use tempfile::TempDir;

const RECORDING_OPTIONS: [&str; 6] = [
    "reproduce",
    "--only",
    "experiment",
    "--recordings",
    "recordings",
    "--out",
];

/// Writes recordings with an axis in their names, and their manifest by `hoid group init`.
fn write_recordings(at: &Path) {
    let arguments = "simulate-group --subjects 2 --runs 1 --conditions C1,C4 --noise-level 0.02 --out recordings";
    stdout_of(at, &arguments.split(' ').collect::<Vec<_>>());
    let directory = at.join("recordings");
    for name in ["group.toml", "truth.csv"] {
        fs::remove_file(directory.join(name)).unwrap();
    }
    for subject in ["S1", "S2"] {
        for (simulated, recorded) in [("C1_1", "fixed_roll_1"), ("C4_1", "sudden_roll_1")] {
            let file = |name: &str| directory.join(format!("{subject}_{name}.csv"));
            fs::rename(file(simulated), file(recorded)).unwrap();
        }
    }
    stdout_of(
        at,
        &[
            "group",
            "init",
            "recordings",
            "--pattern",
            "{subject}_{condition}_{axis}_{run}.csv",
            "--element",
            "fixed-*=90/(s(s+6))",
            "--element",
            "sudden-roll=90/(s(s+6)) > 30/(s(s+.2)) @ 40.96 : 100",
        ],
    );
    edit_manifest(at, "delay_s = [\n    0.05,\n    0.6,\n]", "delay_s = [0.26, 0.3]");
}

fn edit_manifest(at: &Path, from: &str, to: &str) {
    let path = at.join("recordings/group.toml");
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{from}: {text}");
    fs::write(path, text.replace(from, to)).unwrap();
}

fn reproduce_arguments<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&RECORDING_OPTIONS, more].concat()
}

#[test]
fn recorded_people_get_the_thesis_table_and_figures() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    write_recordings(at);
    let manifest = fs::read_to_string(at.join("recordings/group.toml")).unwrap();
    for line in [
        "[conditions.sudden-roll]",
        "changes_to = \"30/(s(s+.2))\"",
        "change_s = 40.96",
    ] {
        assert!(manifest.contains(line), "{line}: {manifest}");
    }
    // One run cannot be read.
    fs::write(at.join("recordings/S2_fixed_roll_1.csv"), "t,e,u\n0,1,x\n").unwrap();
    stdout_of(at, &reproduce_arguments(&["out"]));

    let table = fs::read_to_string(at.join("out/tables/table-3.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split(',').collect())
        .collect();
    assert_eq!(
        rows[0][..6],
        ["subject", "condition", "run", "nk_ARX", "nk_BJ", "T_n_BJ"]
    );
    assert_eq!(rows.len(), 3, "{table}");
    assert_eq!(rows[1][..3], ["S1", "sudden-roll", "1"]);
    let nk: f64 = rows[1][4].parse().unwrap();
    assert!((27.0..=31.0).contains(&nk), "{table}");
    let page = fs::read_to_string(at.join("out/index.html")).unwrap();
    for name in ["fig-13", "fig-14", "I.10", "I.11", "I.12"] {
        let svg = fs::read_to_string(at.join(format!("out/figures/{name}-sudden-roll.svg"))).unwrap();
        assert!(svg.contains("S1") && svg.contains("S2"), "{name}");
        assert!(page.contains(&format!("figures/{name}-sudden-roll.svg")), "{name}");
    }
    for name in ["I.1", "I.2", "I.3"] {
        assert!(at.join(format!("out/figures/{name}-fixed-roll.svg")).exists(), "{name}");
    }
    assert!(page.contains("run 1 of S2 in fixed-roll: "), "{page}");
    // The lead is larger after the change: T_L is .4 s and then 1.2 s, multiplied by a factor of the person.
    let operators = fs::read_to_string(at.join("out/tables/operators.csv")).unwrap();
    let lead = |span: &str| -> f64 {
        let row = operators
            .lines()
            .find(|line| line.starts_with(&format!("sudden-roll,S1,PEM,{span},")));
        row.unwrap().split(',').nth(7).unwrap().parse().unwrap()
    };
    assert!(lead("last") > 1.5 * lead("first"), "{operators}");
}

#[test]
fn unusable_recordings_are_refused_with_a_remedy() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    for only in [&["reproduce"][..], &["reproduce", "--only", "experiment,fig-3"]] {
        let (code, message) = failure_of(at, &[only, &["--recordings", "recordings", "--out", "out"]].concat());
        assert!(code == 2 && message.contains("--only experiment"), "{message}");
    }
    fs::create_dir(at.join("recordings")).unwrap();
    let (code, message) = failure_of(at, &reproduce_arguments(&["out"]));
    assert!(
        code == 2 && message.contains("group.toml") && message.contains("hoid group init"),
        "{message}"
    );

    fs::write(at.join("recordings/a.csv"), "t,error,u\n0,1,2\n0.01,2,1\n").unwrap();
    let manifest = "name = \"x\"\n[[runs]]\nfile = \"a.csv\"\nsubject = \"a\"\ncondition = \"slow\"\nrun = \"1\"\n";
    fs::write(at.join("recordings/group.toml"), manifest).unwrap();
    let (code, message) = failure_of(at, &reproduce_arguments(&["out"]));
    assert!(code == 1 && message.contains("[conditions.slow]"), "{message}");
    edit_manifest(at, "\"slow\"", "\"C4\"");
    let (code, message) = failure_of(at, &reproduce_arguments(&["out"]));
    assert!(
        code == 1 && message.contains("no column e in ") && message.contains("error"),
        "{message}"
    );
    assert!(!at.join("out").exists());
}
