//! Rests, frozen channels and a constant error, which last 10 s to 1000 s: without information, no error bar decreases.
#![allow(clippy::unwrap_used)]

use hoid_model::{
    Channel, Record,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};
use hoid_track::{GuardKind, Method, Sample, TrackOptions, Tracker, track};

const DELAY_SAMPLES: usize = 29;
/// Duration of tracking before the rest, s.
const TRACKING_S: f64 = 41.0;

fn record(condition: Condition) -> Record {
    let seed = RunSeed {
        seed: 7,
        ..RunSeed::default()
    };
    Simulator::new(&Scenario::condition(condition))
        .unwrap()
        .run(seed, false)
        .unwrap()
}

/// Duration (in s) of the response to a step in e, including the second in which its end is detected.
const RESPONSE_S: f64 = 4.0;

/// Kind of constant signals.
#[derive(Debug, Clone, Copy, PartialEq)]
enum ConstantSpan {
    /// e and u are zero.
    Rest,
    /// e and u are nearly zero, with the noise of a sensor.
    Noise,
    FrozenE,
    FrozenU,
    Frozen,
    /// e is constant, and u is e multiplied by the gain of the person.
    ConstantE,
}

impl ConstantSpan {
    fn sample(self, before: &Sample, now: &Sample, k: usize) -> Sample {
        let noise = |seed: f64| 1e-5 * (k as f64 * 12.9898 + seed).sin() * (k as f64 * 0.7).cos();
        let (e, u) = match self {
            Self::Rest => (0.0, 0.0),
            Self::Noise => (noise(0.0), noise(1.0)),
            Self::FrozenE => (before.e, now.u),
            Self::FrozenU => (now.e, before.u),
            Self::Frozen => (before.e, before.u),
            Self::ConstantE => {
                let gone = (k as f64 - 28.0).max(0.0) * 0.01;
                (0.3, 0.03 * (1.0 - (-3.0 * gone).exp()))
            }
        };
        Sample { e, u, reference: None }
    }
}

fn error_bars(tracker: &Tracker) -> Vec<(String, f64)> {
    let names = tracker.parameter_names();
    let theta = names.into_iter().zip(tracker.parameters());
    let theta = theta.map(|(name, estimate)| (name, estimate.standard_error.unwrap_or(0.0)));
    let operator = tracker.operator().ok();
    let operator = operator.iter().flat_map(|operator| operator.rows());
    let operator = operator.map(|(name, _, estimate)| (name.to_owned(), estimate.standard_error.unwrap_or(0.0)));
    theta.chain(operator.collect::<Vec<_>>()).collect()
}

/// Largest age of the numbers that a guard restores, s.
const GUARD_MEMORY_S: f64 = 10.0;

/// Keeps the smaller of both error bars for each parameter.
fn keep_smallest(of: &mut [(String, f64)], others: Vec<(String, f64)>) {
    for ((_, one), (_, other)) in of.iter_mut().zip(others) {
        *one = one.min(other);
    }
}

/// Returns a tracker after the constant span, and the error bars before this span. A guard may restore earlier numbers,
/// so these are the smallest error bars that it may have kept.
fn track_through_constant_span(
    options: &TrackOptions,
    record: &Record,
    span_kind: ConstantSpan,
    length_s: f64,
) -> (Tracker, Vec<(String, f64)>) {
    let goes_back = match options.method.name() {
        // This method learns from the first sample on, and its error bars vary with time.
        "adaptive" => true,
        "multiple-model" | "physical" => span_kind == ConstantSpan::FrozenU,
        _ => false,
    };
    let ts = record.sample_time().s();
    let first = (TRACKING_S / ts) as usize;
    let span = record.span(0.0, 20.0).unwrap();
    let mut tracker = Tracker::new(options, Some(&span), record.sample_time()).unwrap();
    let at = |k: usize| Sample {
        e: record.input()[k % record.len()],
        u: record.output()[k % record.len()],
        reference: None,
    };
    let mut kept: Option<Vec<(String, f64)>> = None;
    for k in 0..first {
        tracker.update(at(k), options.method.is_self_starting() || k as f64 * ts >= 20.0);
        if goes_back && (k as f64 * ts) >= TRACKING_S - GUARD_MEMORY_S {
            keep_smallest(kept.get_or_insert_with(|| error_bars(&tracker)), error_bars(&tracker));
        }
    }
    let (mut initial_bars, before) = (kept.unwrap_or_else(|| error_bars(&tracker)), at(first - 1));
    let mut reported = Vec::new();
    for k in 0..(length_s / ts) as usize {
        // After a step in e, the response contains information as long as it is not constant.
        if span_kind == ConstantSpan::ConstantE && k as f64 * ts <= RESPONSE_S {
            initial_bars = error_bars(&tracker);
        }
        tracker.update(span_kind.sample(&before, &at(first + k), k), true);
        reported.extend(tracker.event().map(|event| event.kind));
    }
    assert!(
        reported
            .iter()
            .any(|kind| matches!(kind, GuardKind::Idle | GuardKind::Frozen)),
        "{:?} {span_kind:?} is not told: {reported:?}",
        options.method.name()
    );
    (tracker, initial_bars)
}

fn all_options() -> Vec<TrackOptions> {
    let mut all: Vec<TrackOptions> = hoid_survey::methods()
        .into_iter()
        .map(|method| TrackOptions::default_for(method, DELAY_SAMPLES))
        .collect();
    all.extend(TrackOptions::default_for(Method::adaptive(), DELAY_SAMPLES).with(&[("replay", "0")]));
    for (name, text) in [
        ("memory", "100"),
        ("forgetting", "directional"),
        ("forgetting", "variable"),
    ] {
        for method in [Method::rls(), Method::rpem()] {
            all.extend(TrackOptions::default_for(method, DELAY_SAMPLES).with(&[(name, text)]));
        }
    }
    all
}

fn assert_no_bar_shrinks(span_kind: ConstantSpan, lengths_s: &[f64]) {
    let record = record(Condition::C1);
    for options in all_options() {
        for length in lengths_s {
            let (tracker, initial_bars) = track_through_constant_span(&options, &record, span_kind, *length);
            let end = error_bars(&tracker);
            assert_eq!(initial_bars.len(), end.len());
            for ((name, before), (_, after)) in initial_bars.iter().zip(&end) {
                assert!(
                    *after >= before * (1.0 - 1e-9),
                    "{}: {span_kind:?} of {length} s, {name} from {before:e} to {after:e}",
                    options.method.name()
                );
            }
        }
    }
}

#[test]
fn no_error_bar_shrinks_through_rests() {
    assert_no_bar_shrinks(ConstantSpan::Rest, &[10.0, 100.0]);
}

#[test]
fn no_error_bar_shrinks_through_rests_with_sensor_noise() {
    assert_no_bar_shrinks(ConstantSpan::Noise, &[10.0, 100.0]);
}

#[test]
fn no_error_bar_shrinks_through_a_frozen_error() {
    assert_no_bar_shrinks(ConstantSpan::FrozenE, &[10.0, 100.0]);
}

#[test]
fn no_error_bar_shrinks_through_a_frozen_output() {
    assert_no_bar_shrinks(ConstantSpan::FrozenU, &[10.0, 100.0]);
}

#[test]
fn no_error_bar_shrinks_through_two_frozen_channels() {
    assert_no_bar_shrinks(ConstantSpan::Frozen, &[10.0, 100.0]);
}

#[test]
fn no_error_bar_shrinks_through_a_constant_error() {
    assert_no_bar_shrinks(ConstantSpan::ConstantE, &[10.0, 100.0]);
}

#[test]
fn tracking_resumes_after_a_long_rest() {
    let record = record(Condition::C1);
    for options in all_options() {
        let (mut tracker, initial_bars) = track_through_constant_span(&options, &record, ConstantSpan::Rest, 1000.0);
        for ((name, before), (_, after)) in initial_bars.iter().zip(error_bars(&tracker)) {
            assert!(after >= before * (1.0 - 1e-9), "{}: {name}", options.method.name());
        }
        let theta = tracker.theta().to_vec();
        let first = (TRACKING_S / record.sample_time().s()) as usize;
        for k in first..record.len() {
            tracker.step(record.input()[k], record.output()[k]);
        }
        assert!(
            !tracker.is_paused() && tracker.theta() != theta,
            "{}",
            options.method.name()
        );
        // The error bars must not decrease to a hundredth after a few seconds of information.
        for ((name, before), (_, after)) in initial_bars.iter().zip(error_bars(&tracker)) {
            assert!(
                after >= 0.05 * before,
                "{}: {name} {before:e} {after:e}",
                options.method.name()
            );
        }
    }
}

/// In a record with a rest, the trace reports the time without information; without a rest, it reports none.
#[test]
fn time_without_excitation_is_reported() {
    let whole = record(Condition::C1);
    let rest = |signal: &[f64]| {
        let (head, tail) = signal.split_at(4100);
        [head, &[0.0; 3000], tail].concat()
    };
    let channel = |name: &str, values: Vec<f64>| Channel::new(name, "", values);
    let with_rest = Record::new(
        whole.sample_time(),
        channel("e", rest(whole.input())),
        channel("u", rest(whole.output())),
    )
    .unwrap();
    for method in [
        Method::rls(),
        Method::rpem(),
        hoid_survey::rriv(),
        hoid_survey::window(),
        hoid_survey::fused(),
    ] {
        let options = TrackOptions::default_for(method.clone(), DELAY_SAMPLES);
        let trace = track(&with_rest, &options, 50).unwrap();
        let said = trace.verdict(&with_rest, None).unwrap();
        let said: Vec<&str> = said.reasons().collect();
        assert!(
            said.iter().any(|words| words.contains("idle in e, u at 41")),
            "{method}: {said:?}"
        );
        assert_eq!(track(&whole, &options, 50).unwrap().faults(), [], "{method}");
    }
    let as_it_comes = TrackOptions::default_for(Method::rls(), DELAY_SAMPLES)
        .with(&[("guard", "no")])
        .unwrap();
    assert_eq!(track(&with_rest, &as_it_comes, 50).unwrap().faults(), []);
}
