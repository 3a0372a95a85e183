//! False alarm rate and power of the test of constancy.
//!
//! The clean runs are runs of C1 and C2 (Box-Jenkins and grey box) and of virtual people with every kind of remnant and
//! controlled element (in their true form, one to three runs), `--runs N` of each (default 10). The same runs are then
//! evaluated with a delay that jumps by 1, 5 and 20 samples at 6, 50 and 90 % of a run, and with another operator in
//! the last third.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::{collections::BTreeMap, env};

use hoid_ident::{Estimator, GreyBox, family::FamilyEstimator};
use hoid_model::{
    Channel, Form, Record, Structure, Verdict,
    scenario::{Condition, Scenario},
};
use hoid_sim::{
    RunSeed, Simulator,
    people::{Person, Plant, Population, RemnantKind, Task},
};
use rayon::prelude::*;

/// Delays u by a given number of samples from a share of the record on.
fn delay_output(record: &Record, share: f64, by: usize) -> Record {
    let at = (share * record.len() as f64) as usize;
    let late = |t: usize| record.output()[if t >= at { t.saturating_sub(by) } else { t }];
    with_output(record, (0..record.len()).map(late).collect())
}

fn with_output(record: &Record, output: Vec<f64>) -> Record {
    let e = Channel::new("e", "", record.input().to_vec());
    Record::new(record.sample_time(), e, Channel::new("u", "", output)).unwrap()
}

/// Replaces the last third of a record by the last third of another run.
fn join_records(record: &Record, other: &Record) -> Record {
    let from = 2 * record.len() / 3;
    let of = |a: &[f64], b: &[f64]| [&a[..from], &b[from..]].concat();
    let e = Channel::new("e", "", of(record.input(), other.input()));
    let u = Channel::new("u", "", of(record.output(), other.output()));
    Record::new(record.sample_time(), e, u).unwrap()
}

fn bare(record: &Record) -> Record {
    with_output(record, record.output().to_vec())
}

/// Model, modification of the record, and whether the record was reported as not constant.
type Row = (String, String, Option<bool>);

fn reports_change(verdict: &Verdict) -> bool {
    verdict.findings().iter().any(|f| f.kind == "not-constant")
}

fn rows(what: &str, runs: &[Record], other: &Record, fit: &dyn Fn(&[Record]) -> Option<Verdict>) -> Vec<Row> {
    let middle = runs.len() / 2;
    let with = |change: &dyn Fn(&Record) -> Record| {
        let mut all = runs.to_vec();
        all[middle] = change(&all[middle]);
        fit(&all).map(|verdict| reports_change(&verdict))
    };
    let mut all = vec![(what.to_owned(), "clean".to_owned(), with(&Record::clone))];
    if env::args().any(|a| a == "--clean") {
        return all;
    }
    for by in [1, 5, 20] {
        for share in [0.06, 0.5, 0.9] {
            let name = format!("late by {by} at {:.0} %", 100.0 * share);
            all.push((what.to_owned(), name, with(&|r| delay_output(r, share, by))));
        }
    }
    all.push((
        what.to_owned(),
        "second operator".to_owned(),
        with(&|r| join_records(r, other)),
    ));
    all
}

fn condition_rows(condition: Condition, other: Condition, seed: u64) -> Vec<Row> {
    let run = |condition, replication| {
        let streams = RunSeed {
            seed,
            replication,
            ..RunSeed::default()
        };
        bare(
            &Simulator::new(&Scenario::condition(condition))
                .unwrap()
                .run(streams, false)
                .unwrap(),
        )
    };
    let (record, second) = (run(condition, 1), run(other, 2));
    let orders = Structure::BoxJenkins.operator_orders(29);
    let bj = |records: &[Record]| {
        let fit = Estimator::new(Structure::BoxJenkins, orders).fit(records).ok()?;
        fit.verdict(records, None).ok()
    };
    let grey = |records: &[Record]| GreyBox::new(1..=1).fit(records).ok()?.verdict(records).ok();
    let runs = [record];
    let mut all = rows("text, bj", &runs, &second, &bj);
    all.extend(rows("text, grey box", &runs, &second, &grey));
    all
}

fn person_rows(kind: RemnantKind, plant: Plant, seed: u64) -> Vec<Row> {
    let (population, task) = (Population::default(), Task::default());
    let draw = |form: Option<Form>, number| Person::draw(&population, &task, plant, form, kind, seed, number).unwrap();
    let person = draw(None, 1);
    let form = person.state.operator.form();
    let second = bare(&draw(Some(form), 1_000_001).run(0).unwrap().record);
    let number = 1 + seed % 3;
    let runs: Vec<Record> = (0..number).map(|run| bare(&person.run(run).unwrap().record)).collect();
    let fit = |records: &[Record]| {
        let estimator = FamilyEstimator {
            forms: vec![form],
            ..FamilyEstimator::default()
        };
        Some(estimator.fit(records).ok()?.verdict)
    };
    rows(&format!("{kind}, {number} runs"), &runs, &second, &fit)
}

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let number = |name: &str, default: u64| {
        let at = arguments.iter().position(|a| a == name);
        at.and_then(|at| arguments.get(at + 1)?.parse().ok()).unwrap_or(default)
    };
    let (runs, first) = (number("--runs", 10), number("--seed", 5000));
    let all: Vec<Row> = (first..first + runs)
        .into_par_iter()
        .flat_map_iter(|seed| {
            let mut rows = condition_rows(Condition::C1, Condition::C2, seed);
            rows.extend(condition_rows(Condition::C2, Condition::C1, seed));
            for kind in RemnantKind::ALL {
                for plant in Plant::ALL {
                    rows.extend(person_rows(kind, plant, seed));
                }
            }
            rows
        })
        .collect();
    let mut table: BTreeMap<(String, String), (u32, u32)> = BTreeMap::new();
    for (what, change, told) in all {
        let kinds = [
            what.clone(),
            if what.starts_with("text") {
                what
            } else {
                "people".to_owned()
            },
        ];
        for kind in kinds.iter().take(if kinds[0] == kinds[1] { 1 } else { 2 }) {
            let row = table.entry((change.clone(), kind.clone())).or_default();
            row.0 += u32::from(told == Some(true));
            row.1 += u32::from(told.is_some());
        }
    }
    for ((change, what), (told, of)) in table {
        println!("{change:22} {what:32} {told:5} of {of}");
    }
}
