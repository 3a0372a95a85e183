//! Studies as their users run them: the same bytes for any division of the work, resumed after any
//! end, refused when parts do not belong together.
#![allow(clippy::unwrap_used)]

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
};

use hoid_io::{ColumnValues, OutputTable, read_table};
use hoid_model::{Record, scenario::Condition};
use hoid_sim::{RunSeed, Simulator};
use hoid_study::{Plan, RunOptions, Shard, StudyError, merge, run};

const PLAN: &str = r#"
name = "small"
seed = 7
replications = 5
block = 2

[keep]
trace_every = 512

[[scenarios]]
name = "abrupt"
condition = "C4"
remnant.order = [1, 2]
remnant.noise_level = 0.1

[[scenarios]]
name = "silent"
condition = "C1"
remnant.noise_level = 0.0

[[estimators]]
name = "ARX"
method = "fit"
structure = "arx"
orders.nk = [28, 29]
span_s = [0.0, 30.72]

[[estimators]]
name = "RLS"
method = "rls"
scenarios = ["abrupt"]

[[estimators]]
name = "record"
method = "record"
"#;

fn plan() -> Plan {
    Plan::parse(PLAN, "small.toml").unwrap()
}

fn quiet(plan: &Plan, directory: &Path, options: RunOptions) -> Result<bool, StudyError> {
    run(plan, directory, &options, &|_| (), &|| true).map(|outcome| outcome.finished)
}

/// All files of a directory but the manifest, by name.
fn content(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path());
    files
        .filter(|path| path.is_file() && path.extension().is_some_and(|e| e != "json"))
        .map(|path| {
            (
                path.file_name().unwrap().to_string_lossy().into_owned(),
                fs::read(&path).unwrap(),
            )
        })
        .collect()
}

fn whole(jobs: usize) -> (tempfile::TempDir, BTreeMap<String, Vec<u8>>) {
    let directory = tempfile::tempdir().unwrap();
    let options = RunOptions {
        jobs: Some(jobs),
        ..RunOptions::default()
    };
    assert!(quiet(&plan(), directory.path(), options).unwrap());
    let found = content(directory.path());
    (directory, found)
}

#[test]
fn threads_and_shards_do_not_show() {
    let (_one, expected) = whole(1);
    assert_eq!(
        expected.keys().collect::<Vec<_>>(),
        [
            "cells.parquet",
            "fits.parquet",
            "plan.toml",
            "summary.parquet",
            "trace-summary.parquet",
            "traces.parquet"
        ]
    );
    for jobs in [2, 7] {
        assert!(whole(jobs).1 == expected, "{jobs} threads");
    }
    for of in [1, 2, 7] {
        let directory = tempfile::tempdir().unwrap();
        let shards: Vec<PathBuf> = (1..=of)
            .map(|index| {
                let path = directory.path().join(index.to_string());
                let options = RunOptions {
                    shard: Some(Shard { index, of }),
                    ..RunOptions::default()
                };
                assert!(quiet(&plan(), &path, options).unwrap());
                path
            })
            .rev()
            .collect();
        let out = directory.path().join("all");
        merge(&shards, &out, false).unwrap();
        assert!(content(&out) == expected, "{of} shards");
    }
}

#[test]
fn a_stopped_study_goes_on_and_repeats_nothing() {
    let (_whole, expected) = whole(2);
    let directory = tempfile::tempdir().unwrap();
    let plan = plan();
    let options = RunOptions {
        jobs: Some(1),
        resume: true,
        ..RunOptions::default()
    };
    let total = plan.estimates();
    let (mut made, mut sessions) = (0, 0);
    loop {
        sessions += 1;
        // Three replications at a time, each asked for by every estimator: blocks that are not
        // finished are lost.
        let left = AtomicU64::new(3 * plan.estimators.len() as u64);
        let go_on = || {
            left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1))
                .is_ok()
        };
        let known = AtomicU64::new(u64::MAX);
        let outcome = run(
            &plan,
            directory.path(),
            &options,
            &|p| known.store(p.known, Ordering::Relaxed),
            &go_on,
        )
        .unwrap();
        made += outcome.estimates;
        if outcome.finished {
            break;
        }
        // What a killed program leaves behind: a file on its way.
        fs::write(directory.path().join("parts/.tmp123"), b"half").unwrap();
        assert!(sessions < 20, "no end");
    }
    assert!(sessions > 2, "{sessions}");
    assert!(made >= total);
    assert!(content(directory.path()) == expected);
    // A finished study is found finished.
    let outcome = run(&plan, directory.path(), &options, &|_| (), &|| true).unwrap();
    assert_eq!((outcome.finished, outcome.estimates), (true, 0));
}

#[test]
fn parts_that_do_not_belong_together_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    let shard = |index, of| RunOptions {
        shard: Some(Shard { index, of }),
        ..RunOptions::default()
    };
    quiet(&plan(), &at("1"), shard(1, 3)).unwrap();
    quiet(&plan(), &at("2"), shard(2, 3)).unwrap();
    quiet(&plan(), &at("half"), shard(1, 2)).unwrap();
    let other = Plan::parse(&PLAN.replace("seed = 7", "seed = 8"), "other.toml").unwrap();
    quiet(&other, &at("other"), shard(3, 3)).unwrap();
    let fewer = plan().with_replications(4).unwrap();
    quiet(&fewer, &at("fewer"), shard(3, 3)).unwrap();

    let of = |names: &[&str]| merge(&names.iter().map(|n| at(n)).collect::<Vec<_>>(), &at("out"), false).unwrap_err();
    assert!(
        matches!(
            of(&["1", "2"]),
            StudyError::Gap {
                missing: 2,
                first: 2,
                ..
            }
        ),
        "{}",
        of(&["1", "2"])
    );
    assert!(matches!(of(&["1", "2", "half"]), StudyError::Overlap { block: 0, .. }));
    assert!(matches!(of(&["1", "2", "other"]), StudyError::OtherStudy { .. }));
    assert!(matches!(of(&["1", "2", "fewer"]), StudyError::OtherStudy { .. }));
    assert!(matches!(of(&["1", "nothing"]), StudyError::NoStudy { .. }));
    assert!(matches!(of(&[]), StudyError::NoStudy { .. }));
    assert!(!at("out").exists(), "nothing is left of what was refused");

    // A directory is not overwritten, nor continued with something else.
    let again = quiet(&plan(), &at("1"), shard(1, 3)).unwrap_err();
    assert!(matches!(again, StudyError::Occupied { .. }));
    let resume = RunOptions {
        resume: true,
        ..RunOptions::default()
    };
    for (plan, options) in [
        (
            &plan(),
            RunOptions {
                shard: Some(Shard { index: 2, of: 3 }),
                ..resume
            },
        ),
        (&plan(), resume),
        (&other, resume),
    ] {
        let error = quiet(plan, &at("1"), options).unwrap_err();
        assert!(matches!(error, StudyError::OtherStudy { .. }), "{error}");
    }
    assert!("3/2".parse::<Shard>().is_err() && "0/2".parse::<Shard>().is_err() && "x".parse::<Shard>().is_err());
}

fn real(table: &OutputTable, column: &str, row: usize) -> f64 {
    match table.column(column) {
        Some(ColumnValues::Real(values)) => values[row],
        other => panic!("{column}: {other:?}"),
    }
}

fn whole_number(table: &OutputTable, column: &str, row: usize) -> u64 {
    match table.column(column) {
        Some(ColumnValues::Whole(values)) => values[row],
        other => panic!("{column}: {other:?}"),
    }
}

fn text<'a>(table: &'a OutputTable, column: &str, row: usize) -> &'a str {
    match table.column(column) {
        Some(ColumnValues::Text(values)) => &values[row],
        other => panic!("{column}: {other:?}"),
    }
}

/// A row is what simulating and fitting that run by itself gives, to the last bit.
#[test]
fn a_row_is_the_run_by_itself() {
    let (directory, _) = whole(2);
    let fits = read_table(&directory.path().join("fits.parquet")).unwrap();
    let rows = fits.columns[0].values.len();
    // 5 replications in two cells by 4 estimators, one in the silent cell by 3.
    assert_eq!(rows, 2 * 5 * 4 + 3);
    let row = (0..rows)
        .find(|r| {
            whole_number(&fits, "cell", *r) == 1
                && whole_number(&fits, "replication", *r) == 4
                && text(&fits, "estimator", *r) == "ARX nk=29"
        })
        .unwrap();
    let mut scenario = hoid_model::scenario::Scenario::condition(Condition::C4);
    scenario.remnant.order = 2;
    scenario.remnant.strength = hoid_model::scenario::RemnantStrength::Level {
        level: 0.1,
        definition: hoid_model::remnant_gain::NoiseDefinition::Response,
    };
    let run_seed = RunSeed {
        seed: 7,
        cell: 1,
        replication: 4,
    };
    let record: Record = Simulator::new(&scenario).unwrap().run(run_seed, false).unwrap();
    let structure = hoid_model::Structure::Arx;
    let fit = hoid_ident::Estimator::new(structure, structure.operator_orders(29))
        .fit(&[record.span(0.0, 30.72).unwrap()])
        .unwrap();
    for (name, estimate) in fit.parameters() {
        assert_eq!(real(&fits, &name, row), estimate.value, "{name}");
        assert_eq!(
            real(&fits, &format!("{name}_se"), row),
            estimate.standard_error.unwrap(),
            "{name}"
        );
    }
    assert_eq!(real(&fits, "K_e", row), fit.operator().unwrap().k_e.value);
    // In the silent cell ARX is exact.
    let silent = (0..rows)
        .find(|r| whole_number(&fits, "cell", *r) == 2 && real(&fits, "nk", *r) == 29.0)
        .unwrap();
    assert!(real(&fits, "response_error", silent) < 1e-6);
}

/// A failed estimate is a row with its reason.
#[test]
fn failures_are_rows() {
    // The loop with a gain far beyond the gain margin diverges in every run.
    let text_of = PLAN.replace(
        "name = \"silent\"\ncondition = \"C1\"",
        "name = \"silent\"\ncondition = \"C1\"\ninitial.K_c = 90000.0",
    );
    let text_of = text_of.replace("remnant.noise_level = 0.0", "remnant.K_n_initial_deg = 0.1");
    let plan = Plan::parse(&text_of, "unstable.toml").unwrap();
    let directory = tempfile::tempdir().unwrap();
    assert!(quiet(&plan, directory.path(), RunOptions::default()).unwrap());
    let fits = read_table(&directory.path().join("fits.parquet")).unwrap();
    let failed: Vec<usize> = (0..fits.columns[0].values.len())
        .filter(|r| text(&fits, "scenario", *r) == "silent")
        .collect();
    assert_eq!(failed.len(), 5 * 3);
    for row in failed {
        assert_eq!(text(&fits, "status", row), "failed");
        assert!(
            text(&fits, "reason", row).contains("diverges"),
            "{}",
            text(&fits, "reason", row)
        );
    }
}
