//! Studies as a whole: they give the same bytes for any division of the work, can be resumed after any interruption,
//! and are rejected if parts do not belong together.
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

const PLAN_TEXT: &str = r#"
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
    Plan::parse(PLAN_TEXT, "small.toml").unwrap()
}

fn run_quietly(plan: &Plan, directory: &Path, options: RunOptions) -> Result<bool, StudyError> {
    run(plan, directory, &options, &|_| (), &|| true).map(|outcome| outcome.finished)
}

/// Returns the contents of all files of a directory except the manifest, by name.
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

fn run_whole(plan: &Plan, jobs: usize) -> (tempfile::TempDir, BTreeMap<String, Vec<u8>>) {
    let directory = tempfile::tempdir().unwrap();
    let options = RunOptions {
        jobs: Some(jobs),
        ..RunOptions::default()
    };
    assert!(run_quietly(plan, directory.path(), options).unwrap());
    let found = content(directory.path());
    (directory, found)
}

fn whole(jobs: usize) -> (tempfile::TempDir, BTreeMap<String, Vec<u8>>) {
    run_whole(&plan(), jobs)
}

/// Checks that the bytes are the same for any number of threads and shards.
fn assert_independent_of_division(plan: &Plan, threads: &[usize], shards: &[u64]) -> BTreeMap<String, Vec<u8>> {
    let (_one, expected) = run_whole(plan, 1);
    for &jobs in threads {
        assert!(run_whole(plan, jobs).1 == expected, "{jobs} threads");
    }
    for &of in shards {
        let directory = tempfile::tempdir().unwrap();
        let shards: Vec<PathBuf> = (1..=of)
            .map(|index| {
                let path = directory.path().join(index.to_string());
                let options = RunOptions {
                    shard: Some(Shard { index, of }),
                    ..RunOptions::default()
                };
                assert!(run_quietly(plan, &path, options).unwrap());
                path
            })
            .rev()
            .collect();
        let out = directory.path().join("all");
        merge(&shards, &out, false).unwrap();
        assert!(content(&out) == expected, "{of} shards");
    }
    expected
}

#[test]
fn results_do_not_depend_on_threads_or_shards() {
    let expected = assert_independent_of_division(&plan(), &[2, 7], &[1, 2, 7]);
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
}

#[test]
fn verdicts_do_not_depend_on_threads_or_shards() {
    let text = r#"
name = "verdicts"
seed = 7
replications = 3
block = 1

[[scenarios]]
condition = "C4"
remnant.noise_level = 0.1

[[estimators]]
name = "operator"
method = "operator"

[[estimators]]
name = "change"
method = "time-varying"

[[estimators]]
name = "SRIV"
method = "sriv"
"#;
    assert_independent_of_division(&Plan::parse(text, "verdicts.toml").unwrap(), &[3], &[2]);
}

#[test]
fn stopped_study_resumes_without_repetition() {
    let (_whole, expected) = whole(2);
    let directory = tempfile::tempdir().unwrap();
    let plan = plan();
    let options = RunOptions {
        jobs: Some(1),
        resume: true,
        ..RunOptions::default()
    };
    let total = plan.estimate_count();
    let (mut made, mut sessions) = (0, 0);
    loop {
        sessions += 1;
        // Each session stops after three replications of all estimators; unfinished blocks are lost.
        let left = AtomicU64::new(3 * plan.estimators.len() as u64);
        let should_continue = || {
            left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1))
                .is_ok()
        };
        let known = AtomicU64::new(u64::MAX);
        let outcome = run(
            &plan,
            directory.path(),
            &options,
            &|p| known.store(p.done_earlier, Ordering::Relaxed),
            &should_continue,
        )
        .unwrap();
        made += outcome.estimates;
        if outcome.finished {
            break;
        }
        // A killed program may leave a partial file.
        fs::write(directory.path().join("parts/.tmp123"), b"half").unwrap();
        assert!(sessions < 20, "no end");
    }
    assert!(sessions > 2, "{sessions}");
    assert!(made >= total);
    assert!(content(directory.path()) == expected);
    // A finished study is recognised as finished.
    let outcome = run(&plan, directory.path(), &options, &|_| (), &|| true).unwrap();
    assert_eq!((outcome.finished, outcome.estimates), (true, 0));
}

#[test]
fn incompatible_shards_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    let shard = |index, of| RunOptions {
        shard: Some(Shard { index, of }),
        ..RunOptions::default()
    };
    run_quietly(&plan(), &at("1"), shard(1, 3)).unwrap();
    run_quietly(&plan(), &at("2"), shard(2, 3)).unwrap();
    run_quietly(&plan(), &at("half"), shard(1, 2)).unwrap();
    let other = Plan::parse(&PLAN_TEXT.replace("seed = 7", "seed = 8"), "other.toml").unwrap();
    run_quietly(&other, &at("other"), shard(3, 3)).unwrap();
    let fewer = plan().with_replications(4).unwrap();
    run_quietly(&fewer, &at("fewer"), shard(3, 3)).unwrap();

    let of = |names: &[&str]| merge(&names.iter().map(|n| at(n)).collect::<Vec<_>>(), &at("out"), false).unwrap_err();
    assert!(
        matches!(
            of(&["1", "2"]),
            StudyError::MissingBlocks {
                missing: 2,
                first: 2,
                ..
            }
        ),
        "{}",
        of(&["1", "2"])
    );
    assert!(matches!(
        of(&["1", "2", "half"]),
        StudyError::DuplicateBlock { block: 0, .. }
    ));
    assert!(matches!(of(&["1", "2", "other"]), StudyError::OtherStudy { .. }));
    assert!(matches!(of(&["1", "2", "fewer"]), StudyError::OtherStudy { .. }));
    assert!(matches!(of(&["1", "nothing"]), StudyError::NoStudy { .. }));
    assert!(matches!(of(&[]), StudyError::NoStudy { .. }));
    assert!(!at("out").exists(), "nothing is left of what was refused");

    // A directory is neither overwritten nor continued with a different study.
    let again = run_quietly(&plan(), &at("1"), shard(1, 3)).unwrap_err();
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
        let error = run_quietly(plan, &at("1"), options).unwrap_err();
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

/// A row is bit-identical to the result of simulating and fitting that run separately.
#[test]
fn rows_match_separate_simulation_and_fit() {
    let (directory, _) = whole(2);
    let fits = read_table(&directory.path().join("fits.parquet")).unwrap();
    let rows = fits.columns[0].values.len();
    // There are 5 replications in two cells with 4 estimators, and one replication in the cell without remnant with 3
    // estimators.
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
    // In the cell without remnant ARX is exact.
    let silent = (0..rows)
        .find(|r| whole_number(&fits, "cell", *r) == 2 && real(&fits, "nk", *r) == 29.0)
        .unwrap();
    assert!(real(&fits, "response_error", silent) < 1e-6);
}

/// A failed estimate is a row with its reason.
#[test]
fn failed_estimates_are_rows_with_a_reason() {
    // With a gain far above the gain margin, the loop diverges in every run.
    let text_of = PLAN_TEXT.replace(
        "name = \"silent\"\ncondition = \"C1\"",
        "name = \"silent\"\ncondition = \"C1\"\ninitial.K_c = 90000.0",
    );
    let text_of = text_of.replace("remnant.noise_level = 0.0", "remnant.K_n_initial_deg = 0.1");
    let plan = Plan::parse(&text_of, "unstable.toml").unwrap();
    let directory = tempfile::tempdir().unwrap();
    assert!(run_quietly(&plan, directory.path(), RunOptions::default()).unwrap());
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

/// Writes a study that was stopped after some of its blocks.
fn write_stopped_study(directory: &Path) {
    let left = AtomicU64::new(40);
    let should_continue = || {
        left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1))
            .is_ok()
    };
    let options = RunOptions {
        jobs: Some(1),
        ..RunOptions::default()
    };
    assert!(
        !run(&plan(), directory, &options, &|_| (), &should_continue)
            .unwrap()
            .finished
    );
}

fn part_paths(directory: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(directory.join("parts")).unwrap();
    let mut all: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    all.sort();
    all
}

#[test]
fn damaged_blocks_are_recomputed() {
    let out = tempfile::tempdir().unwrap();
    let (whole, again) = (out.path().join("whole"), out.path().join("again"));
    run_quietly(&plan(), &whole, RunOptions::default()).unwrap();
    let resumed = RunOptions {
        resume: true,
        ..RunOptions::default()
    };
    let damages: [&dyn Fn(&Path); 4] = [
        // A single bit is flipped.
        &|path| {
            let mut bytes = fs::read(path).unwrap();
            let middle = bytes.len() / 2;
            bytes[middle] ^= 4;
            fs::write(path, bytes).unwrap();
        },
        // The file is truncated.
        &|path| {
            let bytes = fs::read(path).unwrap();
            fs::write(path, &bytes[..bytes.len() / 2]).unwrap();
        },
        &|path| fs::write(path, "").unwrap(),
        &|path| fs::remove_file(path).unwrap(),
    ];
    for (kind, damage) in damages.iter().enumerate() {
        let _ = fs::remove_dir_all(&again);
        write_stopped_study(&again);
        let fits = part_paths(&again)
            .into_iter()
            .find(|path| path.to_string_lossy().contains("fits"))
            .unwrap();
        damage(&fits);
        let outcome = run(&plan(), &again, &resumed, &|_| (), &|| true).unwrap();
        assert!(outcome.finished);
        assert_eq!(outcome.notes.len(), 1, "{kind}: {:?}", outcome.notes);
        assert!(outcome.notes[0].contains("was recomputed"), "{:?}", outcome.notes);
        assert!(content(&whole) == content(&again), "{kind}");
    }
    // Block 1 is replaced by block 0, including its seal.
    fs::remove_dir_all(&again).unwrap();
    write_stopped_study(&again);
    for path in part_paths(&again) {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if let Some(rest) = name.strip_prefix("000000") {
            fs::copy(&path, path.with_file_name(format!("000001{rest}"))).unwrap();
        }
    }
    let outcome = run(&plan(), &again, &resumed, &|_| (), &|| true).unwrap();
    assert!(
        outcome.notes[0].contains("block 1 is damaged (it is block 0)"),
        "{:?}",
        outcome.notes
    );
    assert!(content(&whole) == content(&again));
}

#[test]
fn merge_recomputes_damaged_blocks() {
    let out = tempfile::tempdir().unwrap();
    let place = |name: &str| out.path().join(name);
    run_quietly(&plan(), &place("whole"), RunOptions::default()).unwrap();
    for index in [1, 2] {
        let options = RunOptions {
            shard: Some(Shard { index, of: 2 }),
            ..RunOptions::default()
        };
        run_quietly(&plan(), &place(&format!("s{index}")), options).unwrap();
    }
    let fits = part_paths(&place("s2"))
        .into_iter()
        .find(|path| path.to_string_lossy().contains("fits"))
        .unwrap();
    let mut bytes = fs::read(&fits).unwrap();
    bytes[40] ^= 1;
    fs::write(&fits, bytes).unwrap();
    let shards = [place("s1"), place("s2")];
    let outcome = merge(&shards, &place("merged"), false).unwrap();
    assert_eq!(outcome.notes.len(), 1, "{:?}", outcome.notes);
    assert!(content(&place("whole")) == content(&place("merged")));
    assert!(!place("merged").join("parts").exists());
}

#[test]
fn unsealed_blocks_are_recomputed_or_refused() {
    let out = tempfile::tempdir().unwrap();
    let (whole, old) = (out.path().join("whole"), out.path().join("old"));
    run_quietly(&plan(), &whole, RunOptions::default()).unwrap();
    write_stopped_study(&old);
    for seal in part_paths(&old)
        .iter()
        .filter(|path| path.extension().is_some_and(|e| e == "json"))
    {
        fs::remove_file(seal).unwrap();
    }
    let record = fs::read_to_string(old.join("study.json")).unwrap();
    let unsealed = record.replace(",\n  \"sealed\": true", "");
    assert_ne!(record, unsealed);
    fs::write(old.join("study.json"), unsealed).unwrap();
    let refused = merge(std::slice::from_ref(&old), &out.path().join("merged"), false).unwrap_err();
    assert!(matches!(refused, StudyError::Unsealed { .. }), "{refused}");
    let resumed = RunOptions {
        resume: true,
        ..RunOptions::default()
    };
    let outcome = run(&plan(), &old, &resumed, &|_| (), &|| true).unwrap();
    assert!(outcome.notes[0].contains("had no checksums"), "{:?}", outcome.notes);
    assert!(content(&whole) == content(&old));
}

#[test]
fn directory_is_locked_and_plans_are_not_overwritten() {
    let out = tempfile::tempdir().unwrap();
    let directory = out.path().join("study");
    let second = std::sync::Mutex::new(None);
    let should_continue = || {
        let mut second = second.lock().unwrap();
        if second.is_none() {
            *second = Some(run_quietly(
                &plan(),
                &directory,
                RunOptions {
                    resume: true,
                    ..RunOptions::default()
                },
            ));
        }
        true
    };
    assert!(
        run(&plan(), &directory, &RunOptions::default(), &|_| (), &should_continue)
            .unwrap()
            .finished
    );
    let message = second.into_inner().unwrap().unwrap().unwrap_err().to_string();
    assert!(message.contains("another process is using"), "{message}");

    let own = out.path().join("own");
    fs::create_dir(&own).unwrap();
    fs::write(own.join("plan.toml"), "# mine\n").unwrap();
    let error = run_quietly(&plan(), &own, RunOptions::default()).unwrap_err();
    assert!(matches!(error, StudyError::SourceExists { .. }), "{error}");
    assert_eq!(fs::read_to_string(own.join("plan.toml")).unwrap(), "# mine\n");
}
