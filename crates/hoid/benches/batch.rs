//! Time of one simulated run and of one batch fit: condition C1, 8192 samples, nk = 29.
//!
//! `cargo bench -p hoid`. Timings vary with the load of the machine, so compare only ratios within one run.
#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{Criterion, criterion_group, criterion_main};
use hoid::prelude::*;

fn batch(c: &mut Criterion) {
    let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
    let changing = Simulator::new(&Scenario::condition(Condition::C3)).unwrap();
    let run_seed = RunSeed::default();
    let noise = run_seed.white_noise(simulator.sample_count());
    let record = [simulator.run(run_seed, false).unwrap()];
    let estimator = |structure: Structure| Estimator::new(structure, structure.operator_orders(29));
    let (arx, bj) = (estimator(Structure::Arx), estimator(Structure::BoxJenkins));

    c.bench_function("noise of a run", |b| {
        b.iter(|| run_seed.white_noise(simulator.sample_count()))
    });
    c.bench_function("loop, C1, noise given", |b| {
        b.iter(|| simulator.signals(&noise).unwrap())
    });
    c.bench_function("loop, C3, noise given", |b| {
        b.iter(|| changing.signals(&noise).unwrap())
    });
    c.bench_function("run with all channels, C1", |b| {
        b.iter(|| simulator.run(run_seed, false).unwrap())
    });
    c.bench_function("ARX fit", |b| b.iter(|| arx.fit(&record).unwrap()));
    c.bench_function("BJ fit, own start, initial states, covariance", |b| {
        b.iter(|| bj.fit(&record).unwrap())
    });
}

criterion_group!(benches, batch);
criterion_main!(benches);
