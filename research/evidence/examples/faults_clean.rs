//! False alarms and detections of faults in recordings.
//!
//! The runs are those of the conditions of the thesis and of virtual people with every kind of remnant and controlled
//! element, `--runs N` of each (default 25; 21 kinds). In each run without a fault, one sample of e or of u at a random
//! place is then moved by 3, 10 or 20 standard deviations.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::env;

use hoid_ident::faults::repair;
use hoid_model::{
    Channel, FaultHandling, Record,
    scenario::{Condition, Scenario},
};
use hoid_sim::{
    RunSeed, Simulator,
    people::{Person, Plant, Population, RemnantKind, Task},
};

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let number = |name: &str, default: u64| {
        let at = arguments.iter().position(|a| a == name);
        at.and_then(|at| arguments.get(at + 1)?.parse().ok()).unwrap_or(default)
    };
    let (runs, first) = (number("--runs", 25), number("--seed", 1000));
    let (mut all, mut flagged) = (0, 0);
    let mut detected = [[(0, 0); 3]; 2];
    let mut look = |what: &str, seed: u64, record: &Record| {
        let found = repair(record, FaultHandling::Bridge).unwrap();
        all += 1;
        if !found.faults.is_empty() {
            flagged += 1;
            println!("{what}, seed {seed}: {}", found.faults[0]);
            return;
        }
        let n = record.len();
        for channel in 0..2 {
            for (k, size) in [3.0, 10.0, 20.0].into_iter().enumerate() {
                let at = (seed as usize * 7919 + 31 * k + 997 * channel) % n;
                let (mut e, mut u) = (record.input().to_vec(), record.output().to_vec());
                let moved = if channel == 0 { &mut e } else { &mut u };
                let rms = (moved.iter().map(|v| v * v).sum::<f64>() / n as f64).sqrt();
                moved[at] += size * rms;
                let (e, u) = (Channel::new("e", "", e), Channel::new("u", "", u));
                let bad = Record::new(record.sample_time(), e, u).unwrap();
                let found = repair(&bad, FaultHandling::Bridge).unwrap();
                let time = bad.time_s(at) + 0.5 * bad.sample_time().s();
                let hit = found.faults.iter().any(|f| f.from_s < time && time < f.to_s);
                detected[channel][k].0 += usize::from(hit);
                detected[channel][k].1 += 1;
            }
        }
    };
    for seed in first..first + runs {
        for condition in Condition::ALL {
            let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
            let seed_of_run = RunSeed {
                seed,
                ..RunSeed::default()
            };
            look(
                &format!("{condition:?}"),
                seed,
                &simulator.run(seed_of_run, false).unwrap(),
            );
        }
        for remnant in RemnantKind::ALL {
            for plant in Plant::ALL {
                let (population, task) = (Population::default(), Task::default());
                let person = Person::draw(&population, &task, plant, None, remnant, seed, 0).unwrap();
                look(&format!("{remnant}, {plant}"), seed, &person.run(1).unwrap().record);
            }
        }
    }
    println!(
        "{flagged} of {all} clean runs flagged ({:.2} %)",
        100.0 * flagged as f64 / all as f64
    );
    for (channel, of) in ["e", "u"].iter().zip(detected) {
        for (size, (hits, all)) in [3, 10, 20].iter().zip(of) {
            println!("one sample of {channel} off by {size} deviations: {hits} of {all} found");
        }
    }
}
