//! Groups that are recorded at a high rate: decimated by themselves, the same people and lines.
#![allow(clippy::unwrap_used)]

mod common;

use common::{reals, texts};
use hoid_ident::frequency::{DescriptionOptions, describe_runs};
use hoid_io::{ReadOptions, read_record, read_table};
use hoid_model::{Record, SampleTime};
use hoid_sim::people::{Plant, RemnantKind};
use hoid_study::{
    RunOptions,
    group::{Manifest, NumberOrText, PeopleExperiment, PreparationSettings, run_group, simulate_people},
};

#[test]
fn a_group_at_1000_hz_is_that_at_100_hz() {
    let experiment = PeopleExperiment {
        subjects: 1,
        plants: vec![Plant::Integrator],
        remnants: vec![RemnantKind::BroadBand],
        runs: 3,
        between_runs: 0.0,
        sample_time: SampleTime::new(0.001).unwrap(),
        ..PeopleExperiment::default()
    };
    let directory = tempfile::tempdir().unwrap();
    let (files, out) = (directory.path().join("files"), directory.path().join("out"));
    let mut manifest = simulate_people(&experiment, &files, &|| ()).unwrap();
    manifest.analysis.methods.clear();
    manifest.analysis.each_run = false;
    run_group(&manifest, &files, &out, &RunOptions::default(), &|_| (), &|| true).unwrap();

    let steps = read_table(&out.join("preparation.parquet")).unwrap();
    let said = "1000 Hz, filtered and decimated by 10 to 100 Hz";
    let told = texts(&steps, "step").iter().zip(texts(&steps, "what"));
    assert_eq!(
        told.filter(|(step, what)| *step == "rate" && what.starts_with(said))
            .count(),
        3
    );

    let truth = read_table(&files.join("truth.csv")).unwrap();
    let people = read_table(&out.join("people.parquet")).unwrap();
    for name in ["crossover_rad_s", "phase_margin_deg", "tau_e"] {
        let (found, error) = (reals(&people, name)[0], reals(&people, &format!("{name}_se"))[0]);
        let truth = reals(&truth, name)[0];
        println!("{name}: {found:.4} +- {error:.4}, true {truth:.4}");
        assert!(
            (found - truth).abs() < 2.0 * error,
            "{name}: {found} +- {error}, true {truth}"
        );
    }

    // Lines are those of the recordings.
    let whole: Vec<Record> = manifest
        .runs
        .iter()
        .map(|run| {
            read_record(&files.join(&run.file), &ReadOptions::default())
                .unwrap()
                .record
        })
        .collect();
    let (_, facts) = manifest.conditions.iter().next().unwrap();
    let options = DescriptionOptions {
        excitation: facts.excitation.clone(),
        period_s: facts.period_s,
        offset_samples: facts.offset_samples,
        ..DescriptionOptions::default()
    };
    let expected = describe_runs(&whole, &options).unwrap();
    let lines = read_table(&out.join("describing-functions.parquet")).unwrap();
    for (k, (line, phase)) in expected.function.lines.iter().zip(expected.phases_deg()).enumerate() {
        assert!((reals(&lines, "magnitude_db")[k] - line.magnitude_db().value).abs() < 0.02);
        assert!(
            (reals(&lines, "phase_deg")[k] - phase.value).abs() < 0.2,
            "{}",
            line.omega_rad_s
        );
    }
}

#[test]
fn the_rate_of_a_group_as_typed() {
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
        // What is named is done before.
        (of(number(5.0), None), 1),
        (of(None, Some(50.0)), 1),
    ] {
        assert_eq!(settings.by_rate(None).unwrap().factor(ts), factor, "{settings:?}");
    }
    // A condition that names the rate wins.
    assert_eq!(
        of(text("off"), None)
            .by_rate(Some(&of(text("auto"), None)))
            .unwrap()
            .factor(ts),
        10
    );
    for wrong in [text("on"), number(0.0), number(2.5), number(f64::NAN)] {
        let message = of(wrong, None).preparation(None).unwrap_err();
        assert!(message.contains("expected \"auto\""), "{message}");
    }
    assert!(of(number(2.0), Some(50.0)).preparation(None).is_err());
    let manifest =
        "[prepare]\ndecimate = \"off\"\n[[runs]]\nsubject = \"a\"\ncondition = \"c\"\nrun = \"1\"\nfile = \"x.csv\"\n";
    assert!(Manifest::parse(manifest, "group.toml").is_ok());
}
