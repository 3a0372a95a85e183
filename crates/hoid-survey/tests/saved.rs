//! Saved trackers: every method continues with bit-identical numbers, and no saved numbers cause a panic.
#![allow(clippy::unwrap_used)]

use hoid_model::{
    Record, Structure,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};

use hoid_survey::{dual_ekf, ekf, fused, linear_network, multiple_model, physical, rriv, ukf, window};
use hoid_track::{Method, Sample, TrackOptions, Tracker, sealed};

fn record() -> Record {
    let simulator = Simulator::new(&Scenario::condition(Condition::C4)).unwrap();
    simulator
        .run(
            RunSeed {
                seed: 4,
                ..RunSeed::default()
            },
            false,
        )
        .unwrap()
}

/// After a stop in the middle of a run, every method and every forgetting rule gives bit-identical results.
#[test]
fn restored_tracker_is_bit_identical() {
    let record = record();
    let span = record.span(0.0, 20.0).unwrap();
    let bj = Structure::BoxJenkins;
    let orders = bj.operator_orders(29);
    let of = |method| TrackOptions::new(method, bj, orders);
    let mut cases = vec![
        TrackOptions::new(Method::rls(), Structure::Arx, Structure::Arx.operator_orders(29)),
        of(physical()),
        of(multiple_model()),
        TrackOptions::default_for(Method::adaptive(), 29),
        of(fused()),
        of(ekf()),
        of(ukf()),
        of(dual_ekf()),
        of(dual_ekf()).with(&[("pade", "2")]).unwrap(),
        of(linear_network()),
        of(window()).with(&[("refit", "400")]).unwrap(),
        of(rriv()).with(&[("instruments", "f_t")]).unwrap(),
        of(physical()).with(&[("track_delay", "0.2..0.35")]).unwrap(),
        of(multiple_model()).with(&[("track_delay", "0.2..0.35")]).unwrap(),
        of(Method::rpem()).with(&[("track_delay", "0.2..0.35")]).unwrap(),
    ];
    for forgetting in [
        "exponential",
        "random-walk",
        "window",
        "variable",
        "directional",
        "gradient",
    ] {
        let mut rule = vec![("forgetting", forgetting)];
        rule.extend((forgetting == "random-walk").then_some(("drift", "b0=0.01")));
        cases.push(of(Method::rpem()).with(&rule).unwrap());
    }
    for options in cases {
        let rriv = options.method.name() == "rriv";
        let reference = record.channel("f_t").filter(|_| rriv);
        let sample = |k: usize| Sample {
            e: record.input()[k],
            u: record.output()[k],
            reference: reference.map(|r| r[k]),
        };
        let mut first = Tracker::new(&options, Some(&span), record.sample_time()).unwrap();
        (0..3000).for_each(|k| {
            first.update(sample(k), true);
        });
        let numbers = first.save();
        let mut second = Tracker::restore(&options, record.sample_time(), &numbers).unwrap();
        let name = format!("{:?}", options.method);
        for k in 3000..5000 {
            assert_eq!(
                first.update(sample(k), true),
                second.update(sample(k), true),
                "{name} at {k}"
            );
        }
        assert_eq!(first.theta(), second.theta(), "{name}");
        assert_eq!(first.covariance(), second.covariance(), "{name}");
        assert_eq!(first.counts(), second.counts(), "{name}");
        assert_eq!(first.operator(), second.operator(), "{name}");
        assert!(
            Tracker::restore(&options, record.sample_time(), &numbers[1..]).is_err(),
            "{name}"
        );
    }
}

/// Numbers are changed and given a valid checksum, which does not happen by accident: the tracker is rejected or
/// continues, and no index, length or bound causes a panic.
#[test]
fn resealed_changed_state_never_panics() {
    let record = record();
    let span = record.span(0.0, 20.0).unwrap();
    let bj = Structure::BoxJenkins;
    let of = |method| TrackOptions::new(method, bj, bj.operator_orders(29));
    let all = [
        TrackOptions::new(Method::rls(), Structure::Arx, Structure::Arx.operator_orders(29)),
        of(Method::rpem()),
        of(physical()).with(&[("track_delay", "0.2..0.35")]).unwrap(),
        of(multiple_model()),
        TrackOptions::default_for(Method::adaptive(), 29)
            .with(&[("replay", "5")])
            .unwrap(),
        of(ekf()),
        of(dual_ekf()),
        of(dual_ekf()).with(&[("pade", "2")]).unwrap(),
        of(linear_network()),
        of(fused()),
        of(window()).with(&[("refit", "200")]).unwrap(),
    ];
    let sample = |k: usize| Sample {
        e: record.input()[k],
        u: record.output()[k],
        reference: None,
    };
    let mut state = 54_u64;
    let mut random = move |below: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) as usize) % below.max(1)
    };
    let extremes = [
        0.0,
        -1.0,
        1.0,
        3.0,
        1e3,
        1e6,
        1e18,
        1e300,
        -1e300,
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        5e-324,
        0.5,
    ];
    for options in all {
        let mut tracker = Tracker::new(&options, Some(&span), record.sample_time()).unwrap();
        (2000..2700).for_each(|k| {
            tracker.update(sample(k), true);
        });
        let numbers = tracker.save();
        for _ in 0..600 {
            let mut changed = numbers[..numbers.len() - 1].to_vec();
            for _ in 0..=random(3) {
                let at = random(changed.len());
                changed[at] = extremes[random(extremes.len())];
            }
            let changed = sealed(changed);
            if let Ok(mut restored) = Tracker::restore(&options, record.sample_time(), &changed) {
                for k in 2700..2760 {
                    let missing = Sample {
                        u: f64::NAN,
                        ..sample(k)
                    };
                    restored.update(if k % 20 < 2 { missing } else { sample(k) }, true);
                }
                let numbers = restored.save();
                let results = (restored.operator(), restored.covariance(), restored.response(3.0));
                assert!(numbers.len() > 1 || results.1.is_none());
            }
        }
    }
}
