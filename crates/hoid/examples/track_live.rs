//! Tracks a person in real time: each sample gives one estimate. `cargo run --example track_live`.
//!
//! The samples come from a simulated run whose task changes at 40.96 s. The default tracker has no prior information
//! about the person and starts with the first sample.
#![allow(clippy::print_stdout)]

use std::error::Error;

use hoid::prelude::*;

fn main() -> Result<(), Box<dyn Error>> {
    let run = Simulator::new(&Scenario::condition(Condition::C4))?.run(RunSeed::default(), false)?;
    let options = TrackOptions::without_prior(Method::default(), run.sample_time());
    let mut tracker = Tracker::new(&options, None, run.sample_time())?;
    for (k, (e, u)) in run.input().iter().zip(run.output()).enumerate() {
        tracker.step(*e, *u);
        if let Some(change) = tracker.change() {
            println!(
                "{:5.1} s  {} changed",
                run.time_s(k),
                change.changed_quantities().join(", ")
            );
        }
        if k % 1000 == 999 {
            let t = run.time_s(k);
            match tracker.operator() {
                Ok(operator) => println!("{t:5.1} s  K_e {}  K_e_dot {}", operator.k_e, operator.k_e_dot),
                Err(reason) => println!("{t:5.1} s  {reason}"),
            }
        }
    }
    println!(
        "{} samples, {} skipped",
        tracker.counts().samples,
        tracker.counts().skipped
    );
    Ok(())
}
