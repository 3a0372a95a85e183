//! The guard, with every method that may have one.
#![allow(clippy::unwrap_used)]

use hoid_model::{
    Record, SampleTime,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};

use hoid_survey::{methods, multiple_model, physical};
use hoid_track::{
    GuardAction, GuardEvent, GuardKind, Method, Outcome, StartSource, Trace, TrackOptions, Tracker, track,
};

fn record(seed: u64) -> Record {
    let seed = RunSeed {
        seed,
        ..RunSeed::default()
    };
    let scenario = Scenario::condition(Condition::C1);
    Simulator::new(&scenario).unwrap().run(seed, false).unwrap()
}

fn options(method: Method, guard: &str) -> TrackOptions {
    let (structure, orders) = (method.default_structure(), method.default_orders(29));
    TrackOptions::new(method, structure, orders)
        .with(&[("guard", guard)])
        .unwrap()
}

fn tracker(options: &TrackOptions, record: &Record) -> Tracker {
    let span = record.span(0.0, 25.0).unwrap();
    Tracker::new(options, Some(&span), record.sample_time()).unwrap()
}

const GUARDED_METHODS: [fn() -> Method; 5] = [physical, multiple_model, Method::adaptive, Method::rls, Method::rpem];

#[test]
fn inactive_guard_changes_no_digit() {
    for method in GUARDED_METHODS {
        for seed in 0..3 {
            let record = record(seed);
            let with = track(&record, &options(method(), "yes"), 16).unwrap();
            let without = track(&record, &options(method(), "no"), 16).unwrap();
            assert!(with.is_guarded() && !without.is_guarded());
            assert_eq!(with.faults(), [], "{}", method());
            // The numbers are compared as bits, because there is no estimate (NaN) before the start.
            let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<u64>>();
            for row in 0..with.len() {
                assert_eq!(with.theta(row), without.theta(row), "{}", method());
                let covariance = |trace: &Trace| trace.covariance(row).as_deref().map(bits);
                assert_eq!(covariance(&with), covariance(&without));
            }
            assert_eq!(with.innovation(), without.innovation());
            assert_eq!(with.changes(), without.changes());
        }
    }
}

#[test]
fn operator_methods_are_guarded_by_default() {
    for method in methods() {
        let expected = ["physical", "multiple-model", "adaptive"].contains(&method.name());
        assert_eq!(method.is_guarded(), expected, "{method}");
    }
    assert!(Method::rpem().with("guard", "yes").unwrap().is_guarded());
    assert!(Method::rpem().with("guard", "perhaps").is_err());
}

/// A permanent jump: after the time in which the guard waits for a return, all numbers equal those without a guard.
#[test]
fn permanent_jump_leaves_the_result_unchanged_after_the_wait() {
    let record = record(5);
    for method in [physical(), multiple_model()] {
        let mut with = tracker(&options(method.clone(), "yes"), &record);
        let mut without = tracker(&options(method, "no"), &record);
        let mut accepted = 0;
        for k in 0..6000 {
            let jump = if k >= 5000 { 2.0 } else { 0.0 };
            let (e, u) = (record.input()[k] + jump, record.output()[k]);
            let found = with.step(e, u);
            let plain = without.step(e, u);
            // A step in the target is not reported.
            assert_eq!(with.event(), None);
            if found.held {
                accepted = k + 1;
            }
            if !(5000..=accepted.max(5010)).contains(&k) {
                assert_eq!(found, plain, "{k}");
                assert_eq!(with.theta(), without.theta(), "{k}");
            }
        }
        assert_eq!(accepted, 5010);
        assert_eq!(with.covariance(), without.covariance());
    }
}

/// Faulty input: e and u of sample k, with faults from sample 4000 on.
fn faulty_input(record: &Record, k: usize) -> (f64, f64) {
    let (e, u) = (record.input()[k], record.output()[k]);
    match k {
        4000 => (100.0, u),
        4100..=4105 => (e, u + 10.0),
        4106..4300 => (e, f64::NAN),
        4800..5200 => (1e5 * e, 1e5 * u),
        5700..6000 => (record.input()[5700], u),
        _ => (e, u),
    }
}

#[test]
fn restored_guard_is_bit_identical() {
    let record = record(6);
    for method in GUARDED_METHODS {
        let options = options(method(), "yes");
        // Stops are within an outlier, a gap and a pause, and after the pause.
        for stop in [3000, 4102, 4200, 4900, 5300, 5900] {
            let mut first = tracker(&options, &record);
            (0..stop).for_each(|k| {
                let (e, u) = faulty_input(&record, k);
                first.step(e, u);
            });
            let numbers = first.save();
            let mut second = Tracker::restore(&options, record.sample_time(), &numbers).unwrap();
            assert_eq!(first.is_paused(), second.is_paused());
            for k in stop..6700 {
                let (e, u) = faulty_input(&record, k);
                // An innovation is never NaN, so outcomes can be compared.
                let of =
                    |tracker: &mut Tracker| -> (Outcome, Option<GuardEvent>) { (tracker.step(e, u), tracker.event()) };
                assert_eq!(of(&mut first), of(&mut second), "{} at {k}", method());
            }
            assert_eq!(first.theta(), second.theta());
            assert_eq!(first.counts(), second.counts());
            assert!(Tracker::restore(&options, record.sample_time(), &numbers[1..]).is_err());
        }
    }
}

#[test]
fn faults_and_actions_are_reported_with_their_times() {
    let record = record(6);
    let mut tracker = tracker(&options(physical(), "yes"), &record);
    let mut reported = Vec::new();
    for k in 0..record.len() {
        let (e, u) = faulty_input(&record, k);
        let outcome = tracker.step(e, u);
        assert_eq!(outcome.innovation.is_none(), outcome.held || outcome.skipped, "{k}");
        if let Some(event) = tracker.event() {
            reported.push((event.kind, event.action, k as u64 - event.ago, event.samples));
        }
    }
    use {GuardAction as A, GuardKind as K};
    assert_eq!(reported[0], (K::Outlier, A::Held, 4000, 1));
    // The faults are a gap, a span with a wrong scale, and a frozen span.
    let of = |kind: K, action: A| reported.iter().find(|t| (t.0, t.1) == (kind, action));
    assert!(of(K::Missing, A::Resumed).is_some(), "{reported:?}");
    let level = of(K::Level, A::Restarted).unwrap();
    assert!(level.2.abs_diff(4800) <= 12 && level.3 >= 400, "{reported:?}");
    assert!(of(K::Frozen, A::Restarted).is_some(), "{reported:?}");
    let counts = tracker.counts();
    assert_eq!(counts.restarts, 2, "{reported:?}");
    assert!(counts.held > 700 && counts.skipped > 190, "{counts:?}");
    assert!(!tracker.is_paused() && tracker.time_since_restart_s().is_some());
}

#[test]
fn estimates_stay_finite_for_any_stream() {
    let streams: [fn(usize) -> (f64, f64); 6] = [
        |_| (0.0, 0.0),
        |_| (f64::NAN, f64::NAN),
        |_| (3.0, -2.0),
        |k| if k % 2 == 0 { (1e300, -1e300) } else { (-1e5, 1e5) },
        |k| (10.0_f64.powi((k % 30) as i32 - 15), f64::NAN),
        |k| {
            (
                (k as f64 * 0.37).sin(),
                if k % 3 == 0 { f64::INFINITY } else { (k as f64).cos() },
            )
        },
    ];
    let record = record(7);
    for method in [physical(), Method::rpem()] {
        for stream in streams {
            let known = tracker(&options(method.clone(), "yes"), &record);
            let nothing = TrackOptions {
                start: StartSource::Nothing,
                ..options(method.clone(), "yes")
            };
            let unknown = Tracker::new(&nothing, None, SampleTime::AT_100_HZ).unwrap();
            for mut tracker in [known, unknown] {
                for k in 0..20_000 {
                    let (e, u) = stream(k);
                    tracker.step(e, u);
                }
                assert!(tracker.theta().iter().all(|t| t.is_finite()), "{method}");
                assert!(tracker.innovation_variance().is_finite(), "{method}");
                // The tracker recovers: the following run is tracked.
                let before = tracker.counts();
                (0..record.len()).for_each(|k| {
                    tracker.step(record.input()[k], record.output()[k]);
                });
                assert!(tracker.counts().held - before.held < record.len() as u64 / 2 || tracker.is_paused());
                assert!(tracker.theta().iter().all(|t| t.is_finite()), "{method}");
            }
        }
    }
}
