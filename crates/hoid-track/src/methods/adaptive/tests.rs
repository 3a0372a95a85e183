//! Tests on simulated people whose operator is a gain and a lead, which the basis contains.
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
    TrackOptions::default_for(Method::adaptive(), 29)
}

#[test]
fn constant_operator_is_found_without_a_starting_fit() {
    let record = record(Condition::C1);
    let trace = track(&record, &options(), 100).unwrap();
    assert!(trace.start().is_none());
    // The estimate starts in the second second.
    assert!(trace.operator(2).is_ok() && trace.covariance(2).is_some());
    let last = trace.operator(trace.len() - 1).unwrap();
    let [k_e, k_e_dot] = [0.09, 0.036];
    assert!((last.k_e.value - k_e).abs() < 0.02, "{last:?}");
    assert!((last.k_e_dot.value - k_e_dot).abs() < 0.012, "{last:?}");
    assert!(last.k_e.standard_error.unwrap() < 0.02);
    assert!(trace.changes().is_empty(), "{:?}", trace.changes());
}

#[test]
fn change_of_the_operator_is_tracked() {
    let trace = track(&record(Condition::C4), &options(), 100).unwrap();
    let last = trace.operator(trace.len() - 1).unwrap();
    assert!((last.k_e_dot.value - 0.084).abs() < 0.02, "{last:?}");
}

/// The mean ratio of the estimated to the true T_L, from 9 s after a change on and over four runs, is near one. A
/// single quotient with the covariance of all hypotheses gave .76.
#[test]
fn lead_after_a_change_is_unbiased() {
    let simulator = Simulator::new(&Scenario::condition(Condition::C4)).unwrap();
    let (mut sum, mut rows) = (0.0, 0.0);
    for replication in 0..4 {
        let seed = RunSeed {
            seed: 460,
            cell: 0,
            replication,
        };
        let record = simulator.run(seed, false).unwrap();
        let truth = record.channel("T_L").unwrap();
        let trace = track(&record, &options(), 100).unwrap();
        for row in 0..trace.len() {
            let k = 100 * row;
            if record.time_s(k) >= 50.0 {
                sum += trace.operator(row).unwrap().t_l_s.value / truth[k];
                rows += 1.0;
            }
        }
    }
    let over_truth = sum / rows;
    assert!((over_truth - 1.0).abs() < 0.08, "{over_truth}");
}

#[test]
fn lead_is_finite_for_zero_output() {
    let mut tracker = Tracker::new(&options(), None, SampleTime::AT_100_HZ).unwrap();
    for k in 0..400 {
        tracker.step((0.07 * f64::from(k)).sin(), 0.0);
    }
    if let Ok(operator) = tracker.operator() {
        let lead = operator.rows()[1].2;
        assert!(
            lead.value.is_finite() && lead.standard_error.unwrap().is_finite(),
            "{lead:?}"
        );
    }
}

#[test]
fn response_has_bands_after_the_first_second() {
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
fn invalid_options_are_refused() {
    assert!(Method::adaptive().with("false_alarms", "0").is_err());
    let mut refused = options();
    refused.orders.nd = 25;
    assert!(refused.check().unwrap_err().to_string().contains("at most 24"));
    refused = options();
    refused.start = StartSource::Theta(vec![0.0; 20]);
    assert!(refused.check().is_err());
}

#[test]
fn trace_contains_gain_and_phase_with_bands() {
    let record = record(Condition::C1);
    let at_rad_s = vec![1.0, 2.5];
    for method in [Method::adaptive(), Method::rls()] {
        let default = TrackOptions {
            at_rad_s: at_rad_s.clone(),
            ..TrackOptions::default_for(method, 29)
        };
        let trace = track(&record, &default, 512).unwrap();
        let span = default
            .start_span(&record)
            .and_then(|(from, to)| record.span(from, to).ok());
        let mut tracker = Tracker::new(&default, span.as_ref(), record.sample_time()).unwrap();
        for k in 0..record.len() {
            let sample = Sample {
                e: record.input()[k],
                u: record.output()[k],
                reference: None,
            };
            tracker.update(sample, record.time_s(k) >= trace.updated_from_s() - 0.005);
        }
        let columns = trace.estimate_columns(&trace.operators());
        let of = |name: &str| columns.iter().find(|(n, _)| n == name).unwrap().1.clone();
        for omega in &at_rad_s {
            let told = tracker.response(*omega).unwrap();
            for (name, expected) in [("gain_db", told.gain_db()), ("phase_deg", told.phase_deg())] {
                let (values, errors) = (of(&format!("{name}@{omega}")), of(&format!("{name}@{omega}_se")));
                assert_eq!(values.len(), trace.len());
                assert!(
                    (values[trace.len() - 1] - expected.value).abs() < 1e-9,
                    "{name} {omega}"
                );
                assert!((errors[trace.len() - 1] - expected.standard_error.unwrap()).abs() < 1e-9);
            }
        }
        assert!(trace.response(0, 2).is_none());
        let averaged = trace.clone().moving_average(2);
        let (a, b) = (trace.response(9, 0).unwrap(), trace.response(10, 0).unwrap());
        let mean = averaged.response(10, 0).unwrap();
        if default.method == Method::adaptive() {
            assert!((mean.value[0] - 0.5 * (a.value[0] + b.value[0])).abs() < 1e-12);
        }
        assert!(mean.covariance[0][0] > 0.0);
    }
    let refused = TrackOptions {
        at_rad_s: vec![0.0],
        ..options()
    };
    assert!(refused.check().unwrap_err().to_string().contains("rad/s"));
}
