//! From recordings to a verdict: each rule is tested with a recording that triggers it and with a recording that does
//! not.
#![allow(clippy::unwrap_used)]

use std::{collections::BTreeMap, fs, path::Path};

use hoid_analysis::{
    AnalysisError, BatchEstimator, Excitation, Identification, Polynomials, Reading, Recordings, output_delay_samples,
    parse_prior, without_offsets,
};
use hoid_ident::{GreyBox, SigmoidChange, family::FamilyEstimator};
use hoid_io::{NewRate, Offset, write_record};
use hoid_model::{
    Channel, ContinuousTransferFunction, Decimation, FaultHandling, Form, Record, SampleTime, Structure, VerdictLevel,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};

/// Returns a run as recorded, with only e and u.
fn recorded_run(seed: u64, change: impl Fn(f64, f64) -> (f64, f64)) -> Record {
    let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
    let run = RunSeed {
        seed,
        ..RunSeed::default()
    };
    let record = simulator.run(run, false).unwrap();
    let (e, u) = record
        .input()
        .iter()
        .zip(record.output())
        .map(|(e, u)| change(*e, *u))
        .unzip();
    Record::new(record.sample_time(), Channel::new("e", "", e), Channel::new("u", "", u))
        .unwrap()
        .labelled(format!("run {seed}"))
}

fn clipped_run(seed: u64) -> Record {
    recorded_run(seed, |e, u| (e, u.clamp(-0.086, 0.086)))
}

/// Only one form and few noise orders are tried, because their selection is not tested here.
fn quick_identification() -> Identification {
    Identification {
        estimator: FamilyEstimator {
            forms: vec![Form::Lead],
            nd: Some(0..=4),
            ..FamilyEstimator::default()
        },
        ..Identification::default()
    }
}

#[test]
fn saturation_is_reported_for_files_and_records() {
    let clean = quick_identification()
        .run(Recordings::from_records([recorded_run(1, |e, u| (e, u))]))
        .unwrap();
    assert_eq!(
        clean.fit.verdict.level,
        VerdictLevel::Trustworthy,
        "{}",
        clean.fit.verdict
    );
    let shown = clean.to_string();
    assert!(
        shown.starts_with("Verdict: trustworthy\n") && shown.contains("\ntau_e = 0.28"),
        "{shown}"
    );
    let two = [clipped_run(1), clipped_run(2)];
    let of_records = quick_identification()
        .run(Recordings::from_records(two.clone()))
        .unwrap();
    assert_eq!(of_records.fit.verdict.level, VerdictLevel::Doubtful);
    let directory = tempfile::tempdir().unwrap();
    let paths = ["run 1", "run 2"].map(|name| directory.path().join(format!("{name}.csv")));
    for (path, record) in paths.iter().zip(&two) {
        write_record(path, record).unwrap();
    }
    let of_files = quick_identification()
        .run(Reading::default().read_files(&paths, |_, _| ()).unwrap())
        .unwrap();
    let place = format!("{}/", directory.path().display());
    let words = |found: &hoid_analysis::IdentifiedModel| -> Vec<String> {
        let all = found.fit.verdict.findings().iter();
        all.map(|f| f.message.replace(&place, "").replace(".csv", "")).collect()
    };
    assert_eq!(words(&of_records), words(&of_files));
    let first = &words(&of_files)[0];
    assert!(
        first.starts_with("run 1: u is saturated in 28 % of the samples"),
        "{first}"
    );
}

#[test]
fn duplicate_and_unusable_runs_are_refused() {
    let record = recorded_run(1, |e, u| (e, u));
    let copy = record.clone().labelled("again");
    let refused = quick_identification()
        .run(Recordings::from_records([record.clone(), copy]))
        .unwrap_err();
    assert!(matches!(refused, AnalysisError::SameSamples { .. }));
    let words = refused.to_string();
    assert!(words.starts_with("run 1 and again hold the same samples"), "{words}");
    let nothing = quick_identification().run(Recordings::default()).unwrap_err();
    assert!(matches!(nothing, AnalysisError::NoRecordings));
    // If the stick does not move, the estimator reports this.
    let resting = quick_identification().run(Recordings::from_records([recorded_run(1, |e, _| (e, 0.0))]));
    assert!(matches!(resting.unwrap_err(), AnalysisError::Ident(_)));
    let short = record.span(0.0, 0.5).unwrap();
    assert!(matches!(
        quick_identification()
            .run(Recordings::from_records([short]))
            .unwrap_err(),
        AnalysisError::Ident(_)
    ));
}

#[test]
fn unstable_loop_is_reported_if_the_element_is_known() {
    let reversed = || Recordings::from_records([recorded_run(1, |e, u| (-e, u))]);
    let element = ContinuousTransferFunction::new(&[90.0], &[1.0, 6.0, 0.0]).unwrap();
    let with = Identification {
        controlled_element: Some(element.clone()),
        ..quick_identification()
    };
    let right = with
        .run(Recordings::from_records([recorded_run(1, |e, u| (e, u))]))
        .unwrap();
    assert_eq!(
        right.fit.verdict.level,
        VerdictLevel::Trustworthy,
        "{}",
        right.fit.verdict
    );
    let wrong = with.run(reversed()).unwrap();
    assert_ne!(wrong.fit.verdict.level, VerdictLevel::Trustworthy);
    assert!(
        right
            .settings
            .iter()
            .any(|s| s.name == "controlled element" && s.value == element.to_string())
    );
}

#[test]
fn settings_list_the_values_used() {
    let mut how = quick_identification();
    how.estimator.search.tolerance = 1e-7;
    let found = how
        .run(Recordings::from_records([recorded_run(1, |e, u| (e, u))]))
        .unwrap();
    let value = |name: &str| found.settings.iter().find(|s| s.name == name).map(|s| s.value.as_str());
    assert_eq!(value("search"), Some("auto, relative tolerance 1e-7"));
    assert_eq!(value("initial state"), Some("estimate"));
    assert_eq!(value("form"), Some("lead"));
    assert_eq!(value("removed from e and u"), Some("mean"));
    assert!(found.data.accounts[0].level.is_some());
}

#[test]
fn faults_are_repaired_or_kept() {
    let with_outlier = || {
        let record = recorded_run(1, |e, u| (e, u));
        let mut u = record.output().to_vec();
        u[3000] = 5.0;
        let e = Channel::new("e", "", record.input().to_vec());
        Recordings::from_records([Record::new(record.sample_time(), e, Channel::new("u", "", u)).unwrap()])
    };
    let repaired = quick_identification().run(with_outlier()).unwrap();
    assert_eq!(repaired.data.accounts[0].faults.len(), 1);
    let kept = Identification {
        faults: FaultHandling::Keep,
        ..quick_identification()
    };
    let kept = kept.run(with_outlier()).unwrap();
    assert!(kept.data.accounts[0].faults.is_empty());
    assert!(kept.fit.loss > 3.0 * repaired.fit.loss);
}

#[test]
fn high_rates_are_reduced_unless_samples_are_counted() {
    let ts = SampleTime::new(0.002).unwrap();
    let wave = |phase: f64| (0..4000).map(|k| (0.01 * f64::from(k) - phase).sin()).collect();
    let record = Record::new(ts, Channel::new("e", "", wave(0.0)), Channel::new("u", "", wave(0.3))).unwrap();
    let all = || Recordings::from_records([record.clone()]);
    let lower = all().at_rate(Decimation::Auto, false).unwrap();
    assert!((lower.records[0].sample_time().s() - 0.01).abs() < 1e-12);
    assert_eq!(lower.accounts[0].steps.len(), 1);
    let kept = all().at_rate(Decimation::Auto, true).unwrap();
    assert_eq!(kept.records[0].len(), 4000);
    let words = all().kept_rate_message(Decimation::Auto, true).unwrap();
    assert!(
        words.starts_with("500 Hz is kept") && words.contains("--decimate 5"),
        "{words}"
    );
    assert_eq!(all().kept_rate_message(Decimation::By(5), true), None);
    assert_eq!(all().at_rate(Decimation::By(5), true).unwrap().records[0].len(), 800);
}

#[test]
fn rate_given_in_hz_is_not_reduced_again() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("run.csv");
    write_record(&path, &recorded_run(1, |e, u| (e, u))).unwrap();
    let mut reading = Reading::default();
    reading.preparation.rate = NewRate::Hz(400.0);
    let read = reading.read_file(&path, |_, _| ()).unwrap();
    let used = read.at_rate(Decimation::Auto, false).unwrap();
    assert!((used.records[0].sample_time().s() - 0.0025).abs() < 1e-9);
}

#[test]
fn offsets_are_converted_to_lag_samples() {
    let record = recorded_run(1, |e, u| (e, u));
    let of = |name: &str, offset| BTreeMap::from([(name.to_owned(), offset)]);
    assert_eq!(
        output_delay_samples(&record, &of("u", Offset::Samples(2.0))).unwrap(),
        2.0
    );
    assert_eq!(
        output_delay_samples(&record, &of("e", Offset::Seconds(0.01))).unwrap(),
        -1.0
    );
    let wrong = output_delay_samples(&record, &of("y", Offset::Samples(1.0))).unwrap_err();
    assert_eq!(
        wrong.to_string(),
        "--offset: there is no channel \"y\"; the record has e, u; e and u can also be used for the input and output"
    );
    let mut reading = Reading::default();
    reading.preparation.offset = of("u", Offset::Samples(1.0));
    let (unmoved, offsets) = without_offsets(&reading);
    assert!(unmoved.preparation.offset.is_empty() && offsets.len() == 1);
    reading.preparation.rate = NewRate::Hz(50.0);
    assert_eq!(without_offsets(&reading), (reading, BTreeMap::new()));
}

#[test]
fn unrecorded_excitation_is_refused() {
    let with = |excitation| {
        let of = Identification {
            excitation,
            ..quick_identification()
        };
        of.run(Recordings::from_records([recorded_run(1, |e, u| (e, u))]))
    };
    let error = with(Excitation::from_text(Some("f_t"))).unwrap_err().to_string();
    assert!(error.contains("found f_t; expected one of e, u"), "{error}");
    // The excitation of a group is named for all recordings, of which some may lack it.
    let found = with(Excitation::IfRecorded("f_t".to_owned())).unwrap();
    assert!(found.fit.no_lines.is_some_and(|why| why.contains("f_t")));
    let looked_for = quick_identification()
        .run(Recordings::from_records([recorded_run(1, |e, u| (e, u))]))
        .unwrap();
    assert_eq!(looked_for.fit.no_lines, None);
    assert_eq!(Excitation::from_text(Some("none")), Excitation::Nothing);
}

#[test]
fn prior_is_read_by_name_or_from_a_file() {
    assert!(parse_prior("none").unwrap().entries().is_empty());
    for (text, expected) in [
        ("omega_nm", "prior: found omega_nm; expected population, none, "),
        ("nowhere.json", "nowhere.json"),
    ] {
        let words = parse_prior(text).unwrap_err().to_string();
        assert!(words.contains(expected), "{words}");
    }
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("fit.json");
    fs::write(&path, "{\"parameters\": []}").unwrap();
    assert!(parse_prior(Path::new(&path).to_str().unwrap()).is_err());
}

#[test]
fn operator_is_validated_on_another_run() {
    let found = quick_identification()
        .run(Recordings::from_records([recorded_run(1, |e, u| (e, u))]))
        .unwrap();
    let other = Recordings::from_records([recorded_run(2, |e, u| (e, u))]);
    let model = &found.fit.operator(0).polynomial_fit;
    let judged = found.validated(model, other).unwrap();
    assert_eq!(judged.name, "run 2");
    assert!(
        judged.quality.vaf_simulation > 80.0,
        "{}",
        judged.quality.vaf_simulation
    );
    assert!(found.validated(model, Recordings::default()).is_err());
}

#[test]
fn given_orders_replace_those_of_the_operator() {
    let ts = SampleTime::AT_100_HZ;
    let default = Polynomials::new(Structure::BoxJenkins).ranges(ts).unwrap();
    assert_eq!((default.nk, default.nd, default.nb), (6..=61, 1..=4, 2..=2));
    let some = Polynomials {
        orders: [("nd".to_owned(), 2..=2)].into(),
        delay_s: Some((0.28, 0.28)),
        ..Polynomials::new(Structure::BoxJenkins)
    };
    let found = some.ranges(ts).unwrap();
    assert_eq!((found.nk, found.nd, found.nf), (29..=29, 2..=2, 2..=2));
    let none = Polynomials {
        orders: [("nx".to_owned(), 2..=2)].into(),
        ..Polynomials::new(Structure::Arx)
    };
    assert!(matches!(none.ranges(ts), Err(AnalysisError::Options { .. })));
}

/// The rule for a stick at its end applies to all estimators.
#[test]
fn every_estimator_reports_saturated_recordings() {
    fn assert_doubtful<E: BatchEstimator>(estimator: E, record: &Record) {
        let found = Identification::of(estimator)
            .run(Recordings::from_records([record.clone()]))
            .unwrap();
        let first = found.verdict.reasons().next().unwrap_or_default().to_owned();
        assert!(first.contains("is saturated in"), "{first}");
    }
    let record = clipped_run(1);
    let polynomials = Polynomials {
        orders: [("nd".to_owned(), 1..=1), ("nk".to_owned(), 29..=29)].into(),
        ..Polynomials::new(Structure::BoxJenkins)
    };
    assert_doubtful(polynomials.clone(), &record);
    assert_doubtful(GreyBox::new(1..=1), &record);
    assert_doubtful(SigmoidChange::default(), &record);
    let searched = Polynomials {
        orders: [("nk".to_owned(), 28..=29)].into(),
        start: Some([("b0".to_owned(), 0.04)].into()),
        ..polynomials
    };
    let refused = Identification::of(searched).run(Recordings::from_records([record]));
    assert!(
        refused
            .unwrap_err()
            .to_string()
            .contains("--start applies to a single model")
    );
}

/// The rules for people do not apply to a furnace that is sampled every 9 s and has a two-level input.
#[test]
fn rules_for_people_do_not_apply_to_polynomials() {
    let noise = |seed: u64| {
        RunSeed {
            seed,
            ..RunSeed::default()
        }
        .white_noise(900)
    };
    let input: Vec<f64> = (0..900).map(|t| noise(1)[t / 3].signum()).collect();
    let mut output = vec![0.0; 900];
    let (mut x, mut v) = ([0.0; 2], 0.0);
    for (t, w) in noise(2).iter().enumerate().skip(2) {
        let next = 1.5 * x[0] - 0.7 * x[1] + input[t - 1] + 0.5 * input[t - 2];
        x = [next, x[0]];
        v = 0.6 * v + 0.1 * w;
        output[t] = next + v;
    }
    let record = Record::new(
        SampleTime::new(9.0).unwrap(),
        Channel::new("valve", "", input),
        Channel::new("gas", "", output),
    )
    .unwrap();
    let mut bj = Polynomials::new(Structure::BoxJenkins);
    for (name, order) in [("nb", 2), ("nf", 2), ("nd", 1), ("nc", 0), ("nk", 1)] {
        bj.orders.insert(name.to_owned(), order..=order);
    }
    let found = Identification::of(bj).run(Recordings::from_records([record])).unwrap();
    assert_eq!(found.verdict.level, VerdictLevel::Trustworthy, "{}", found.verdict);
    for (name, truth) in [("f1", -1.5), ("f2", 0.7), ("b0", 1.0), ("b1", 0.5)] {
        let (_, of) = found.fit.fit.parameters().into_iter().find(|(n, _)| n == name).unwrap();
        let error = of.standard_error.unwrap();
        assert!((of.value - truth).abs() < 4.0 * error && error < 0.05, "{name}: {of}");
    }
}

/// If u is noise that is unrelated to e, no answer is trustworthy, and the verdict refers to the requested answer.
#[test]
fn verdict_refers_to_the_requested_answers() {
    let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
    let run = simulator.run(RunSeed::default(), false).unwrap();
    let noise = RunSeed {
        seed: 99,
        ..RunSeed::default()
    };
    let u = Channel::new("u", "", noise.white_noise(run.len()));
    let unrelated = Record::new(run.sample_time(), Channel::new("e", "", run.input().to_vec()), u).unwrap();
    let identified = |record: &Record, answers: &[&str]| {
        let how = Identification {
            answers: answers.iter().map(|name| (*name).to_owned()).collect(),
            controlled_element: Some(ContinuousTransferFunction::new(&[90.0], &[1.0, 6.0, 0.0]).unwrap()),
            ..Identification::default()
        };
        how.run(Recordings::from_records([record.clone()])).unwrap()
    };
    let nothing = identified(&unrelated, &[]);
    assert_eq!(nothing.verdict.level, VerdictLevel::NotDetermined);
    assert!(
        nothing.verdict.findings().iter().any(|f| f.kind == "no-response"),
        "{}",
        nothing.verdict
    );
    let answers = &nothing.verdict.answers;
    assert!(
        !answers.is_empty()
            && answers
                .values()
                .all(|answer| answer.level == VerdictLevel::NotDetermined)
    );

    let person = identified(&run, &[]);
    assert_eq!(person.verdict.level, VerdictLevel::Trustworthy, "{}", person.verdict);
    for name in ["crossover", "response"] {
        assert_eq!(person.verdict.answers[name].level, VerdictLevel::Trustworthy, "{name}");
    }
    let level = |answers: &[&str]| identified(&run, answers).verdict.level;
    assert_eq!(level(&["crossover", "tau_e"]), VerdictLevel::Trustworthy);
    assert_eq!(level(&["T_I"]), VerdictLevel::NotDetermined);
}
