//! Analysis of groups of recorded runs, tested with simulated persons.
#![allow(clippy::unwrap_used)]

mod common;

use std::{
    fs,
    path::Path,
    sync::atomic::{AtomicU64, Ordering},
};

use common::{content, reals, texts};
use hoid_io::{read_table, write_record};
use hoid_model::scenario::{Condition, Scenario};
use hoid_sim::{RunSeed, Simulator};
use hoid_study::{
    RunOptions, StudyError,
    group::{ConditionSettings, GroupSummary, Manifest, Pattern, PersonStatus, run_group},
};

/// Writes recordings of two subjects with different gains, in two conditions with two runs each.
fn write_recordings() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    for (subject, gain) in [("A", 1.0), ("B", 1.2)] {
        for (cell, condition) in [Condition::C1, Condition::C4].into_iter().enumerate() {
            let mut scenario = Scenario::condition(condition);
            for state in [&mut scenario.initial, &mut scenario.last] {
                state.operator.k_e *= gain;
            }
            let simulator = Simulator::new(&scenario).unwrap();
            for run in 1..=2 {
                let run_seed = RunSeed {
                    seed: if subject == "A" { 1 } else { 2 },
                    cell: cell as u64,
                    replication: run,
                };
                let record = simulator.run(run_seed, false).unwrap();
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
    let (mut manifest, others) = Manifest::from_directory(directory, &pattern).unwrap();
    assert_eq!((manifest.runs.len(), others.len()), (8, 1));
    manifest.analysis.delay_s = (0.25, 0.32);
    manifest.analysis.form = "lead".to_owned();
    // The manifest that is read equals the manifest that was written.
    assert_eq!(Manifest::parse(&manifest.text(), "group.toml").unwrap(), manifest);
    manifest
}

#[test]
fn group_recovers_its_people_and_can_be_resumed() {
    let data = write_recordings();
    let manifest = manifest(data.path());
    let out = tempfile::tempdir().unwrap();
    let (whole, pieces) = (out.path().join("whole"), out.path().join("pieces"));
    let options = |jobs, resume| RunOptions {
        jobs: Some(jobs),
        resume,
        ..RunOptions::default()
    };
    let outcome = run_group(&manifest, data.path(), &whole, &options(2, false), &|_| (), &|| true).unwrap();
    // There are eight runs, and four joint fits of both runs of a person in a condition.
    assert!(outcome.finished && outcome.estimates == 12);
    // The analysis is stopped after every three runs on one thread; the results have the same bytes.
    for _ in 0..5 {
        let left = AtomicU64::new(3);
        let should_continue = || {
            left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1))
                .is_ok()
        };
        run_group(
            &manifest,
            data.path(),
            &pieces,
            &options(1, true),
            &|_| (),
            &should_continue,
        )
        .unwrap();
    }
    assert!(content(&whole) == content(&pieces));

    // A stopped analysis with a damaged table of each kind of block gives the same results when it is resumed.
    let damaged = out.path().join("damaged");
    let left = AtomicU64::new(6);
    let should_continue = || {
        left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1))
            .is_ok()
    };
    run_group(
        &manifest,
        data.path(),
        &damaged,
        &options(1, false),
        &|_| (),
        &should_continue,
    )
    .unwrap();
    for name in ["000000-traces.parquet", "000008-estimates.parquet"] {
        let path = damaged.join("parts").join(name);
        let mut bytes = fs::read(&path).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        fs::write(&path, bytes).unwrap();
    }
    let outcome = run_group(&manifest, data.path(), &damaged, &options(2, true), &|_| (), &|| true).unwrap();
    assert_eq!(outcome.notes.len(), 2, "{:?}", outcome.notes);
    assert!(content(&whole) == content(&damaged));
    // No file is written among the recordings.
    let among = run_group(
        &manifest,
        data.path(),
        data.path(),
        &options(1, false),
        &|_| (),
        &|| true,
    );
    assert!(
        among
            .unwrap_err()
            .to_string()
            .contains("of this command, which may be overwritten")
    );

    // The delay of each person is nk = 29, and the gains in C1 are K_e = 0.09 and 0.108, within four standard errors of
    // the mean of two runs.
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
    // The change of C4 is visible in the sub-batches.
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

    // Gain and delay of the operator of each person are within four standard errors; in C4 the operator changes.
    let summary = GroupSummary::read(&manifest, &whole).unwrap();
    let status: Vec<PersonStatus> = summary.people.iter().map(|p| p.status).collect();
    let (fitted, changes) = (PersonStatus::Fitted, PersonStatus::Changes);
    assert_eq!(
        status.iter().filter(|s| **s == fitted).count(),
        4,
        "nothing states that C4 changes"
    );
    assert!(!status.contains(&changes) && summary.failures.is_empty());
    for (who, k_e) in [("A", 0.09), ("B", 0.108)] {
        let person = summary
            .people
            .iter()
            .find(|p| p.subject == who && p.condition == "C1")
            .unwrap();
        assert_eq!((person.form.as_str(), person.runs), ("lead", 2));
        for (name, truth) in [("K_e", k_e), ("tau_e", 0.28)] {
            let found = person.parameter(name).unwrap();
            let error = found.standard_error.unwrap();
            assert!((found.value - truth).abs() < 4.0 * error, "{who} {name}: {found:?}");
        }
    }

    // Other data with the same manifest belong to another group.
    let file = data.path().join("A_C1_1.csv");
    fs::write(&file, fs::read_to_string(&file).unwrap().replacen('1', "2", 1)).unwrap();
    let error = run_group(&manifest, data.path(), &whole, &options(1, true), &|_| (), &|| true).unwrap_err();
    assert!(matches!(error, StudyError::OtherStudy { .. }), "{error}");
}

#[test]
fn only_requested_polynomials_are_in_the_tables() {
    let data = write_recordings();
    let mut manifest = manifest(data.path());
    manifest.runs.retain(|run| run.subject == "A" && run.condition == "C1");
    manifest.analysis.methods = vec!["rls".to_owned()];
    manifest.analysis.polynomials = vec!["bj".to_owned()];
    let out = data.path().with_extension("out");
    run_group(&manifest, data.path(), &out, &RunOptions::default(), &|_| (), &|| true).unwrap();
    let estimators = |table: &str| {
        let table = read_table(&out.join(table)).unwrap();
        texts(&table, "estimator")
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
    };
    let drawn = estimators("responses.parquet");
    assert!(drawn.iter().any(|name| name == "BJ") && !drawn.iter().any(|name| name == "ARX"));
    // The orders of the recursion are known, so the recursion can start.
    assert!(estimators("estimates.parquet").iter().any(|name| name == "RLS"));
    fs::remove_dir_all(out).unwrap();

    manifest.analysis.polynomials = vec!["armax".to_owned()];
    let refused = Manifest::parse(&manifest.text(), "group.toml").unwrap_err().to_string();
    assert!(
        refused.contains("analysis.polynomials has \"armax\", expected one or more of arx, bj"),
        "{refused}"
    );
}

#[test]
fn bad_files_give_failed_rows_and_bad_manifests_give_errors() {
    let data = write_recordings();
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
    let summary = GroupSummary::read(&manifest, &out.path().join("g")).unwrap();
    assert_eq!((summary.failures.len(), summary.failures[0].run.as_str()), (1, "1"));
    assert!(summary.verdict.findings().iter().any(|f| f.kind == "run-failed"));
    assert_eq!(summary.people[0].runs, 1, "{:?}", summary.people);
    assert!(texts(&estimates, "run").iter().any(|run| run == "2"));

    let text = manifest.text();
    for (from, to, words) in [
        ("run = \"2\"", "run = \"1\"", "appears twice"),
        ("subject = \"A\"", "subject = \"\"", "no subject"),
        ("trace_every = 16", "trace_every = 0", "trace_every is 0"),
        ("trace_every = 16", "trace_evry = 16", "unknown field"),
        ("form = \"lead\"", "form = \"lead9\"", "analysis.form"),
        ("prior = \"population\"", "prior = \"pilots\"", "analysis.prior"),
        (
            "each_run = true",
            "each_run = true\nindividual = [\"G\"]",
            "analysis.individual",
        ),
        (
            "each_run = true",
            "each_run = true\n[conditions.C9]",
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
    let error_for = |pattern: &Pattern| match Manifest::from_directory(empty.path(), pattern) {
        Err(error @ StudyError::NoRuns { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    };
    assert!(error_for(&pattern).contains("matches {run}.csv; found no files"));
    for n in 1..=4 {
        std::fs::write(empty.path().join(format!("anna-{n}.csv")), "").unwrap();
    }
    let pattern = Pattern::new("{subject}_{run}*.csv").unwrap();
    let message = error_for(&pattern);
    assert!(
        message.contains("{subject}_{run}*.csv; found anna-1.csv, anna-2.csv, anna-3.csv and 1 more"),
        "{message}"
    );
}

/// Runs of two persons are joined, and the fits agree with the describing function.
#[test]
fn joined_runs_agree_with_the_describing_function() {
    let data = write_recordings();
    let text = r#"
name = "joined"

[analysis]
delay_s = [0.25, 0.32]
form = "lead"
response_at_rad_s = [3.0]
methods = ["physical"]

[conditions.C1]
controlled_element = "90/1,6,0"
excitation = "f_t"
period_s = 81.92

[[runs]]
file = "A_C1_1.csv"
subject = "A"
condition = "C1"
run = "1"

[[runs]]
file = "A_C1_2.csv"
subject = "A"
condition = "C1"
run = "2"

[[runs]]
file = "A_C1_1.csv"
then = "B_C1_1.csv"
subject = "A"
condition = "A then B"
run = "1"

[[runs]]
file = "A_C1_2.csv"
then = "B_C1_2.csv"
subject = "A"
condition = "A then B"
run = "2"
"#;
    let manifest = Manifest::parse(text, "group.toml").unwrap();
    assert_eq!(Manifest::parse(&manifest.text(), "group.toml").unwrap(), manifest);
    let out = tempfile::tempdir().unwrap();
    let out = out.path().join("out");
    run_group(&manifest, data.path(), &out, &RunOptions::default(), &|_| (), &|| true).unwrap();

    // B has 1.2 times the gain of A: where the files are joined, after 81.92 s, the gain increases by 1.58 dB at every
    // frequency.
    let settling = read_table(&out.join("settling.parquet")).unwrap();
    let row = texts(&settling, "parameter")
        .iter()
        .position(|p| p == "magnitude_db_at_3")
        .unwrap();
    let of = |name: &str| reals(&settling, name)[row];
    assert!((of("change_s") - 81.92).abs() < 1e-9);
    let step = of("after") - of("before");
    assert!(
        (step - 20.0 * 1.2f64.log10()).abs() < 3.0 * of("noise"),
        "{step} +- {}",
        of("noise")
    );
    assert!(
        of("settle90_s") > 0.0 && of("settle90_s") < 30.0,
        "{}",
        of("settle90_s")
    );

    // Box-Jenkins has a negligible bias: its distance from the describing function is below two standard errors, and it
    // has the margins of C1.
    let agreement = read_table(&out.join("agreement.parquet")).unwrap();
    let row = texts(&agreement, "estimator").iter().position(|e| e == "BJ").unwrap();
    assert_eq!(texts(&agreement, "agrees")[row], "yes");
    let of = |name: &str| reals(&agreement, name)[row];
    assert!(of("distance_in_errors") < 2.0, "{}", of("distance_in_errors"));
    // The crossover is 1.5635 rad/s and the phase margin 76.67 deg (expected values of Table 2); the phase margin
    // includes the half sample of the hold.
    assert!(
        (of("crossover_rad_s") / 1.5635 - 1.0).abs() < 0.05,
        "{}",
        of("crossover_rad_s")
    );
    assert!(
        (of("phase_margin_deg") - 76.67).abs() < 5.0,
        "{}",
        of("phase_margin_deg")
    );

    // The time of the change is given either by the manifest or by the end of the first file, but not by both.
    let both = text.replace(
        "[[runs]]\nfile = \"A_C1_1.csv\"\nsubject",
        "[conditions.\"A then B\"]\nchange_s = 5.0\n\n[[runs]]\nfile = \"A_C1_1.csv\"\nsubject",
    );
    let refused = Manifest::parse(&both, "group.toml").unwrap_err().to_string();
    assert!(refused.contains("where the files are joined"), "{refused}");
}

/// One more sample of delay in every file increases nk by one, both with the delay of the person's operator (C1) and
/// with the joint fits to all runs (C4, for which a change is declared).
#[test]
fn delay_increases_with_an_output_offset() {
    let data = write_recordings();
    let late = tempfile::tempdir().unwrap();
    let mut manifest = manifest(data.path());
    manifest.runs.retain(|run| run.subject == "A");
    // ARX selects longer delays, which must stay within the range.
    manifest.analysis.delay_s = (0.27, 0.42);
    manifest.analysis.methods.clear();
    manifest.analysis.each_run = false;
    let condition = |excitation: Option<&str>, change_s| ConditionSettings {
        excitation: excitation.map(str::to_owned),
        change_s,
        ..ConditionSettings::default()
    };
    manifest
        .conditions
        .insert("C1".to_owned(), condition(Some("f_t"), None));
    manifest
        .conditions
        .insert("C4".to_owned(), condition(None, Some(40.96)));
    for run in &manifest.runs {
        let record = hoid_io::read(data.path().join(&run.file)).unwrap();
        let mut u = record.output().to_vec();
        u.rotate_right(1);
        u[0] = u[1];
        let channel = |name: &str, values: &[f64]| hoid_model::Channel::new(name, "", values.to_vec());
        let shifted = hoid_model::Record::new(record.sample_time(), channel("e", record.input()), channel("u", &u))
            .unwrap()
            .with_channel(channel("f_t", record.channel("f_t").unwrap()))
            .unwrap();
        write_record(&late.path().join(&run.file), &shifted).unwrap();
    }
    let found = |manifest: &Manifest, files: &Path, name: &str| {
        let out = late.path().join(name);
        run_group(manifest, files, &out, &RunOptions::default(), &|_| (), &|| true).unwrap();
        let delays = read_table(&out.join("delays.parquet")).unwrap();
        let summary = GroupSummary::read(manifest, &out).unwrap();
        let tau_s = summary.people[0].parameter("tau_e").unwrap().value;
        (
            [reals(&delays, "ARX_nk").to_vec(), reals(&delays, "BJ_nk").to_vec()],
            tau_s,
        )
    };
    let (before, tau_s) = found(&manifest, data.path(), "before");
    let (after, _) = found(&manifest, late.path(), "after");
    for (before, after) in before.iter().zip(&after) {
        for (before, after) in before.iter().zip(after) {
            assert_eq!(after - before, 1.0, "{before} {after}");
        }
    }
    // If the manifest states that u is recorded late, the operator is unchanged, but the orders increase.
    let mut with_delay = manifest.clone();
    with_delay.conditions.get_mut("C1").unwrap().offset_samples = 1.0;
    let (late_nk, told_s) = found(&with_delay, late.path(), "told");
    assert!((told_s - tau_s).abs() < 1e-3, "{told_s} {tau_s}");
    assert_eq!(late_nk[1], after[1]);
}
