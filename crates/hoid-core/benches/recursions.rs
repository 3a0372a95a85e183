//! Time of 8192 steps of each recursion, with the history stored; divide by 8192 for the time of a step. Run with
//! `cargo bench -p hoid-core`.

#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use hoid_core::{
    adaptation::Forgetting,
    adaptive::{
        AdaptiveFilter,
        defaults::{DefaultOperator, REPLAY_SPAN_S},
        memory_needed,
    },
    covariance::Covariance,
    error_bars::{ErrorBars, NoErrorBars},
    innovation_variance::InnovationVariance,
    predictor::Regressor,
    recursion::StablePolynomials,
    rls::Rls,
    rpem::Rpem,
    shape::{AnyShape, FixedShape, Shape},
    ud_covariance::UdCovariance,
};

const SAMPLE_COUNT: usize = 8192;

/// Returns the input and output of a Box-Jenkins model with the poles of the operator and noise from a fixed generator.
fn data() -> Vec<(f64, f64)> {
    let mut state = 1u64;
    let mut noise = move || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let (mut w, mut n, mut x1) = ([0.0; 2], 0.0, 0.0);
    (0..SAMPLE_COUNT)
        .map(|t| {
            let t = t as f64;
            let x = (0.005 * t).sin() + (0.023 * t).sin() + 0.3 * (0.11 * t).sin();
            let response = 0.0443 * x - 0.0432 * x1 + 1.9121 * w[0] - 0.9243 * w[1];
            x1 = x;
            w = [response, w[0]];
            n = 0.85 * n + 0.02 * noise();
            (x, response + n)
        })
        .collect()
}

fn covariance<const N: usize>(forgetting: Forgetting<N>) -> Covariance<N> {
    Covariance::new(UdCovariance::diagonal([0.1; N]), forgetting, [1e3; N])
}

fn error_bars<const N: usize, const K: usize>() -> ErrorBars<N, K> {
    let start: [[f64; N]; N] = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 0.1 } else { 0.0 }));
    ErrorBars::new(&start, InnovationVariance::new(1e-4, 100.0, 0.999), 5.0)
}

fn scalar_forgetting<const N: usize>() -> Forgetting<N> {
    Forgetting::Exponential {
        lambda: [1.0 - 1.0 / 256.0; N],
    }
}

fn matrix_forgetting<const N: usize>() -> Forgetting<N> {
    let mut lambda = [1.0 - 1.0 / 256.0; N];
    lambda[N - 1] = 1.0;
    Forgetting::Exponential { lambda }
}

fn run_rls<S: Shape, const N: usize>(
    shape: S,
    forgetting: Forgetting<N>,
    data: &[(f64, f64)],
    history: &mut Vec<[f64; N]>,
) {
    history.clear();
    let mut recursion = Rls::new(shape, [0.0; N], covariance(forgetting), error_bars::<N, 0>()).unwrap();
    for &(x, u) in data {
        recursion.step(x, u);
        history.push(*recursion.theta());
    }
}

fn run_rpem<S: Shape, const N: usize, const K: usize>(
    shape: S,
    forgetting: Forgetting<N>,
    data: &[(f64, f64)],
    history: &mut Vec<[f64; N]>,
) {
    history.clear();
    let mut theta = [0.0; N];
    let nd = shape.nd();
    theta[..2].copy_from_slice(&[0.04, -0.04]);
    theta[2] = -0.8;
    theta[2 + nd..4 + nd].copy_from_slice(&[-1.9, 0.92]);
    let mut recursion = Rpem::new(
        shape,
        Regressor::Gradient,
        StablePolynomials::Predictor,
        theta,
        covariance(forgetting),
        error_bars::<N, K>(),
    )
    .unwrap();
    for &(x, u) in data {
        recursion.step(x, u);
        history.push(*recursion.theta());
    }
}

/// Recursive least squares without error bars, for comparison with libraries that have none: no guard, and no limit on
/// outliers.
fn run_bare_rls(data: &[(f64, f64)], history: &mut Vec<[f64; 4]>) {
    history.clear();
    let adaptation = Covariance::new(
        UdCovariance::diagonal([0.1; 4]),
        scalar_forgetting(),
        [f64::INFINITY; 4],
    );
    let mut recursion = Rls::new(FixedShape::<2, 2, 0, 0, 0>, [0.0; 4], adaptation, NoErrorBars).unwrap();
    for &(x, u) in data {
        recursion.step(x, u);
        history.push(*recursion.theta());
    }
}

/// The prediction-error method without error bars, also for comparison: no guard, and no limit on outliers.
fn run_bare_rpem(data: &[(f64, f64)], history: &mut Vec<[f64; 5]>) {
    history.clear();
    let mut recursion = Rpem::<_, 5, 0, _, _>::new(
        FixedShape::<0, 2, 0, 1, 2>,
        Regressor::Gradient,
        StablePolynomials::Predictor,
        [0.04, -0.04, -0.8, -1.9, 0.92],
        Covariance::new(
            UdCovariance::diagonal([0.1; 5]),
            scalar_forgetting(),
            [f64::INFINITY; 5],
        ),
        NoErrorBars,
    )
    .unwrap();
    for &(x, u) in data {
        recursion.step(x, u);
        history.push(*recursion.theta());
    }
}

/// Baseline: recursive least squares with one triangle of a plain covariance, without a guard or error bars.
fn run_plain_rls(data: &[(f64, f64)], history: &mut Vec<[f64; 4]>) {
    history.clear();
    let (mut theta, mut psi) = ([0.0; 4], [0.0; 4]);
    let mut p = [[0.0; 4]; 4];
    (0..4).for_each(|i| p[i][i] = 0.1);
    let inverse = 1.0 / (1.0 - 1.0 / 256.0);
    let lambda = 1.0 - 1.0 / 256.0;
    for &(x, u) in data {
        psi = [psi[0], psi[1], x, psi[2]];
        let mut product = [0.0; 4];
        for i in 0..4 {
            for j in 0..4 {
                product[i] += if j <= i { p[i][j] } else { p[j][i] } * psi[j];
            }
        }
        let power: f64 = (0..4).map(|i| psi[i] * product[i]).sum();
        let eps = u - (0..4).map(|i| psi[i] * theta[i]).sum::<f64>();
        let scale = 1.0 / (lambda + power);
        for i in 0..4 {
            theta[i] += product[i] * scale * eps;
            for j in 0..=i {
                p[i][j] = (p[i][j] - product[i] * product[j] * scale) * inverse;
            }
        }
        psi = [-u, psi[0], psi[2], psi[3]];
        history.push(theta);
    }
}

/// Returns the adaptive filter with the default settings for a person.
fn person_filter() -> AdaptiveFilter<Vec<f64>> {
    let (default_operator, ts) = (DefaultOperator::with_delay(0.285), 0.01);
    let memory = vec![0.0; memory_needed(ts, REPLAY_SPAN_S)];
    AdaptiveFilter::new(default_operator.prior(ts), memory).unwrap()
}

/// Continues with an adaptive filter, either from the start, when replays are short, or from a time when replays are
/// long.
fn run_filter(mut person: AdaptiveFilter<Vec<f64>>, data: &[(f64, f64)], history: &mut Vec<f64>) {
    history.clear();
    for &(x, u) in data {
        history.push(person.step(x, u).innovation);
    }
}

fn bench(c: &mut Criterion) {
    let data = data();
    let data = black_box(data.as_slice());
    let mut group = c.benchmark_group("recursion");
    group.throughput(Throughput::Elements(SAMPLE_COUNT as u64));
    let any = |na, nb, nd, nf| AnyShape { na, nb, nc: 0, nd, nf };
    let mut h4: Vec<[f64; 4]> = Vec::with_capacity(SAMPLE_COUNT);
    group.bench_function("rls 4, plain yardstick", |b| b.iter(|| run_plain_rls(data, &mut h4)));
    let arx = FixedShape::<2, 2, 0, 0, 0>;
    group.bench_function("rls 4", |b| b.iter(|| run_rls(arx, scalar_forgetting(), data, &mut h4)));
    group.bench_function("rls 4, no error bars", |b| b.iter(|| run_bare_rls(data, &mut h4)));
    group.bench_function("rls 4, matrix", |b| {
        b.iter(|| run_rls(arx, matrix_forgetting(), data, &mut h4))
    });
    group.bench_function("rls 4, any shape", |b| {
        b.iter(|| run_rls(any(2, 2, 0, 0), scalar_forgetting(), data, &mut h4))
    });
    let mut h5: Vec<[f64; 5]> = Vec::with_capacity(SAMPLE_COUNT);
    let bj = FixedShape::<0, 2, 0, 1, 2>;
    group.bench_function("rpem 5", |b| {
        b.iter(|| run_rpem::<_, 5, 2>(bj, scalar_forgetting(), data, &mut h5))
    });
    group.bench_function("rpem 5, default error bars", |b| {
        b.iter(|| run_rpem::<_, 5, 0>(bj, scalar_forgetting(), data, &mut h5))
    });
    group.bench_function("rpem 5, no error bars", |b| b.iter(|| run_bare_rpem(data, &mut h5)));
    group.bench_function("rpem 5, matrix", |b| {
        b.iter(|| run_rpem::<_, 5, 2>(bj, matrix_forgetting(), data, &mut h5))
    });
    group.bench_function("rpem 5, any shape", |b| {
        b.iter(|| run_rpem::<_, 5, 2>(any(0, 2, 1, 2), scalar_forgetting(), data, &mut h5))
    });
    let mut h8: Vec<[f64; 8]> = Vec::with_capacity(SAMPLE_COUNT);
    group.bench_function("rpem 8", |b| {
        b.iter(|| run_rpem::<_, 8, 4>(any(0, 2, 4, 2), scalar_forgetting(), data, &mut h8))
    });
    group.bench_function("rls 8", |b| {
        b.iter(|| run_rls(any(4, 4, 0, 0), scalar_forgetting(), data, &mut h8))
    });
    let mut h16: Vec<[f64; 16]> = Vec::with_capacity(SAMPLE_COUNT);
    group.bench_function("rls 16", |b| {
        b.iter(|| run_rls(any(8, 8, 0, 0), scalar_forgetting(), data, &mut h16))
    });
    let mut h32: Vec<[f64; 32]> = Vec::with_capacity(SAMPLE_COUNT);
    group.bench_function("rls 32", |b| {
        b.iter(|| run_rls(any(16, 16, 0, 0), scalar_forgetting(), data, &mut h32))
    });
    let mut innovations: Vec<f64> = Vec::with_capacity(SAMPLE_COUNT);
    group.bench_function("adaptive, from the start", |b| {
        b.iter(|| run_filter(person_filter(), data, &mut innovations))
    });
    let mut later = person_filter();
    data.iter().for_each(|&(x, u)| {
        later.step(x, u);
    });
    group.bench_function("adaptive, after 82 s", |b| {
        b.iter(|| run_filter(later.clone(), data, &mut innovations))
    });
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
