//! Groups recorded at a high rate: automatic decimation preserves operators and lines.
#![allow(clippy::unwrap_used)]

mod common;

use std::{fs, path::Path};

use common::{reals, texts};
use hoid_ident::frequency::{RecordDescriptionOptions, describe_runs};
use hoid_io::{ReadOptions, read_record, read_table};
use hoid_model::{Record, SampleTime};
use hoid_sim::people::{Plant, RemnantKind};
use hoid_study::{
    RunOptions,
    group::{Manifest, NumberOrText, PeopleExperiment, PreparationSettings, run_group, simulate_people},
};

/// Analyses the runs of a person at a sampling rate; returns the manifest, and crossover, margin and delay with their
/// errors.
fn analyse_people(directory: &Path, sample_time_s: f64) -> (Manifest, [(f64, f64); 3]) {
    let experiment = PeopleExperiment {
        subjects: 1,
        plants: vec![Plant::Integrator],
        remnants: vec![RemnantKind::BroadBand],
        runs: 3,
        between_runs: 0.0,
        sample_time: SampleTime::new(sample_time_s).unwrap(),
        seed: 3,
        ..PeopleExperiment::default()
    };
    let (files, out) = (directory.join("files"), directory.join("out"));
    let mut manifest = simulate_people(&experiment, &files, &|| ()).unwrap();
    manifest.analysis.methods.clear();
    manifest.analysis.each_run = false;
    run_group(&manifest, &files, &out, &RunOptions::default(), &|_| (), &|| true).unwrap();
    let people = read_table(&out.join("people.parquet")).unwrap();
    let of = |name: &str| (reals(&people, name)[0], reals(&people, &format!("{name}_se"))[0]);
    (manifest, ["crossover_rad_s", "phase_margin_deg", "tau_e"].map(of))
}

#[test]
fn group_at_1000_hz_matches_100_hz() {
    let directory = tempfile::tempdir().unwrap();
    let (fast, slow) = (directory.path().join("fast"), directory.path().join("slow"));
    fs::create_dir(&fast).unwrap();
    fs::create_dir(&slow).unwrap();
    let (manifest, found) = analyse_people(&fast, 0.001);
    let (_, at_100_hz) = analyse_people(&slow, 0.01);
    let (files, out) = (fast.join("files"), fast.join("out"));
    let steps = read_table(&out.join("preparation.parquet")).unwrap();
    let expected = "1000 Hz, filtered and decimated by 10 to 100 Hz";
    let step_texts = texts(&steps, "step").iter().zip(texts(&steps, "what"));
    assert_eq!(
        step_texts
            .filter(|(step, what)| *step == "rate" && what.starts_with(expected))
            .count(),
        3
    );

    let truth = read_table(&files.join("truth.csv")).unwrap();
    let names = ["crossover_rad_s", "phase_margin_deg", "tau_e"];
    for ((name, found), slow) in names.into_iter().zip(found).zip(at_100_hz) {
        let truth = reals(&truth, name)[0];
        println!("{name}: {found:?}, at 100 Hz {slow:?}, true {truth:.4}");
        assert!(
            (found.0 - truth).abs() < 2.0 * found.1,
            "{name}: {found:?}, true {truth}"
        );
        assert!(
            (found.0 - slow.0).abs() < 2.0 * found.1.hypot(slow.1),
            "{name}: {found:?} {slow:?}"
        );
    }

    // The describing function equals that of the original recordings.
    let whole: Vec<Record> = manifest
        .runs
        .iter()
        .map(|run| {
            read_record(&files.join(&run.file), &ReadOptions::default())
                .unwrap()
                .record
        })
        .collect();
    let (_, condition_settings) = manifest.conditions.iter().next().unwrap();
    let options = RecordDescriptionOptions {
        excitation: condition_settings.excitation.clone(),
        period_s: condition_settings.period_s,
        offset_samples: condition_settings.offset_samples,
        ..RecordDescriptionOptions::default()
    };
    let expected = describe_runs(&whole, &options).unwrap();
    let lines = read_table(&out.join("describing-functions.parquet")).unwrap();
    for (k, (line, phase)) in expected.function.lines.iter().zip(expected.phases_deg()).enumerate() {
        // The effect of the filter at the ends of the record appears as noise at the lines, which is small compared
        // with their errors. An uncorrected lead of the input would change the phase by .26 deg at 1 rad/s.
        let magnitude = line.magnitude_db();
        for (name, expected, least) in [("magnitude_db", magnitude, 0.02), ("phase_deg", phase, 0.1)] {
            let distance = (reals(&lines, name)[k] - expected.value).abs();
            let most = 0.1 * expected.standard_error.unwrap() + least;
            println!(
                "{:.2} rad/s, {name}: {distance:.4}, at most {most:.4}",
                line.omega_rad_s
            );
            assert!(distance < most, "{} rad/s, {name}: {distance}", line.omega_rad_s);
        }
    }
}

#[test]
fn decimation_settings_are_parsed() {
    let of = |decimate: Option<NumberOrText>, rate_hz| PreparationSettings {
        decimate,
        rate_hz,
        ..PreparationSettings::default()
    };
    let text = |text: &str| Some(NumberOrText::Text(text.to_owned()));
    let number = |n: f64| Some(NumberOrText::Number(n));
    let ts = SampleTime::new(0.001).unwrap();
    for (settings, factor) in [
        (of(None, None), 10),
        (of(text("auto"), None), 10),
        (of(text("off"), None), 1),
        (of(number(1.0), None), 1),
        // A given factor or frequency is applied earlier, so nothing remains to be done.
        (of(number(5.0), None), 1),
        (of(None, Some(50.0)), 1),
    ] {
        assert_eq!(
            settings.rate_decimation(None).unwrap().factor(ts),
            factor,
            "{settings:?}"
        );
    }
    // A rate given by a condition takes precedence.
    assert_eq!(
        of(text("off"), None)
            .rate_decimation(Some(&of(text("auto"), None)))
            .unwrap()
            .factor(ts),
        10
    );
    for wrong in [text("on"), number(0.0), number(2.5), number(f64::NAN)] {
        let message = of(wrong, None).preparation(None).unwrap_err();
        assert!(message.contains("expected \"auto\""), "{message}");
    }
    assert!(of(number(2.0), Some(50.0)).preparation(None).is_err());
    let manifest = "name = \"g\"\n[prepare]\ndecimate = \"off\"\n[[runs]]\nsubject = \"a\"\ncondition = \"c\"\nrun = \"1\"\nfile = \"x.csv\"\n";
    let read = Manifest::parse(manifest, "group.toml").unwrap();
    assert_eq!(read.rate_decimation("c").unwrap().factor(ts), 1);
}
