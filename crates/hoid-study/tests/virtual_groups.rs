//! Virtual experiments: groups of simulated people with their true parameters.
#![allow(clippy::unwrap_used)]

mod common;

use std::{collections::BTreeMap, fs};

use common::{content, reals, texts};
use hoid_io::{ColumnValues, read_table};
use hoid_model::scenario::Condition;
use hoid_sim::people::{Plant, RemnantKind};
use hoid_study::{
    RunOptions, StudyError,
    group::{
        Manifest, PeopleExperiment, SamplingDefect, VirtualExperiment, run_group, simulate_group, simulate_people,
    },
};

#[test]
fn virtual_experiment_is_reported_with_its_true_values() {
    let experiment = VirtualExperiment {
        subjects: 2,
        conditions: vec![Condition::C1],
        runs: 2,
        between_subjects: 0.1,
        between_runs: 0.02,
        remnant_order: 1,
        noise_level: 0.05,
        seed: 4,
        defects: Vec::new(),
    };
    let directory = tempfile::tempdir().unwrap();
    let (plain, again) = (directory.path().join("plain"), directory.path().join("again"));
    let mut manifest = simulate_group(&experiment, &plain, &|| ()).unwrap();
    simulate_group(&experiment, &again, &|| ()).unwrap();
    assert!(content(&plain) == content(&again), "the same seed, the same bytes");
    assert_eq!(Manifest::read(&plain.join("group.toml")).unwrap(), manifest);

    // The estimates agree with the true values of each run: all sixteen errors are within five standard errors, and
    // their mean is within 4/sqrt(16) standard errors.
    manifest.analysis.methods.clear();
    manifest.analysis.delay_s = (0.2, 0.36);
    manifest.analysis.form = "lead".to_owned();
    manifest.analysis.each_run = false;
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

    // With sampling defects, an uneven t is rejected, but is read if it is to be resampled.
    let troubled = VirtualExperiment {
        subjects: 1,
        runs: 1,
        defects: SamplingDefect::ALL.to_vec(),
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

/// The numbers of the guide: with the delay as a separate parameter, the error bars are correct for all six parameters;
/// ARX selects longer delays than Box-Jenkins.
#[test]
fn grey_box_error_bars_cover_the_truth() {
    let experiment = VirtualExperiment {
        subjects: 3,
        conditions: vec![Condition::C1, Condition::C4],
        runs: 5,
        between_subjects: 0.15,
        between_runs: 0.03,
        remnant_order: 1,
        noise_level: 0.1,
        seed: 12,
        defects: Vec::new(),
    };
    let directory = tempfile::tempdir().unwrap();
    let (people, out) = (directory.path().join("people"), directory.path().join("out"));
    let mut manifest = simulate_group(&experiment, &people, &|| ()).unwrap();
    manifest.analysis.methods.clear();
    manifest.analysis.grey_box = true;
    manifest.analysis.form = "lead".to_owned();
    manifest.analysis.each_run = false;
    manifest.analysis.delay_s = (0.2, 0.45);
    run_group(&manifest, &people, &out, &RunOptions::default(), &|_| (), &|| true).unwrap();

    let estimates = read_table(&out.join("estimates.parquet")).unwrap();
    let truth = read_table(&people.join("truth.csv")).unwrap();
    let Some(ColumnValues::Whole(runs)) = truth.column("run") else {
        panic!("runs are whole numbers")
    };
    let [subject, condition, run, window, estimator, parameter] =
        ["subject", "condition", "run", "window", "estimator", "parameter"].map(|name| texts(&estimates, name));
    let mut hits: BTreeMap<&str, Vec<bool>> = BTreeMap::new();
    for i in (0..subject.len()).filter(|i| estimator[*i] == "grey box" && window[*i] != "whole") {
        let number: u64 = run[i].parse().unwrap();
        let row = (0..runs.len()).find(|r| {
            texts(&truth, "subject")[*r] == subject[i]
                && texts(&truth, "condition")[*r] == condition[i]
                && runs[*r] == number
        });
        let column = match (parameter[i].as_str(), window[i].as_str()) {
            ("tau_e", _) => "tau_e".to_owned(),
            (name, "first") => format!("{name}_initial"),
            (name, _) => format!("{name}_last"),
        };
        let error = reals(&estimates, "value")[i] - reals(&truth, &column)[row.unwrap()];
        let inside = error.abs() < 1.96 * reals(&estimates, "standard_error")[i];
        hits.entry(&parameter[i]).or_default().push(inside);
    }
    assert_eq!(hits.len(), 6);
    for (name, inside) in hits {
        // With 60 sub-batches, the standard error of the rate is 2.8 %.
        assert_eq!(inside.len(), 60, "{name}");
        let rate = inside.iter().filter(|hit| **hit).count() as f64 / 60.0;
        assert!(rate > 0.95 - 3.0 * 0.028, "{name}: {rate}");
    }
    let delays = read_table(&out.join("delays.parquet")).unwrap();
    let mean = |name: &str, condition: &str| {
        let of_condition = texts(&delays, "condition").iter().zip(reals(&delays, name));
        of_condition
            .filter(|(c, _)| *c == condition)
            .map(|(_, nk)| nk)
            .sum::<f64>()
            / 3.0
    };
    // In C1 both structures use the delay of the operator; in C4 each structure has the delay that fits it best.
    assert!((mean("BJ_nk", "C1") - 29.0).abs() < 2.0, "{}", mean("BJ_nk", "C1"));
    assert_eq!(mean("ARX_nk", "C1"), mean("BJ_nk", "C1"));
    let (arx, bj) = (mean("ARX_nk", "C4"), mean("BJ_nk", "C4"));
    assert!((bj - 29.0).abs() < 2.0 && arx > bj + 3.0, "ARX {arx}, BJ {bj}");
}

/// The files of virtual people have the format of recorded experiments, together with all true values.
#[test]
fn virtual_people_are_reported_with_their_true_values() {
    let experiment = PeopleExperiment {
        subjects: 2,
        runs: 2,
        remnants: vec![RemnantKind::BroadBand, RemnantKind::Pulsed],
        ..PeopleExperiment::default()
    };
    let directory = tempfile::tempdir().unwrap();
    let (plain, again) = (directory.path().join("plain"), directory.path().join("again"));
    let manifest = simulate_people(&experiment, &plain, &|| ()).unwrap();
    simulate_people(&experiment, &again, &|| ()).unwrap();
    assert!(content(&plain) == content(&again), "the same seed, the same bytes");
    assert_eq!(Manifest::read(&plain.join("group.toml")).unwrap(), manifest);
    assert_eq!(manifest.runs.len(), 12);
    assert!(simulate_people(&experiment, &plain, &|| ()).is_err());

    let truth = read_table(&plain.join("truth.csv")).unwrap();
    assert_eq!(texts(&truth, "remnant")[0], "broad-band");
    assert_eq!(texts(&truth, "remnant")[11], "pulsed");
    for (row, entry) in manifest.runs.iter().enumerate() {
        assert_eq!(texts(&truth, "condition")[row], entry.condition);
        let margin = reals(&truth, "phase_margin_deg")[row];
        // The spread between runs may exceed the range between persons by a few degrees.
        assert!((10.0..75.0).contains(&margin), "{margin}");
        let run = read_table(&plain.join(&entry.file)).unwrap();
        let names: Vec<&str> = run.columns.iter().map(|column| column.name.as_str()).collect();
        assert_eq!(names, ["t", "e", "u", "d", "y"]);
        let (t, e, y) = (reals(&run, "t"), reals(&run, "e"), reals(&run, "y"));
        assert_eq!(t.len(), 2400);
        let offset = reals(&truth, "offset_e")[row];
        assert!((0..2400).all(|k| (e[k] + y[k] - offset).abs() < 1e-9));
    }
    // A lead-lag always has a value of K/T_I, and of T_I if T_I is finite.
    let forms = texts(&truth, "form");
    let ratio = reals(&truth, "K_over_T_I");
    assert!((0..12).all(|row| (forms[row] == "lead") == ratio[row].is_nan()));
    for bad in [
        PeopleExperiment {
            runs: 0,
            ..experiment.clone()
        },
        PeopleExperiment {
            plants: vec![Plant::Integrator; 2],
            ..experiment.clone()
        },
        PeopleExperiment {
            between_runs: 1.5,
            ..experiment.clone()
        },
        PeopleExperiment {
            form: Some(hoid_model::Form::Lag),
            ..experiment
        },
    ] {
        let directory = directory.path().join("bad");
        let refused = simulate_people(&bad, &directory, &|| ());
        assert!(matches!(refused, Err(StudyError::Virtual { .. })));
        assert!(!directory.exists(), "nothing is written of the refused input");
    }
}
