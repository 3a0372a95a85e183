//! Trackers at sample times from a microsecond to days: each either accepts its samples, or is rejected with a message
//! that contains the sample time and the remedy.
#![allow(clippy::unwrap_used)]

use hoid_ident::{IdentError, NamedOrders, order_selection::Criterion};
use hoid_model::{Channel, Record, SampleTime};
use hoid_track::{Method, StartSource, TrackOptions, TrackPlan, Tracker, search_ranges};

const MAX_SAMPLE_TIME_S: f64 = std::f64::consts::PI;

fn sample_times() -> impl Iterator<Item = f64> {
    (-24..=24).map(|quarter| 10_f64.powf(f64::from(quarter) / 4.0))
}

/// Returns two sums of sines with a lag between them, which suffice as input.
fn signals(k: usize) -> (f64, f64) {
    let x = k as f64;
    (
        (0.3 * x).sin() + (0.071 * x).cos(),
        (0.3 * x - 0.6).sin() + 0.4 * (0.071 * x).cos(),
    )
}

fn options_with_all_starts(options: &TrackOptions) -> Vec<TrackOptions> {
    let of = |start: StartSource| TrackOptions {
        start,
        ..options.clone()
    };
    let p = options.orders.parameter_names().len();
    vec![
        of(StartSource::Span(None)),
        of(StartSource::Nothing),
        of(StartSource::Theta(vec![0.1; p])),
    ]
}

fn is_expected_refusal(error: &IdentError, ts: f64) -> bool {
    let text = error.to_string();
    text.contains("sample time of a tracker") && text.contains(&format!("{ts} s")) && text.contains("ms")
}

#[test]
fn too_long_sample_times_are_refused() {
    for method in hoid_survey::methods() {
        for ts in sample_times() {
            let sample_time = SampleTime::new(ts).unwrap();
            for options in options_with_all_starts(&TrackOptions::without_prior(method.clone(), sample_time)) {
                let made = Tracker::new(&options, None, sample_time);
                if ts >= MAX_SAMPLE_TIME_S {
                    assert!(is_expected_refusal(&made.unwrap_err(), ts), "{method} at {ts} s");
                    continue;
                }
                let Ok(mut tracker) = made else { continue };
                for k in 0..300 {
                    let (e, u) = signals(k);
                    tracker.step(e, u);
                }
                assert_eq!(tracker.counts().samples, 300);
                let _ = (tracker.operator(), tracker.response(1.0), tracker.open_loop());
            }
        }
    }
}

#[test]
fn too_long_sample_times_are_refused_in_plans() {
    for ts in sample_times().filter(|ts| *ts >= MAX_SAMPLE_TIME_S) {
        let sample_time = SampleTime::new(ts).unwrap();
        let (e, u) = (0..400).map(signals).unzip();
        let record = Record::new(sample_time, Channel::new("e", "", e), Channel::new("u", "", u)).unwrap();
        for method in hoid_survey::methods() {
            let options = TrackOptions::default_for(method.clone(), 2);
            let made = Tracker::new(&options, Some(&record), sample_time);
            assert!(is_expected_refusal(&made.unwrap_err(), ts), "{method} at {ts} s");
            let ranges = search_ranges(&method, options.structure, &NamedOrders::new(), &[], sample_time).unwrap();
            let planned = TrackPlan::new(options, ranges, Criterion::Bic, sample_time);
            assert!(is_expected_refusal(&planned.unwrap_err(), ts), "{method} at {ts} s");
        }
    }
}

/// Below a microsecond, the memory of a tracker would contain billions of samples.
#[test]
fn every_method_refuses_sample_times_below_a_microsecond() {
    for method in hoid_survey::methods() {
        for ts in [9e-7, 1e-12, f64::MIN_POSITIVE] {
            let sample_time = SampleTime::new(ts).unwrap();
            for options in options_with_all_starts(&TrackOptions::without_prior(method.clone(), sample_time)) {
                let error = Tracker::new(&options, None, sample_time).unwrap_err().to_string();
                assert!(error.contains("sample time of a tracker"), "{method}: {error}");
            }
        }
    }
}

#[test]
fn default_method_accepts_common_sample_times() {
    for ts in [0.001, 0.01, 1.0 / 60.0, 0.1] {
        let sample_time = SampleTime::new(ts).unwrap();
        let options = TrackOptions::without_prior(Method::default(), sample_time);
        assert!(Tracker::new(&options, None, sample_time).is_ok(), "{ts}");
    }
}
