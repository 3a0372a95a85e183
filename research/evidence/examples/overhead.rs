//! Times of a fit and of a step in Rust, for comparison with those from Python (`python/benchmarks/overhead.py`); run
//! the two programs in turn on an idle machine.
//!
//! ```sh
//! cargo run --release -p hoid-evidence --example overhead
//! ```
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::{hint::black_box, time::Instant};

use hoid::{
    prelude::*,
    track::{Method, StartSource, TrackOptions, Tracker},
};

fn main() {
    let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
    let record = simulator
        .run(
            RunSeed {
                seed: 1,
                ..RunSeed::default()
            },
            false,
        )
        .unwrap();
    for (structure, runs) in [(Structure::Arx, 400), (Structure::BoxJenkins, 200)] {
        let estimator = Estimator::new(structure, structure.operator_orders(29));
        let fit = median(runs, || {
            // The record is created from arrays, as in Python.
            let channel = |name: &str, values: &[f64]| Channel::new(name, "deg", values.to_vec());
            let input = channel("e", record.input());
            let record = Record::new(record.sample_time(), input, channel("u", record.output())).unwrap();
            black_box(estimator.fit(&[record]).unwrap());
        });
        println!("identify {:4}  {:9.1} us", structure.name(), fit * 1e6);
    }
    let orders = Structure::BoxJenkins.operator_orders(29);
    let start = Estimator::new(Structure::BoxJenkins, orders)
        .fit(std::slice::from_ref(&record))
        .unwrap();
    for method in [Method::rpem(), hoid_survey::physical()] {
        let options = TrackOptions {
            start: StartSource::Theta(start.model().theta().to_vec()),
            ..TrackOptions::new(method.clone(), Structure::BoxJenkins, orders)
        };
        let mut tracker = Tracker::new(&options, None, record.sample_time()).unwrap();
        let pass = median(20, || {
            for k in 0..record.len() {
                black_box(tracker.step(record.input()[k], record.output()[k]));
            }
        });
        println!("step {:8}  {:9.3} us", method.name(), pass / record.len() as f64 * 1e6);
    }
}

/// Returns the median time of a given number of runs, s.
fn median(runs: usize, mut work: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..runs)
        .map(|_| {
            let begun = Instant::now();
            work();
            begun.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[runs / 2]
}
