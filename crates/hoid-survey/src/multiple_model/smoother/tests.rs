#![allow(clippy::unwrap_used)]
use super::*;
use crate::{methods, multiple_model};
use hoid_model::{
    Channel, SampleTime,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};
use hoid_track::{StartSource, TrackOptions, track};

fn side(eta: [f64; PARAMETER_COUNT], scale: f64, weight: f64) -> OneSidedHypothesis {
    // The covariance is positive definite: the sum of a unit matrix and a rank-one matrix.
    let direction = [0.3, -0.5, 0.2, 0.7];
    OneSidedHypothesis {
        log_weight: weight.ln(),
        eta,
        covariance: std::array::from_fn(|i| {
            std::array::from_fn(|j| scale * (f64::from(u8::from(i == j)) + direction[i] * direction[j]))
        }),
        // The only eigenvalue other than one is 1 + |direction|^2.
        size: 0.5 * (scale.powi(4) * 1.87 * 0.02).ln(),
        level: [0.1 * scale, 0.02],
    }
}

#[test]
fn product_matches_the_information_form() {
    let (f, b) = (
        side([1.0, 2.0, 3.0, 4.0], 0.5, 0.4),
        side([1.5, 1.0, 3.5, 4.2], 2.0, 0.6),
    );
    let (_, pair) = ForwardBackward::of(&f, &b).unwrap();
    let joined = pair.product();
    let square = |m: &[[f64; PARAMETER_COUNT]; PARAMETER_COUNT]| nalgebra::Matrix4::from_fn(|i, j| m[i][j]);
    let inverse = |s: &OneSidedHypothesis| square(&s.covariance).try_inverse().unwrap();
    let covariance = (inverse(&f) + inverse(&b)).try_inverse().unwrap();
    let vector = |s: &OneSidedHypothesis| nalgebra::Vector4::from(s.eta);
    let mean = covariance * (inverse(&f) * vector(&f) + inverse(&b) * vector(&b));
    for i in 0..PARAMETER_COUNT {
        assert!((joined.eta[i] - mean[i]).abs() < 1e-13);
        for j in 0..PARAMETER_COUNT {
            assert!((joined.covariance[i][j] - covariance[(i, j)]).abs() < 1e-13);
        }
    }
}

#[test]
fn contradictory_past_and_future_are_not_joined() {
    let old = side([1.0; PARAMETER_COUNT], 0.01, 0.9);
    let (same, other) = (
        side([1.0; PARAMETER_COUNT], 0.01, 0.5),
        side([9.0; PARAMETER_COUNT], 0.01, 0.5),
    );
    let joined = mixture_product(&[old], &[same, other]);
    assert!((joined.eta[0] - 1.0).abs() < 1e-9);
    // The order of the two hypotheses does not matter.
    let mirrored = mixture_product(&[same, other], &[old]);
    for i in 0..PARAMETER_COUNT {
        assert!((joined.eta[i] - mirrored.eta[i]).abs() < 1e-12);
    }
    // If the covariances of the future are NaN, only the past is used.
    let broken = OneSidedHypothesis {
        covariance: [[f64::NAN; PARAMETER_COUNT]; PARAMETER_COUNT],
        ..old
    };
    assert_eq!(mixture_product(&[old], &[broken]).eta, old.eta);
}

fn options() -> TrackOptions {
    TrackOptions {
        start: StartSource::Span(Some((0.0, 30.72))),
        ..TrackOptions::new(
            multiple_model().with("smooth", "true").unwrap(),
            multiple_model().default_structure(),
            multiple_model().default_orders(29),
        )
    }
}

fn run(condition: Condition) -> Record {
    let run_seed = RunSeed {
        seed: 77,
        cell: 0,
        replication: 0,
    };
    Simulator::new(&Scenario::condition(condition))
        .unwrap()
        .run(run_seed, false)
        .unwrap()
}

#[test]
fn without_a_change_all_rows_nearly_agree() {
    let trace = track(&run(Condition::C1), &options(), 256).unwrap();
    let rows: Vec<_> = (0..trace.len()).map(|row| trace.operator(row).unwrap()).collect();
    let last = rows[rows.len() / 2];
    for row in &rows {
        for ((_, _, a), (_, _, b)) in row.rows()[..5].iter().zip(last.rows()) {
            let se = b.standard_error.unwrap();
            // The drift within half a run is smaller than the prior spread.
            assert!((a.value - b.value).abs() < 2.0 * se, "{a:?} {b:?}");
        }
    }
    assert_eq!(trace.updated_from_s(), 0.0);
}

#[test]
fn faults_have_little_effect_and_short_records_are_refused() {
    let record = run(Condition::C4);
    let (mut e, mut u) = (record.input().to_vec(), record.output().to_vec());
    let clean = track(&record, &options(), 512).unwrap();
    for k in [3200, 3201, 5000, 8191] {
        u[k] = 2e6;
    }
    (e[4000], u[4001]) = (-1e9, 1e300);
    assert!(
        Record::new(
            SampleTime::AT_100_HZ,
            Channel::new("e", "deg", vec![f64::NAN; 2]),
            Channel::new("u", "deg", vec![0.0; 2])
        )
        .is_err()
    );
    let faulty = Record::new(
        SampleTime::AT_100_HZ,
        Channel::new("e", "deg", e),
        Channel::new("u", "deg", u),
    )
    .unwrap();
    let trace = track(&faulty, &options(), 512).unwrap();
    for row in 0..trace.len() {
        let (a, b) = (clean.operator(row).unwrap(), trace.operator(row).unwrap());
        assert!((a.k_e_dot.value - b.k_e_dot.value).abs() < 0.5 * a.k_e_dot.standard_error.unwrap().max(1e-3));
    }
    let short = record.span(0.0, 0.5).unwrap();
    let all = TrackOptions {
        start: StartSource::Span(None),
        ..options()
    };
    assert!(track(&short, &all, 1).is_err());
}

#[test]
fn other_methods_have_no_two_sided_estimate() {
    for method in methods().into_iter().filter(|m| *m != multiple_model()) {
        let name = method.name();
        assert!(method.with("smooth", "true").is_err(), "{name}");
    }
}
