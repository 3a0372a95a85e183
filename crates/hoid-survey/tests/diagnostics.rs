//! Verdicts on a trace and on the estimate at one time, for methods that start from a batch fit.
#![allow(clippy::unwrap_used)]

use hoid_model::{
    Channel, NotConvertible, Record, Severity, Verdict, VerdictLevel,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};
use hoid_survey::{multiple_model, physical};
use hoid_track::{Method, StartSource, TrackOptions, Tracker, track};

fn simulated(condition: Condition) -> Record {
    let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
    simulator.run(RunSeed::default(), false).unwrap()
}

fn kinds(verdict: &Verdict) -> Vec<&'static str> {
    verdict.findings().iter().map(|f| f.kind).collect()
}

fn verdict_of(record: &Record, options: &TrackOptions) -> Verdict {
    track(record, options, 10).unwrap().verdict(record, None).unwrap()
}

#[test]
fn clean_run_is_trustworthy_and_bad_start_is_reported() {
    let record = simulated(Condition::C4);
    let verdict = verdict_of(&record, &TrackOptions::default_for(physical(), 29));
    assert_eq!(verdict.level, VerdictLevel::Trustworthy, "{verdict}");
    let arx = TrackOptions::default_for(Method::rls(), 29);
    let verdict = verdict_of(&record, &arx);
    assert!(verdict.reasons().any(|r| r.starts_with("start fit: ")), "{verdict}");
}

#[test]
fn change_inside_the_start_span_is_reported() {
    // C4 changes at 40.96 s.
    let record = simulated(Condition::C4);
    for (span, changes) in [((10.0, 36.0), false), ((25.0, 60.0), true)] {
        for (method, severity) in [(multiple_model(), Severity::Doubt), (physical(), Severity::Note)] {
            let options = TrackOptions {
                start: StartSource::Span(Some(span)),
                ..TrackOptions::default_for(method, 29)
            };
            let verdict = verdict_of(&record, &options);
            let found = verdict.findings().iter().find(|f| f.kind == "not-constant");
            assert_eq!(found.map(|f| f.severity), changes.then_some(severity), "{verdict}");
        }
    }
}

#[test]
fn output_without_response_is_not_trustworthy() {
    let record = simulated(Condition::C1);
    let mut state = 3_u64;
    let mut draw = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let noise = Channel::new("u", "", (0..record.len()).map(|_| draw()).collect());
    let input = Channel::new("e", "", record.input().to_vec());
    let other = Record::new(record.sample_time(), input, noise).unwrap();
    let trace = track(&other, &TrackOptions::default_for(physical(), 29), 10).unwrap();
    let verdict = trace.verdict(&other, None).unwrap();
    assert_ne!(verdict.level, VerdictLevel::Trustworthy);
    assert!(kinds(&verdict).contains(&"start-explains-little"), "{verdict}");
}

#[test]
fn jump_of_a_fixed_delay_is_reported() {
    let record = simulated(Condition::C1);
    let late = |at: usize, by: usize| {
        let u = |t: usize| record.output()[if t >= at { t - by } else { t }];
        let u = Channel::new("u", "", (0..record.len()).map(u).collect());
        let e = Channel::new("e", "", record.input().to_vec());
        Record::new(record.sample_time(), e, u).unwrap()
    };
    let options = TrackOptions::default_for(physical(), 29);
    let is_reported = |record: &Record| kinds(&verdict_of(record, &options)).contains(&"not-followed");
    assert!(is_reported(&late(5000, 20)));
    assert!(!is_reported(&late(5000, 0)));
    // The trace is shorter than the examined span.
    assert!(
        verdict_of(&record.span(0.0, 12.0).unwrap(), &options)
            .findings()
            .iter()
            .all(|f| f.kind != "not-followed")
    );
}

#[test]
fn instantaneous_level_follows_the_estimate() {
    let options = TrackOptions {
        start: StartSource::Nothing,
        ..TrackOptions::default_for(physical(), 29)
    };
    let record = simulated(Condition::C1);
    let mut tracker = Tracker::new(&options, None, record.sample_time()).unwrap();
    // With a start that is not a fit, no parameter is determined at first.
    assert_ne!(tracker.verdict_level(&tracker.operator()), VerdictLevel::Trustworthy);
    let default = TrackOptions::default_for(physical(), 29);
    let mut known = Tracker::new(&default, Some(&record), record.sample_time()).unwrap();
    for (e, u) in record.input().iter().zip(record.output()) {
        tracker.step(*e, *u);
        known.step(*e, *u);
    }
    let mut operator = known.operator().unwrap();
    assert_eq!(known.verdict_level(&Ok(operator)), VerdictLevel::Trustworthy);
    operator.zeta_nm.value = 4.0;
    assert_eq!(known.verdict_level(&Ok(operator)), VerdictLevel::Doubtful);
    for gain in [&mut operator.k_e, &mut operator.k_e_dot] {
        gain.standard_error = Some(gain.value.abs());
    }
    assert_eq!(known.verdict_level(&Ok(operator)), VerdictLevel::NotDetermined);
    assert_eq!(
        known.verdict_level(&Err(NotConvertible::ZeroGain)),
        VerdictLevel::Doubtful
    );
}
