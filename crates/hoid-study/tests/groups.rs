//! Groups of recorded runs as their users analyse them, on simulated people.
#![allow(clippy::unwrap_used)]

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    sync::atomic::{AtomicU64, Ordering},
};

use hoid_io::{ColumnValues, OutputTable, read_table, write_record};
use hoid_model::scenario::{Condition, Scenario};
use hoid_sim::{Simulator, Stream};
use hoid_study::{
    RunOptions, StudyError,
    group::{Manifest, Pattern, Trouble, VirtualExperiment, run_group, simulate_group},
};

/// Two subjects with different gains, two conditions, two runs each.
fn recorded() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    for (subject, gain) in [("A", 1.0), ("B", 1.2)] {
        for (cell, condition) in [Condition::C1, Condition::C4].into_iter().enumerate() {
            let mut scenario = Scenario::condition(condition);
            for state in [&mut scenario.initial, &mut scenario.last] {
                state.operator.k_e *= gain;
            }
            let simulator = Simulator::new(&scenario).unwrap();
            for run in 1..=2 {
                let stream = Stream {
                    seed: if subject == "A" { 1 } else { 2 },
                    cell: cell as u64,
                    replication: run,
                };
                let record = simulator.run(stream, false).unwrap();
                let name = format!("{subject}_{condition}_{run}.csv");
                write_record(&directory.path().join(name), &record).unwrap();
            }
        }
    }
    fs::write(directory.path().join("notes.txt"), "nothing").unwrap();
    directory
}

fn manifest(directory: &Path) -> Manifest {
    let pattern = Pattern::new("{subject}_{condition}_{run}.csv").unwrap();
    let (mut manifest, others) = Manifest::of_directory(directory, &pattern).unwrap();
    assert_eq!((manifest.runs.len(), others.len()), (8, 1));
    manifest.analysis.delay_s = (0.25, 0.32);
    // What was written is what is read.
    assert_eq!(Manifest::parse(&manifest.text(), "group.toml").unwrap(), manifest);
    manifest
}

fn content(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path());
    files
        .filter(|path| path.is_file())
        .map(|path| {
            (
                path.file_name().unwrap().to_string_lossy().into_owned(),
                fs::read(&path).unwrap(),
            )
        })
        .collect()
}

fn texts<'a>(table: &'a OutputTable, name: &str) -> &'a [String] {
    match table.column(name) {
        Some(ColumnValues::Text(values)) => values,
        other => panic!("{name}: {other:?}"),
    }
}

fn reals<'a>(table: &'a OutputTable, name: &str) -> &'a [f64] {
    match table.column(name) {
        Some(ColumnValues::Real(values)) => values,
        other => panic!("{name}: {other:?}"),
    }
}

#[test]
fn a_group_gives_its_people_back_and_goes_on_when_it_was_stopped() {
    let data = recorded();
    let manifest = manifest(data.path());
    let out = tempfile::tempdir().unwrap();
    let (whole, pieces) = (out.path().join("whole"), out.path().join("pieces"));
    let options = |jobs, resume| RunOptions {
        jobs: Some(jobs),
        resume,
        ..RunOptions::default()
    };
    let outcome = run_group(&manifest, data.path(), &whole, &options(2, false), &|_| (), &|| true).unwrap();
    assert!(outcome.finished && outcome.estimates == 8);
    // Three runs at a time on one thread: the same bytes.
    for _ in 0..4 {
        let left = AtomicU64::new(3);
        let go_on = || {
            left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1))
                .is_ok()
        };
        run_group(&manifest, data.path(), &pieces, &options(1, true), &|_| (), &go_on).unwrap();
    }
    assert!(content(&whole) == content(&pieces));

    // Delay and gain of each person: nk = 29, K_e = 0.09 and 0.108 in C1 within four standard errors of the mean of two runs.
    let delays = read_table(&whole.join("delays.parquet")).unwrap();
    for nk in reals(&delays, "BJ_nk") {
        assert!((nk - 29.0).abs() <= 1.0, "{nk}");
    }
    let estimates = read_table(&whole.join("estimates.parquet")).unwrap();
    let [subject, condition, window, estimator, parameter] =
        ["subject", "condition", "window", "estimator", "parameter"].map(|name| texts(&estimates, name));
    let (values, errors) = (reals(&estimates, "value"), reals(&estimates, "standard_error"));
    for (who, k_e) in [("A", 0.09), ("B", 0.108)] {
        let rows: Vec<usize> = (0..values.len())
            .filter(|i| {
                [
                    &subject[*i],
                    &condition[*i],
                    &window[*i],
                    &estimator[*i],
                    &parameter[*i],
                ] == [who, "C1", "whole", "BJ", "K_e"]
            })
            .collect();
        assert_eq!(rows.len(), 2);
        let mean = rows.iter().map(|i| values[*i]).sum::<f64>() / 2.0;
        let error = rows.iter().map(|i| errors[*i].powi(2)).sum::<f64>().sqrt() / 2.0;
        assert!((mean - k_e).abs() < 4.0 * error, "{who}: {mean} +- {error}");
    }
    // The change of C4 shows in the sub-batches.
    let averages = read_table(&whole.join("averages.parquet")).unwrap();
    let of = |when: &str| {
        let row = (0..texts(&averages, "subject").len())
            .find(|i| {
                ["subject", "condition", "window", "estimator", "parameter"].map(|n| texts(&averages, n)[*i].as_str())
                    == ["A", "C4", when, "BJ", "K_e_dot"]
            })
            .unwrap();
        reals(&averages, "mean")[row]
    };
    assert!(
        (of("first") - 0.036).abs() < 0.006 && (of("last") - 0.084).abs() < 0.012,
        "{} {}",
        of("first"),
        of("last")
    );

    // Other data under the same manifest are another group.
    let file = data.path().join("A_C1_1.csv");
    fs::write(&file, fs::read_to_string(&file).unwrap().replacen('1', "2", 1)).unwrap();
    let error = run_group(&manifest, data.path(), &whole, &options(1, true), &|_| (), &|| true).unwrap_err();
    assert!(matches!(error, StudyError::OtherStudy { .. }), "{error}");
}

#[test]
fn a_bad_file_is_a_row_and_a_bad_manifest_an_error() {
    let data = recorded();
    let mut manifest = manifest(data.path());
    manifest.runs.truncate(2);
    manifest.analysis.methods.clear();
    fs::write(data.path().join("A_C1_1.csv"), "t,e,u\n0.0,1.0,x\n").unwrap();
    let out = tempfile::tempdir().unwrap();
    run_group(
        &manifest,
        data.path(),
        &out.path().join("g"),
        &RunOptions::default(),
        &|_| (),
        &|| true,
    )
    .unwrap();
    let estimates = read_table(&out.path().join("g/estimates.parquet")).unwrap();
    assert_eq!(texts(&estimates, "status")[0], "failed");
    assert!(texts(&estimates, "reason")[0].contains("A_C1_1.csv"));
    assert!(texts(&estimates, "run").iter().any(|run| run == "2"));

    let text = manifest.text();
    for (from, to, words) in [
        ("run = \"2\"", "run = \"1\"", "there twice"),
        ("subject = \"A\"", "subject = \"\"", "no subject"),
        ("trace_every = 16", "trace_every = 0", "trace_every is 0"),
        ("trace_every = 16", "trace_evry = 16", "unknown field"),
        (
            "grey_box = false",
            "grey_box = false\n[conditions.C9]",
            "no run has this condition",
        ),
    ] {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text, "{from}");
        let error = Manifest::parse(&changed, "group.toml").unwrap_err().to_string();
        assert!(error.contains("group.toml") && error.contains(words), "{error}");
    }
    let empty = tempfile::tempdir().unwrap();
    let pattern = Pattern::new("{run}.csv").unwrap();
    assert!(matches!(
        Manifest::of_directory(empty.path(), &pattern),
        Err(StudyError::NoRuns { .. })
    ));
}

#[test]
fn a_virtual_experiment_has_its_truth_beside_it() {
    let experiment = VirtualExperiment {
        subjects: 2,
        conditions: vec![Condition::C1],
        runs: 2,
        between_subjects: 0.1,
        between_runs: 0.02,
        remnant_order: 1,
        noise_level: 0.05,
        seed: 4,
        trouble: Vec::new(),
    };
    let directory = tempfile::tempdir().unwrap();
    let (plain, again) = (directory.path().join("plain"), directory.path().join("again"));
    let mut manifest = simulate_group(&experiment, &plain, &|| ()).unwrap();
    simulate_group(&experiment, &again, &|| ()).unwrap();
    assert!(content(&plain) == content(&again), "the same seed, the same bytes");
    assert_eq!(Manifest::read(&plain.join("group.toml")).unwrap(), manifest);

    // Estimates lie around the truth of each run: all of sixteen within five standard errors, in mean within 4/sqrt(16).
    manifest.analysis.methods.clear();
    manifest.analysis.delay_s = (0.2, 0.36);
    let out = directory.path().join("out");
    run_group(&manifest, &plain, &out, &RunOptions::default(), &|_| (), &|| true).unwrap();
    let estimates = read_table(&out.join("estimates.parquet")).unwrap();
    let truth = read_table(&plain.join("truth.csv")).unwrap();
    let mut z = Vec::new();
    for i in 0..reals(&estimates, "value").len() {
        let name = &texts(&estimates, "parameter")[i];
        if texts(&estimates, "window")[i] != "whole"
            || texts(&estimates, "estimator")[i] != "BJ"
            || !["K_e", "T_L", "K_e_dot", "zeta_nm"].contains(&name.as_str())
        {
            continue;
        }
        let run: u64 = texts(&estimates, "run")[i].parse().unwrap();
        let Some(ColumnValues::Whole(runs)) = truth.column("run") else {
            panic!("runs are whole numbers")
        };
        let row = (0..runs.len())
            .find(|r| texts(&truth, "subject")[*r] == texts(&estimates, "subject")[i] && runs[*r] == run)
            .unwrap();
        let error = reals(&estimates, "value")[i] - reals(&truth, &format!("{name}_initial"))[row];
        z.push(error / reals(&estimates, "standard_error")[i]);
    }
    assert_eq!(z.len(), 16);
    assert!(z.iter().all(|z| z.abs() < 5.0), "{z:?}");
    assert!((z.iter().sum::<f64>() / 16.0).abs() < 1.0, "{z:?}");

    // Troubles: an uneven t is refused as it stands and read when it is to be resampled.
    let troubled = VirtualExperiment {
        subjects: 1,
        runs: 1,
        trouble: Trouble::ALL.to_vec(),
        ..experiment.clone()
    };
    let with = directory.path().join("with");
    let manifest = simulate_group(&troubled, &with, &|| ()).unwrap();
    assert!(manifest.read.resample);
    let rows = fs::read_to_string(with.join("S1_C1_1.csv"))
        .unwrap()
        .lines()
        .filter(|l| !l.starts_with('#'))
        .count();
    assert_ne!(rows, 8193);
    for bad in [
        VirtualExperiment {
            subjects: 0,
            ..experiment.clone()
        },
        VirtualExperiment {
            between_runs: -1.0,
            ..experiment.clone()
        },
        VirtualExperiment {
            noise_level: 0.95,
            ..experiment.clone()
        },
        VirtualExperiment {
            remnant_order: 5,
            ..experiment
        },
    ] {
        assert!(matches!(
            simulate_group(&bad, &directory.path().join("bad"), &|| ()),
            Err(StudyError::Virtual { .. })
        ));
    }
}
