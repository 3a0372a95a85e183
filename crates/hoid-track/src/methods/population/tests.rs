//! On simulated people whose operator is a gain and a lead, which is in the span of the basis.
#![allow(clippy::unwrap_used)]

use hoid_model::{
    Record,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};

use super::*;
use crate::{Method, TrackOptions, Tracker, track};

fn record(condition: Condition) -> Record {
    let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
    simulator.run(RunSeed::default(), false).unwrap()
}

fn options() -> TrackOptions {
    TrackOptions::usual(Method::population(), 29)
}

#[test]
fn it_starts_without_a_fit_and_finds_a_steady_person() {
    let record = record(Condition::C1);
    let trace = track(&record, &options(), 100).unwrap();
    assert!(trace.start().is_none());
    // There is an estimate from the second second on.
    assert!(trace.operator(2).is_ok() && trace.covariance(2).is_some());
    let last = trace.operator(trace.len() - 1).unwrap();
    let [k_e, k_e_dot] = [0.09, 0.036];
    assert!((last.k_e.value - k_e).abs() < 0.02, "{last:?}");
    assert!((last.k_e_dot.value - k_e_dot).abs() < 0.012, "{last:?}");
    assert!(last.k_e.standard_error.unwrap() < 0.02);
    assert!(trace.changes().is_empty(), "{:?}", trace.changes());
}

#[test]
fn a_change_of_the_person_is_followed() {
    let trace = track(&record(Condition::C4), &options(), 100).unwrap();
    let last = trace.operator(trace.len() - 1).unwrap();
    assert!((last.k_e_dot.value - 0.084).abs() < 0.02, "{last:?}");
}

#[test]
fn responses_have_bands_from_the_first_second_on() {
    let record = record(Condition::C1);
    let mut tracker = Tracker::new(&options(), None, record.sample_time()).unwrap();
    let mut widths = Vec::new();
    for k in 0..record.len() {
        tracker.step(record.input()[k], record.output()[k]);
        if k < 90 {
            assert!(tracker.response(2.0).is_none());
        }
        if [150, 1000, 8000].contains(&k) {
            let response = tracker.response(2.0).unwrap();
            assert!(response.gain_db().value.is_finite() && response.phase_deg().value.is_finite());
            widths.push(response.gain_db().standard_error.unwrap());
        }
    }
    assert!(widths[0] > widths[1] && widths[1] > widths[2], "{widths:?}");
}

#[test]
fn options_that_make_no_sense_are_refused() {
    assert!(Method::population().with("false_alarms", "0").is_err());
    let mut refused = options();
    refused.orders.nd = 25;
    assert!(refused.check().unwrap_err().to_string().contains("at most 24"));
    refused = options();
    refused.start = StartAt::Theta(vec![0.0; 20]);
    assert!(refused.check().is_err());
    let rare = PopulationOptions {
        false_alarms: 0.5,
        ..PopulationOptions::default()
    };
    assert!(rare.threshold() > PopulationOptions::default().threshold());
}
