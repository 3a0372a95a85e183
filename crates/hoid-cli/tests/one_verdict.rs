//! The same recordings have the same verdict in all commands that identify them.
#![allow(clippy::unwrap_used)]

mod common;

use std::{collections::BTreeSet, fs, path::Path};

use serde_json::Value;
use tempfile::TempDir;

use common::{json_with_any_exit_code, stdout_of};

const ELEMENT: &str = "90/(s(s+6))";
const ROW_COUNT: usize = 4096;

type Rows = Vec<[f64; 2]>;
/// Name of a fault, and the function that adds it to a recording.
type Corruption = (&'static str, fn(&mut Rows));

/// Faults of both runs of a person.
const CORRUPTIONS: [Corruption; 9] = [
    ("clean", |_| ()),
    ("clipped", |rows| {
        rows.iter_mut().for_each(|row| row[1] = row[1].clamp(-0.086, 0.086))
    }),
    ("coarse", |rows| {
        rows.iter_mut().for_each(|row| row[1] = (row[1] / 0.02).round() * 0.02)
    }),
    ("frozen", |rows| {
        let e = rows[1000][0];
        rows[1000..1300].iter_mut().for_each(|row| row[0] = e);
    }),
    ("held", |rows| {
        let u = rows[2000][1];
        rows[2000..2006].iter_mut().for_each(|row| row[1] = u);
    }),
    ("spikes", |rows| {
        rows[700][1] = 4.0;
        rows[3001][0] = -30.0;
    }),
    ("reversed", |rows| rows.iter_mut().for_each(|row| row[0] = -row[0])),
    ("late", |rows| {
        for k in (20..ROW_COUNT).rev() {
            rows[k][1] = rows[k - 20][1];
        }
    }),
    ("stepped", |rows| rows[2500..].iter_mut().for_each(|row| row[1] += 0.3)),
];

fn simulated_rows(at: &Path, seed: usize) -> Rows {
    let seed = seed.to_string();
    stdout_of(
        at,
        &["simulate", "--condition", "C1", "--seed", &seed, "--out", "run.csv"],
    );
    let text = fs::read_to_string(at.join("run.csv")).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let columns = ["e", "u"].map(|name| names.iter().position(|n| *n == name).unwrap());
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        columns.map(|c| cells[c].parse().unwrap())
    };
    lines.take(ROW_COUNT).map(row).collect()
}

/// Writes two runs of each person as files of a group.
fn write_people(at: &Path) {
    let runs = [simulated_rows(at, 1), simulated_rows(at, 2)];
    fs::create_dir(at.join("people")).unwrap();
    for (name, spoil) in CORRUPTIONS {
        for (k, run) in runs.iter().enumerate() {
            let mut rows = run.clone();
            spoil(&mut rows);
            let lines = rows
                .iter()
                .enumerate()
                .map(|(k, [e, u])| format!("{},{e},{u}\n", k as f64 / 100.0));
            let text = "t,e,u\n".to_owned() + &lines.collect::<String>();
            fs::write(at.join(format!("people/{name}_C1_{}.csv", k + 1)), text).unwrap();
        }
    }
}

/// Returns a verdict without the messages that name an option or a key of the manifest.
fn without_remedies(verdict: &Value) -> Value {
    let mut verdict = verdict.clone();
    let strip = |list: &mut Value| {
        for finding in list.as_array_mut().unwrap() {
            let message = finding["message"].as_str().unwrap();
            let keys = ["--", "read.", "prepare.", "analysis.", "conditions."];
            if keys.iter().any(|key| message.contains(key)) {
                finding["message"] = Value::Null;
            }
        }
    };
    ["reasons", "notes", "findings"]
        .iter()
        .for_each(|list| strip(&mut verdict[list]));
    let of = verdict["of"].as_object_mut().unwrap();
    of.values_mut().for_each(|answer| strip(&mut answer["reasons"]));
    verdict
}

/// Returns the keys of the manifest with values that a message names, such as `analysis.form = "lead"`.
fn named_keys(message: &str) -> Vec<(Vec<String>, toml::Value)> {
    let of = |start: &'static str| {
        message.match_indices(start).filter_map(|(at, _)| {
            let (key, rest) = message[at..].split_once(" = ").filter(|(key, _)| !key.contains(' '))?;
            let ends = rest.char_indices().map(|(end, c)| end + c.len_utf8());
            let value = ends
                .rev()
                .find_map(|end| format!("v = {}", &rest[..end]).parse::<toml::Table>().ok())?;
            Some((key.split('.').map(str::to_owned).collect(), value["v"].clone()))
        })
    };
    ["read.", "prepare.", "analysis.", "conditions."]
        .into_iter()
        .flat_map(of)
        .collect()
}

/// Checks that each message names only what the user of a group can write, and writes the named keys to the manifest.
fn check_remedies(messages: &BTreeSet<String>, manifest: &mut toml::Table) -> usize {
    let mut written = 0;
    for message in messages {
        for (at, _) in message.match_indices("--") {
            let clause = message[..at].rsplit([';', '(', ':']).next().unwrap();
            assert!(clause.contains("hoid "), "{message}");
        }
        for (mut path, value) in named_keys(message) {
            let last = path.pop().unwrap();
            let mut table = &mut *manifest;
            for name in path {
                let entry = table
                    .entry(name)
                    .or_insert_with(|| toml::Value::Table(toml::Table::new()));
                table = entry.as_table_mut().unwrap();
            }
            table.insert(last, value);
            written += 1;
        }
    }
    written
}

#[test]
fn remedies_of_a_group_are_keys_of_its_manifest() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    fs::create_dir(at.join("people")).unwrap();
    // A person who also responds to the displayed target.
    for run in ["1", "2"] {
        let file = format!("people/P01_C1_{run}.csv");
        let seen = ["--feedforward", "derivative:0.1,tau_f=0.2"];
        stdout_of(
            at,
            &[
                &["simulate", "--condition", "C1", "--seed", run, "--out", &file][..],
                &seen,
            ]
            .concat(),
        );
    }
    stdout_of(
        at,
        &[
            "group",
            "init",
            "people",
            "--controlled-element",
            ELEMENT,
            "--excitation",
            "f_t",
        ],
    );
    let run = |out: &str| json_with_any_exit_code(at, &["group", "people", "--out", out, "--json"]);
    let found = run("out");
    let verdict = &found["people"][0]["verdict"];
    let mut messages = BTreeSet::new();
    for list in ["reasons", "notes"] {
        let all = verdict[list].as_array().unwrap();
        messages.extend(all.iter().map(|one| one["message"].as_str().unwrap().to_owned()));
    }
    let file = at.join("people/group.toml");
    let mut manifest: toml::Table = fs::read_to_string(&file).unwrap().parse().unwrap();
    assert!(check_remedies(&messages, &mut manifest) > 0, "{messages:?}");
    fs::write(&file, manifest.to_string()).unwrap();
    let again = run("again");
    assert_eq!(
        again["people"][0]["channels"][0]["input"], "f_t",
        "{messages:?}: {again}"
    );
}

#[test]
fn group_findings_match_identify_word_for_word() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    write_people(at);
    stdout_of(at, &["group", "init", "people", "--controlled-element", ELEMENT]);
    let found = json_with_any_exit_code(at, &["group", "people", "--out", "out", "--json"]);
    let all = found["people"].as_array().unwrap();
    assert_eq!(all.len(), CORRUPTIONS.len());
    let mut seen = BTreeSet::new();
    for (name, _) in CORRUPTIONS {
        let person = all.iter().find(|one| one["subject"] == name).unwrap();
        let [one, two] = [1, 2].map(|run| format!("{name}_C1_{run}.csv"));
        let arguments = ["identify", &one, &two, "--controlled-element", ELEMENT, "--json"];
        let alone = json_with_any_exit_code(&at.join("people"), &arguments);
        let verdict = &alone["verdict"];
        assert_eq!(
            without_remedies(&person["verdict"]),
            without_remedies(verdict),
            "{name}"
        );
        for parameter in alone["parameters"].as_array().unwrap() {
            let there = &person["parameters"][parameter["name"].as_str().unwrap()];
            for key in ["value", "standard_error", "interval"] {
                assert_eq!(there[key], parameter[key], "{name}: {}", parameter["name"]);
            }
        }
        let kinds = verdict["findings"].as_array().unwrap().iter();
        seen.extend(kinds.map(|finding| finding["kind"].as_str().unwrap().to_owned()));
    }
    // This checks that the recordings have the faults.
    for kind in ["stick-at-its-end", "coarse", "faults"] {
        assert!(seen.contains(kind), "{kind}: {seen:?}");
    }
    let clipped = all.iter().find(|one| one["subject"] == "clipped").unwrap();
    assert_eq!(clipped["verdict"]["level"], "doubtful");
}

#[test]
fn duplicated_run_is_refused_by_both_commands() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    write_people(at);
    let inside = at.join("people");
    for file in fs::read_dir(&inside).unwrap().map(|entry| entry.unwrap().path()) {
        if !file.ends_with("clean_C1_1.csv") {
            fs::remove_file(file).unwrap();
        }
    }
    fs::copy(inside.join("clean_C1_1.csv"), inside.join("clean_C1_2.csv")).unwrap();
    stdout_of(at, &["group", "init", "people"]);
    let found = json_with_any_exit_code(at, &["group", "people", "--out", "out", "--json"]);
    let alone = common::hoid(&inside, &["identify", "clean_C1_1.csv", "clean_C1_2.csv"]);
    assert_eq!(alone.status.code(), Some(2));
    let stderr = String::from_utf8(alone.stderr).unwrap();
    let reason = found["people"][0]["reason"].as_str().unwrap();
    assert!(
        reason.contains("hold the same samples") && stderr.contains(reason),
        "{reason}\n{stderr}"
    );
}
