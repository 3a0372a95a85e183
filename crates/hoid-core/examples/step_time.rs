//! Time of one step of the default tracker: the mean, and the longest step. The same run is tracked repeatedly, and the
//! shortest time of each step counts, which excludes the time that other programs take.
//!
//! `cargo xtask slow step-time [REPETITIONS]`
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::time::Instant;

use hoid_core::adaptive::{AdaptiveFilter, defaults::DefaultOperator, memory_needed, min_memory};

const LENGTH_S: f64 = 120.0;

fn main() {
    let repetitions: u32 = std::env::args().nth(1).map_or(15, |text| text.parse().unwrap());
    println!("rate in Hz   replay   mean in us   longest in us   share of a sample");
    for rate_hz in [50.0, 100.0, 200.0] {
        let run = simulated_samples(1.0 / rate_hz);
        for replay_s in [0.0, 100.0] {
            let shortest = shortest_step_times_us(&run, 1.0 / rate_hz, replay_s, repetitions);
            let mean = shortest.iter().sum::<f64>() / shortest.len() as f64;
            let longest = shortest.iter().copied().fold(0.0, f64::max);
            println!(
                "{rate_hz:>10} {replay_s:>6} s {mean:>12.2} {longest:>15.1} {:>17.2} %",
                longest * rate_hz * 1e-4
            );
        }
    }
}

/// Returns the shortest time of each step in several runs, us.
fn shortest_step_times_us(run: &[(f64, f64)], ts_s: f64, replay_s: f64, repetitions: u32) -> Vec<f64> {
    let memory = if replay_s > 0.0 {
        memory_needed(ts_s, replay_s)
    } else {
        min_memory(ts_s)
    };
    let prior = DefaultOperator::with_delay(0.2).prior(ts_s);
    let mut shortest = vec![f64::INFINITY; run.len()];
    for _ in 0..repetitions {
        let mut tracker = AdaptiveFilter::new(prior, vec![0.0; memory]).unwrap();
        for ((e, u), shortest) in run.iter().zip(&mut shortest) {
            let start = Instant::now();
            tracker.step(*e, *u);
            *shortest = shortest.min(start.elapsed().as_secs_f64() * 1e6);
        }
    }
    shortest
}

/// Simulates an operator with a gain that doubles after a minute, a neuromuscular system of 11 rad/s, a delay of 0.2 s,
/// and noise.
fn simulated_samples(ts_s: f64) -> Vec<(f64, f64)> {
    let late = (0.2 / ts_s).round() as usize;
    let (mut u, mut rate, mut draw, mut errors) = (0.0, 0.0, 1_u32, vec![0.0; late]);
    let samples = (LENGTH_S / ts_s) as u32;
    let mut run = Vec::new();
    for k in 0..samples {
        let t = f64::from(k) * ts_s;
        let e: f64 = [0.2, 0.6, 1.1, 1.7, 2.8, 4.1, 6.3, 9.0]
            .map(|w: f64| (w * t + w * w).sin())
            .iter()
            .sum();
        let gain = if t < 0.5 * LENGTH_S { 0.5 } else { 1.0 };
        errors.push(e);
        rate += ts_s * 121.0 * (gain * errors[k as usize] - u - 2.0 * 0.25 / 11.0 * rate);
        u += ts_s * rate;
        draw = draw.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        run.push((e, u + 0.2 * (f64::from(draw) / f64::from(u32::MAX) - 0.5)));
    }
    run
}
