//! The delay that `rpem` tracks in whole samples.

#![allow(clippy::unwrap_used)]

use hoid_model::{
    Channel, Record, SampleTime, Structure,
    scenario::{Condition, RemnantStrength, Scenario},
    schedule::Schedule,
};
use hoid_sim::{RunSeed, Simulator};
use hoid_track::{Method, StartSource, TrackOptions, track};

const NK: usize = 29;
const CHANGE_S: f64 = 40.96;

/// C1 with a delay of .28 s until 40.96 s, and with another delay from then on.
fn run(after_s: f64, noise_level: f64) -> Record {
    let mut scenario = Scenario::condition(Condition::C1);
    scenario.last.operator.tau_e_s = after_s;
    scenario.schedule = Schedule::Sigmoid {
        rate_per_s: 100.0,
        midpoint_s: CHANGE_S,
    };
    if let RemnantStrength::Level { level, .. } = &mut scenario.remnant.strength {
        *level = noise_level;
    }
    let seed = RunSeed {
        seed: 47,
        ..RunSeed::default()
    };
    Simulator::new(&scenario).unwrap().run(seed, false).unwrap()
}

fn options(range: Option<&str>) -> TrackOptions {
    let options = TrackOptions {
        start: StartSource::Span(Some((0.0, 30.72))),
        at_rad_s: vec![2.5],
        ..TrackOptions::default_for(Method::rpem(), NK)
    };
    match range {
        Some(range) => options.with(&[("track_delay", range)]).unwrap(),
        None => options,
    }
}

#[test]
fn range_of_one_delay_is_the_fixed_delay_recursion() {
    let record = run(0.28, 0.1);
    let given = track(&record, &options(None), 8).unwrap();
    let tracked = track(&record, &options(Some("0.28..0.28")), 8).unwrap();
    for k in 0..given.len() {
        assert_eq!(given.theta(k), tracked.theta(k), "{k}");
        assert_eq!(given.response(k, 0), tracked.response(k, 0));
    }
    let operator = tracked.operator(tracked.len() - 1).unwrap();
    assert!((operator.tau_e_s.value - 0.28).abs() < 1e-12);
    // The delay may have any value between two samples.
    assert!((operator.tau_e_s.standard_error.unwrap() - 0.01 / 12f64.sqrt()).abs() < 1e-12);
    assert!(tracked.operator_columns().contains(&"tau_e"));
    assert!(!given.operator_columns().contains(&"tau_e"));
}

#[test]
fn changing_and_constant_delays_are_tracked() {
    for (after_s, seconds, most) in [(0.28, 0.0, 0.02), (0.34, 15.0, 0.02), (0.22, 15.0, 0.02)] {
        let record = run(after_s, 0.1);
        let trace = track(&record, &options(Some("0.2..0.4")), 8).unwrap();
        for (row, t) in trace
            .times_s()
            .iter()
            .enumerate()
            .filter(|(_, t)| **t > CHANGE_S + seconds)
        {
            let Ok(operator) = trace.operator(row) else { continue };
            let off = (operator.tau_e_s.value - after_s).abs();
            assert!(off <= most, "{after_s}: {off} at {t} s");
        }
        let last = trace.len() - 1;
        let k_e = trace.operator(last).unwrap().k_e.value;
        assert!((k_e / 0.09 - 1.0).abs() < 0.35, "{after_s}: K_e {k_e}");
        // The response is computed from the polynomials with the delay of the row.
        let truth = record.channel("tau_e").unwrap()[record.len() - 1];
        let other = track(&record, &options(None), 8).unwrap();
        let phase = |of: &hoid_track::Trace| of.response(last, 0).unwrap().phase_deg().value;
        let expected = true_phase_deg(&record);
        let off = |phase: f64| (phase - expected + 180.0).rem_euclid(360.0) - 180.0;
        assert!(
            off(phase(&trace)).abs() < 8.0,
            "{truth}: {} for {expected}",
            phase(&trace)
        );
        assert!(off(phase(&trace)).abs() < off(phase(&other)).abs() + 4.0);
    }
}

/// `physical` shifts B along the input as tau_e increases; its response changes accordingly.
#[test]
fn physical_response_has_the_delay_of_its_row() {
    let record = run(0.34, 0.1);
    let physical = TrackOptions {
        start: StartSource::Span(Some((0.0, 30.72))),
        at_rad_s: vec![2.5],
        ..TrackOptions::default_for(hoid_survey::physical(), NK)
    };
    // The memory is short enough for the delay to change.
    let options = physical
        .with(&[("track_delay", "0.2..0.4"), ("memory_of", "tau_e=5s")])
        .unwrap();
    let trace = track(&record, &options, 8).unwrap();
    let last = trace.len() - 1;
    let (tau, phase) = (
        trace.operator(last).unwrap().tau_e_s.value,
        trace.response(last, 0).unwrap().phase_deg().value,
    );
    // The value belongs to the operator of the row, and not to the delay of the start fit.
    let found = trace.operator(last).unwrap();
    let square = found.omega_nm_rad_s.value.powi(2);
    let lead = (2.5 * found.t_l_s.value).atan();
    let lag = (2.0 * found.zeta_nm.value * found.omega_nm_rad_s.value * 2.5).atan2(square - 6.25);
    let expected = (lead - lag - 2.5 * (tau + 0.005)).to_degrees();
    assert!((phase - expected).abs() < 0.05, "{phase} for {expected}, tau_e {tau}");
    assert!((tau - 0.28).abs() > 0.02, "the delay has moved: {tau}");
}

/// Returns the phase of the true operator of the last sample at 2.5 rad/s, including its hold.
fn true_phase_deg(record: &Record) -> f64 {
    let of = |name: &str| record.channel(name).unwrap()[record.len() - 1];
    let (omega, square) = (2.5_f64, of("omega_nm").powi(2));
    let lead = (omega * of("T_L")).atan();
    let lag = (2.0 * of("zeta_nm") * of("omega_nm") * omega).atan2(square - omega * omega);
    let delay = omega * (of("tau_e") + 0.5 * record.sample_time().s());
    (lead - lag - delay).to_degrees()
}

#[test]
fn estimates_stay_finite_without_excitation() {
    let n = 3000;
    let wave = |k: usize| (0.05 * k as f64).sin() + 0.5 * (0.13 * k as f64).cos();
    let noise = |k: usize| 0.01 * (1.7 * (k * k) as f64).sin();
    let e: Vec<f64> = (0..n).map(|k| if k < 1500 { wave(k) } else { 0.0 }).collect();
    let u: Vec<f64> = (0..n)
        .map(|k| {
            if (30..1500).contains(&k) {
                0.1 * wave(k - 30) + noise(k)
            } else {
                0.0
            }
        })
        .collect();
    let record = Record::new(
        SampleTime::AT_100_HZ,
        Channel::new("e", "", e),
        Channel::new("u", "", u),
    )
    .unwrap();
    let options = TrackOptions {
        start: StartSource::Span(Some((0.0, 14.0))),
        ..options(Some("0.2..0.4"))
    };
    let trace = track(&record, &options, 16).unwrap();
    for k in 0..trace.len() {
        assert!(trace.theta(k).iter().all(|value| value.is_finite()), "{k}");
        if let Ok(operator) = trace.operator(k) {
            let tau = operator.tau_e_s;
            assert!(
                (0.2..=0.4).contains(&tau.value) && tau.standard_error.unwrap() < 0.2,
                "{tau:?}"
            );
        }
    }
}

#[test]
fn invalid_delay_ranges_are_refused() {
    let record = run(0.28, 0.1);
    let refused = |options: TrackOptions| track(&record, &options, 1).unwrap_err().to_string();
    let message = refused(options(Some("0..2")));
    assert!(
        message.contains("201 samples") && message.contains("at most 128"),
        "{message}"
    );
    let message = Method::rpem().with("track_delay", "0.4..0.2").unwrap_err().to_string();
    assert!(message.contains("LO <= HI"), "{message}");
    let ar = Structure::Ar;
    let alone = TrackOptions {
        structure: ar,
        orders: ar.operator_orders(0),
        ..options(Some("0.2..0.4"))
    };
    let message = refused(alone);
    assert!(message.contains("no input") && message.contains("bj"), "{message}");
}
