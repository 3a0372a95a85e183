//! Recursions of 16 runs of 8192 samples side by side, with their history; divide by 131072 for a sample.
//! Run with `cargo bench -p hoid-lanes`.

#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use hoid_core::predictor::{AnyShape, Shape};
use hoid_lanes::{Path, Run, Task, track_many};

const RUNS: usize = 16;
const SAMPLES: usize = 8192;

fn bench(c: &mut Criterion) {
    let mut state = 1u64;
    let mut noise = move || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let records: Vec<(Vec<f64>, Vec<f64>)> = (0..RUNS)
        .map(|_| {
            let (mut w, mut n, mut x1) = ([0.0; 2], 0.0, 0.0);
            (0..SAMPLES)
                .map(|t| {
                    let x = (0.005 * t as f64).sin() + (0.023 * t as f64).sin() + 0.1 * noise();
                    let response = 0.0443 * x - 0.0432 * x1 + 1.9121 * w[0] - 0.9243 * w[1];
                    x1 = x;
                    w = [response, w[0]];
                    n = 0.85 * n + 0.02 * noise();
                    (x, response + n)
                })
                .unzip()
        })
        .collect();
    let runs: Vec<Run> = records.iter().map(|(e, u)| Run { e, u }).collect();
    let task = |orders: AnyShape, theta: &[f64]| Task {
        orders,
        nk: 0,
        lambda: 1.0 - 1.0 / 256.0,
        theta: theta.to_vec(),
        variances: vec![0.1; orders.parameters()],
        stable: Default::default(),
    };
    let arx = AnyShape {
        na: 2,
        nb: 2,
        ..Default::default()
    };
    let bj = AnyShape {
        nb: 2,
        nd: 1,
        nf: 2,
        ..Default::default()
    };
    let mut group = c.benchmark_group("lanes");
    group.throughput(Throughput::Elements((RUNS * SAMPLES) as u64));
    for path in Path::available() {
        for (name, task) in [
            ("rls 4", task(arx, &[0.0; 4])),
            ("rpem 5", task(bj, &[0.04, -0.04, -0.8, -1.9, 0.92])),
        ] {
            group.bench_function(format!("{name}, {path:?}"), |b| {
                b.iter(|| track_many(black_box(&runs), &task, path).unwrap());
            });
        }
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
