//! Time of the exact hold with its Jacobian, for the reference operator at 100 Hz and 1 kHz and for fast and overdamped
//! operators.
//!
//! `cargo bench -p hoid-core`. Machines are shared and noisy: compare ratios within one run only.
#![allow(missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use hoid_core::zoh_operator::{zoh_operator, zoh_operator_delayed};

fn bench_held_operator(c: &mut Criterion) {
    for (name, omega, zeta, ts) in [
        ("11.25 rad/s, 0.35, 100 Hz", 11.25, 0.35, 0.01),
        ("11.25 rad/s, 0.35, 1 kHz", 11.25, 0.35, 0.001),
        ("60 rad/s, 0.35, 100 Hz", 60.0, 0.35, 0.01),
        ("200 rad/s, 0.35, 100 Hz", 200.0, 0.35, 0.01),
        ("60 rad/s, 3, 100 Hz", 60.0, 3.0, 0.01),
    ] {
        let p = [0.09, 0.036, omega, zeta];
        c.bench_function(&format!("whole samples: {name}"), |b| {
            b.iter(|| zoh_operator(black_box(p), black_box(ts)))
        });
        c.bench_function(&format!("any delay: {name}"), |b| {
            b.iter(|| zoh_operator_delayed(black_box(p), black_box(0.37 * ts), black_box(ts)))
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = bench_held_operator
}
criterion_main!(benches);
