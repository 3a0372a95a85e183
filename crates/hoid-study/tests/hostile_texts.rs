//! Modified study plans, group manifests and scenarios are either read or rejected with a message that names the file;
//! none of them causes a panic. Accepted data can be read again.
#![allow(clippy::unwrap_used)]

use std::{fs, path::Path};

use hoid_io::parse_any_scenario;
use hoid_study::{Plan, group::Manifest};
use proptest::{collection::vec, prelude::*, sample::Index, test_runner::RngSeed};

const PLAN_TEXT: &str = r#"
name = "short"
title = "A plan"
description = """
Two lines."""
seed = 3
replications = 40
block = 2

[keep]
changes = true
standard_errors = false

[[scenarios]]
name = "all"
condition = ["C1", "C2"]
realisation = "output"
remnant.noise_level = [0.1, 0.2]
remnant.order = 2

[[scenarios]]
condition = "C6"
last.T_L_s = 0.8
schedule.rate_per_s = 100
schedule.midpoint_s = 40.96
tau_e_s = [0.25, 0.31]

[[estimators]]
name = "BJ"
method = "fit"
structure = "bj"
orders.nd = [1, 2]

[[estimators]]
name = "recursion"
method = "physical"
scenarios = ["all"]
orders.nk = 29
memory = 256
start_span_s = [0.0, 30.72]
track_delay_s = [0.2, 0.4]
"#;

const MANIFEST: &str = include_str!("../../../fixtures/group/tracking.toml");

/// Values in wrong places.
const MISPLACED_VALUES: [&str; 30] = [
    "",
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e-320",
    "inf",
    "-inf",
    "nan",
    "true",
    "\"\"",
    "\"C1\"",
    "\"../../etc/passwd\"",
    "\"\\u001b[31m\"",
    "[]",
    "[[]]",
    "[1, 2, 3]",
    "[0.0, 1e300]",
    "[\"C1\", \"C1\"]",
    "{}",
    "{ u = 1 }",
    "9223372036854775807",
    "18446744073709551615",
    "99999999999999999999",
    "1979-05-27",
    "'''",
    "\"\"\"",
    "0x7fffffffffffffff",
    "[[[[[[[[[[[[[[[[[[[[",
    "\"1/0\"",
];
const CHARACTERS: [char; 14] = [
    '[', ']', '{', '}', '"', '\'', '=', '.', ',', '#', '\n', '\0', '\u{1b}', '\u{fffd}',
];

/// A modification of the text.
#[derive(Debug, Clone)]
enum Change {
    Value(Index, Index),
    Grow(Index, usize),
    Remove(Index),
    Repeat(Index, Index),
    Swap(Index, Index),
    Insert(Index, char),
    Cut(Index),
}

fn change() -> impl Strategy<Value = Change> {
    let at = any::<Index>;
    prop_oneof![
        6 => (at(), at()).prop_map(|(line, value)| Change::Value(line, value)),
        1 => (at(), 2..3000_usize).prop_map(|(line, n)| Change::Grow(line, n)),
        2 => at().prop_map(Change::Remove),
        2 => (at(), at()).prop_map(|(line, to)| Change::Repeat(line, to)),
        2 => (at(), at()).prop_map(|(a, b)| Change::Swap(a, b)),
        3 => (at(), proptest::sample::select(&CHARACTERS[..])).prop_map(|(at, c)| Change::Insert(at, c)),
        1 => at().prop_map(Change::Cut),
    ]
}

fn apply_changes(text: &str, by: &[Change]) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for one in by {
        let n = lines.len();
        if n == 0 {
            break;
        }
        match one {
            Change::Value(line, value) => {
                let line = &mut lines[line.index(n)];
                let key = line.split('=').next().unwrap_or_default().to_owned();
                *line = format!("{key}= {}", value.get(&MISPLACED_VALUES));
            }
            // A list of many values multiplies the cells of a plan.
            Change::Grow(line, times) => {
                let line = &mut lines[line.index(n)];
                let key = line.split('=').next().unwrap_or_default().to_owned();
                let values: Vec<String> = (0..*times).map(|k| k.to_string()).collect();
                *line = format!("{key}= [{}]", values.join(", "));
            }
            Change::Remove(line) => {
                lines.remove(line.index(n));
            }
            Change::Repeat(line, to) => {
                let copy = lines[line.index(n)].clone();
                lines.insert(to.index(n), copy);
            }
            Change::Swap(a, b) => lines.swap(a.index(n), b.index(n)),
            Change::Insert(at, character) => {
                let line = &mut lines[at.index(n)];
                let indices: Vec<usize> = line.char_indices().map(|(place, _)| place).collect();
                let place = if indices.is_empty() { 0 } else { *at.get(&indices) };
                line.insert(place, *character);
            }
            Change::Cut(at) => lines.truncate(at.index(n)),
        }
    }
    lines.join("\n")
}

/// Checks that a message names its file, is short, and contains no terminal control characters.
fn check_message(said: &str) -> Result<(), TestCaseError> {
    prop_assert!(said.contains("made-up.toml"), "{}", said);
    prop_assert!(said.chars().count() < 4000, "{} characters", said.len());
    let obeyed = |c: char| c.is_control() && c != '\n';
    prop_assert!(!said.chars().any(obeyed), "{:?}", said);
    Ok(())
}

fn fixture(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/scenario");
    fs::read_to_string(folder.join(name)).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(22), ..ProptestConfig::with_cases(150) })]

    #[test]
    fn damaged_plans_are_errors_or_round_trip(by in vec(change(), 0..5)) {
        match Plan::parse(&apply_changes(PLAN_TEXT, &by), "made-up.toml") {
            Err(error) => check_message(&error.to_string())?,
            Ok(plan) => {
                let again = Plan::parse(plan.text(), "made-up.toml").unwrap();
                prop_assert_eq!(again.hash(), plan.hash());
                prop_assert!(plan.estimate_count() > 0 && plan.estimate_count() <= 10_000_000_000);
            }
        }
    }

    #[test]
    fn damaged_manifests_are_errors_or_round_trip(by in vec(change(), 0..5)) {
        match Manifest::parse(&apply_changes(MANIFEST, &by), "made-up.toml") {
            Err(error) => check_message(&error.to_string())?,
            Ok(manifest) => {
                let text = toml::to_string(&manifest).unwrap();
                prop_assert_eq!(Manifest::parse(&text, "made-up.toml").unwrap(), manifest);
            }
        }
    }

    #[test]
    fn damaged_scenarios_give_readable_errors(of_a_person in any::<bool>(), by in vec(change(), 0..5)) {
        let text = fixture(if of_a_person { "person.toml" } else { "full.toml" });
        if let Err(error) = parse_any_scenario(&apply_changes(&text, &by), "made-up.toml", "made-up") {
            check_message(&error.to_string())?;
        }
    }
}

#[test]
fn unchanged_texts_are_valid() {
    Plan::parse(PLAN_TEXT, "plan.toml").unwrap();
    Manifest::parse(MANIFEST, "group.toml").unwrap();
    for name in ["person.toml", "full.toml"] {
        parse_any_scenario(&fixture(name), name, "made-up").unwrap();
    }
}
