//! Effects of faults in a stream on the trackers. The program prints the numbers of
//! `research/notes/guards-evidence.md`.
//!
//! `cargo xtask slow tracker-faults [SEEDS] [FIRST] [--bare] [METHOD...]`: evaluates 4 seeds by default, from FIRST on;
//! with `--bare` the trackers have no guard, for comparison. `--cost` processes the samples of one run SEEDS times and
//! prints nothing: count its instructions with `valgrind --tool=callgrind` or `perf stat` for two values of SEEDS, with
//! and without the guard.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../tests/common/tracker_faults/mod.rs"]
mod tracker_faults;

use hoid::{
    prelude::*,
    track::{Method, TrackOptions},
};
use rayon::prelude::*;
use tracker_faults::{Effect, Reference, Run, faults};

/// Length of a run, and times of the faults, s.
const LENGTH_S: f64 = 330.0;
const FAULT_TIMES_S: [f64; 2] = [100.3, 121.77];

fn main() {
    let (mut numbers, mut methods, mut bare, mut cost) = (Vec::new(), Vec::new(), false, false);
    for argument in std::env::args().skip(1) {
        match (argument.as_str(), argument.parse::<u64>()) {
            ("--bare", _) => bare = true,
            ("--cost", _) => cost = true,
            (_, Ok(number)) => numbers.push(number),
            (name, Err(_)) => methods.push(hoid::survey::method(name).unwrap()),
        }
    }
    if methods.is_empty() {
        methods = vec![
            hoid::survey::physical(),
            hoid::survey::multiple_model(),
            Method::rls(),
            Method::rpem(),
        ];
    }
    let seeds = numbers.first().copied().unwrap_or(4);
    let first = numbers.get(1).copied().unwrap_or(1000);
    let guard = if bare { "no" } else { "yes" };
    if cost {
        let run = Run::new(Condition::C1, 1, first, 81.92);
        for method in methods {
            let options = TrackOptions::new(method.clone(), method.default_structure(), method.default_orders(29));
            run.process_repeatedly(&options.with(&[("guard", guard)]).unwrap(), seeds);
        }
        return;
    }
    for method in methods {
        let runs: Vec<(Run, Reference)> = (first..first + seeds)
            .into_par_iter()
            .map(|seed| {
                let condition = [Condition::C1, Condition::C4][(seed % 2) as usize];
                let remnant_order = 1 + (seed / 2 % 3) as usize;
                let run = Run::new(condition, remnant_order, seed, LENGTH_S);
                // The order of the noise model is the default of the method, or the order of the remnant if this is
                // higher.
                let orders = method.default_orders(29);
                let nd = if orders.nd > 0 { orders.nd.max(remnant_order) } else { 0 };
                let options = TrackOptions::new(method.clone(), method.default_structure(), Orders { nd, ..orders });
                let options = options.with(&[("guard", guard)]).unwrap();
                let reference = Reference::new(&run, &options);
                (run, reference)
            })
            .collect();
        let samples: usize = runs.iter().map(|(run, _)| run.e.len()).sum();
        let held: u64 = runs.iter().map(|(_, reference)| reference.held).sum();
        let restarts: u64 = runs.iter().map(|(_, reference)| reference.restarts).sum();
        println!("\n## {method}, guard {guard}: {seeds} runs\n");
        println!("Without a fault: {held} of {samples} samples held back, {restarts} restarts.\n");
        for event in runs.iter().flat_map(|(_, reference)| &reference.events).take(20) {
            println!("- {event:?}");
        }
        println!("| fault | largest shift, median and worst, s.e. | recovery, median and worst, s | told |");
        println!("|---|---|---|---|");
        for fault in faults() {
            let effects: Vec<Effect> = runs
                .par_iter()
                .flat_map_iter(|(run, reference)| FAULT_TIMES_S.map(|at| reference.effect(run, &fault, at)))
                .collect();
            let mut shifts: Vec<f64> = effects.iter().map(|e| e.shift).collect();
            let mut times: Vec<f64> = effects.iter().map(|e| e.recovery_s.unwrap_or(f64::INFINITY)).collect();
            shifts.sort_by(f64::total_cmp);
            times.sort_by(f64::total_cmp);
            let told = effects.iter().filter(|e| e.told).count();
            let n = effects.len();
            println!(
                "| {fault} | {:.3}, {:.3} | {:.1}, {:.1} | {told} of {n} |",
                shifts[n / 2],
                shifts[n - 1],
                times[n / 2],
                times[n - 1]
            );
        }
    }
}
