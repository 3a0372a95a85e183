//! A start with the operator of the grey box keeps the requested noise model.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;

use hoid_ident::Constraint;
use hoid_model::{
    Record, SampleTime,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};
use hoid_survey::MultipleModelOptions;
use hoid_track::{TrackOptions, Tracker};

fn start_span() -> Record {
    let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
    simulator
        .run(RunSeed::default(), false)
        .unwrap()
        .span(0.0, 30.0)
        .unwrap()
}

/// Bounds that the Box-Jenkins fit cannot satisfy lead to the grey box.
fn options_outside_bounds() -> TrackOptions {
    let mut own = MultipleModelOptions::default();
    own.bounds.bound = BTreeMap::from([("omega_nm".to_owned(), Constraint::Between(20.0, 30.0))]);
    TrackOptions::default_for(own.into(), 29)
}

#[test]
fn start_outside_the_bounds_keeps_the_noise_order() {
    let (span, options) = (start_span(), options_outside_bounds());
    let tracker = Tracker::new(&options, Some(&span), SampleTime::AT_100_HZ).unwrap();
    let names = tracker.parameter_names();
    let d: Vec<f64> = names
        .iter()
        .zip(tracker.theta())
        .filter(|(name, _)| name.starts_with('d'))
        .map(|(_, d)| *d)
        .collect();
    assert_eq!(d.len(), 6);
    assert!(d.iter().skip(1).any(|d| d.abs() > 0.02), "{d:?}");
    // The innovations of the first samples have the variance of the start fit.
    let fit = tracker.start().unwrap();
    assert!(tracker.innovation_variance() <= fit.innovation_variance() * 1.001);
}
