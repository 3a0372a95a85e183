//! Every lane has the bits of its run alone, on every path that this processor has.

#![allow(clippy::unwrap_used)]

use hoid_core::{
    adaptation::{Covariance, Forgetting},
    error_bars::NoBars,
    factored::Factored,
    predictor::{AnyShape, Regressor, Shape},
    recursion::Stable,
    rls::Rls,
    rpem::Rpem,
};
use hoid_lanes::{LanesError, Path, Run, Task, track_many};

const NK: usize = 3;

/// Records of a Box-Jenkins model with the poles of the operator, noise of a fixed generator.
fn records(runs: usize, samples: usize) -> Vec<(Vec<f64>, Vec<f64>)> {
    let mut state = 1u64;
    let mut noise = move || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    (0..runs)
        .map(|run| {
            let (mut w, mut n, mut x) = ([0.0; 2], 0.0, [0.0; NK + 2]);
            (0..samples)
                .map(|t| {
                    let t = t as f64;
                    x.copy_within(0..NK + 1, 1);
                    x[0] = (0.02 * t).sin() + (0.07 * t + run as f64).sin() + 0.3 * noise();
                    let response = 0.0443 * x[NK] - 0.0432 * x[NK + 1] + 1.9121 * w[0] - 0.9243 * w[1];
                    w = [response, w[0]];
                    n = 0.85 * n + 0.02 * noise();
                    (x[0], response + n)
                })
                .unzip()
        })
        .collect()
}

fn tasks() -> Vec<Task> {
    let s = |na, nb, nc, nd, nf| AnyShape { na, nb, nc, nd, nf };
    // ARX in the type and not, ARMAX, Box-Jenkins in the type and not, the general form, third order.
    let shapes = [
        s(2, 2, 0, 0, 0),
        s(4, 3, 0, 0, 0),
        s(6, 6, 0, 0, 0),
        s(2, 2, 1, 0, 0),
        s(0, 2, 0, 1, 2),
        s(1, 2, 2, 1, 2),
        s(0, 3, 1, 2, 3),
        s(0, 4, 2, 4, 2),
    ];
    let mut tasks = Vec::new();
    for orders in shapes {
        for lambda in [1.0, 0.98, 1.0 - 1.0 / 256.0] {
            tasks.push(Task {
                orders,
                nk: NK,
                lambda,
                theta: vec![0.0; orders.parameters()],
                variances: vec![if lambda < 0.99 { 1e4 } else { 0.1 }; orders.parameters()],
                stable: if lambda == 1.0 {
                    Stable::PredictorAndNoise
                } else {
                    Stable::Predictor
                },
            });
        }
    }
    tasks
}

/// The estimates of a run alone after each sample, and how many steps were shortened.
fn alone(task: &Task, e: &[f64], u: &[f64]) -> (Vec<Vec<f64>>, usize) {
    // The room for parameters says how often a spoilt covariance is looked for: that of `track_many`.
    let o = task.orders;
    match (o.na, o.nb, o.nc, o.nd, o.nf) {
        (2, 2, 0, 0, 0) => alone_in::<4>(task, e, u),
        (0, 2, 0, 1, 2) => alone_in::<5>(task, e, u),
        _ if o.parameters() <= 8 => alone_in::<8>(task, e, u),
        _ => alone_in::<16>(task, e, u),
    }
}

fn alone_in<const N: usize>(task: &Task, e: &[f64], u: &[f64]) -> (Vec<Vec<f64>>, usize) {
    let of = |values: &[f64]| -> [f64; N] { std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0)) };
    let adaptation = Covariance::new(
        Factored::diagonal(of(&task.variances)),
        Forgetting::Exponential {
            lambda: [task.lambda; N],
        },
        [f64::INFINITY; N],
    );
    let samples = (0..e.len()).map(|t| (if t < task.nk { 0.0 } else { e[t - task.nk] }, u[t]));
    let (o, p) = (task.orders, task.orders.parameters());
    let mut shortened = 0;
    let mut history = Vec::new();
    if (o.nc, o.nd, o.nf) == (0, 0, 0) {
        let mut rls = Rls::new(o, of(&task.theta), adaptation, NoBars).unwrap();
        for (x, u) in samples {
            shortened += usize::from(rls.step(x, u).shortened);
            history.push(rls.theta()[..p].to_vec());
        }
    } else {
        let start = of(&task.theta);
        let mut rpem =
            Rpem::<_, N, 0, _, _>::new(o, Regressor::Gradient, task.stable, start, adaptation, NoBars).unwrap();
        for (x, u) in samples {
            shortened += usize::from(rpem.step(x, u).shortened);
            history.push(rpem.theta()[..p].to_vec());
        }
    }
    (history, shortened)
}

/// Compares all runs of all tasks on all paths; returns the shortened steps that were met.
fn compare(records: &[(Vec<f64>, Vec<f64>)]) -> usize {
    let runs: Vec<Run> = records.iter().map(|(e, u)| Run { e, u }).collect();
    let mut shortened = 0;
    for task in tasks() {
        let expected: Vec<_> = records.iter().map(|(e, u)| alone(&task, e, u)).collect();
        shortened += expected.iter().map(|(_, shortened)| shortened).sum::<usize>();
        for path in Path::available() {
            let estimates = track_many(&runs, &task, path).unwrap();
            assert_eq!(
                (estimates.runs(), estimates.samples()),
                (runs.len(), records[0].0.len())
            );
            for (run, (history, _)) in expected.iter().enumerate() {
                for (t, theta) in history.iter().enumerate() {
                    let ours = estimates.theta(run, t).unwrap();
                    let same = ours.iter().zip(theta).all(|(a, b)| a.to_bits() == b.to_bits());
                    assert!(same, "{path:?} {:?} run {run} at {t}: {ours:?} {theta:?}", task.orders);
                }
                let last = estimates.coefficient(run, 0).unwrap();
                assert_eq!(last.last(), history.last().map(|theta| &theta[0]));
            }
        }
    }
    shortened
}

#[test]
fn every_lane_has_the_bits_of_its_run_alone() {
    println!("paths of this processor: {:?}", Path::available());
    // More than two groups, with lanes left over in each width.
    let shortened = compare(&records(21, 600));
    // The slow way, one lane after the other, was taken as well.
    assert!(shortened > 20, "{shortened}");
}

#[test]
fn an_overflow_in_a_lane_stays_in_it() {
    let mut records = records(9, 300);
    for (run, t, size) in [(2, 50, 1e200), (5, 120, -1e300), (8, 7, 1e160)] {
        records[run].1[t] = size;
        records[run].0[t + 20] = size;
    }
    compare(&records);
}

#[test]
fn what_cannot_be_tracked_is_refused() {
    let records = records(3, 50);
    let runs: Vec<Run> = records.iter().map(|(e, u)| Run { e, u }).collect();
    let task = tasks().swap_remove(12);
    assert!(track_many(&[], &task, Path::Best).unwrap().theta(0, 0).is_none());
    let mut unequal = runs.clone();
    unequal[1].u = &unequal[1].u[..49];
    assert!(matches!(
        track_many(&unequal, &task, Path::Best),
        Err(LanesError::Length { index: 1, .. })
    ));
    let mut spoilt = records[2].clone();
    spoilt.0[7] = f64::NAN;
    let with_nan = [
        runs[0],
        Run {
            e: &spoilt.0,
            u: &spoilt.1,
        },
    ];
    let found = track_many(&with_nan, &task, Path::Best);
    assert!(matches!(
        found,
        Err(LanesError::NotFinite {
            index: 1,
            sample: 7,
            ..
        })
    ));
    let bad = |change: &dyn Fn(&mut Task)| {
        let mut bad = task.clone();
        change(&mut bad);
        assert!(
            matches!(track_many(&runs, &bad, Path::Best), Err(LanesError::BadTask { .. })),
            "{bad:?}"
        );
    };
    bad(&|t| t.lambda = 1.01);
    bad(&|t| t.lambda = f64::NAN);
    bad(&|t| t.theta = vec![0.0; 3]);
    bad(&|t| t.variances[0] = -1.0);
    bad(&|t| t.orders.nd = 20);
    bad(&|t| t.orders = AnyShape::default());
    // F not stable.
    bad(&|t| t.theta[4] = 1.5);
    let estimates = track_many(&runs, &task, Path::Best).unwrap();
    assert!(
        estimates.theta(3, 0).is_none() && estimates.theta(0, 50).is_none() && estimates.coefficient(0, 9).is_none()
    );
    for path in [Path::Avx2, Path::Avx512] {
        if !Path::available().contains(&path) {
            assert_eq!(track_many(&runs, &task, path), Err(LanesError::NoSuchPath { path }));
        }
    }
}
