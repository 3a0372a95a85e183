//! Tracks a person while they act: one sample in, one estimate out.
//! `cargo run --example track_live`.
//!
//! The samples come from a simulated run whose task changes at 40.96 s; the first 20 s give the
//! start fit.
#![allow(clippy::print_stdout)]

use std::error::Error;

use hoid::prelude::*;

fn main() -> Result<(), Box<dyn Error>> {
    let run = Simulator::new(&Scenario::condition(Condition::C4))?.run(RunSeed::default(), false)?;
    let start = run.span(0.0, 20.0)?;
    let fit = identify_box_jenkins(std::slice::from_ref(&start))?.fit;

    let options = TrackOptions::usual(Method::physical(), fit.orders().nk).with(&[("memory_of", "K_e=4s")])?;
    let mut tracker = Tracker::new(&options, Some(&start), run.sample_time())?;
    for (k, (e, u)) in run.input().iter().zip(run.output()).enumerate() {
        tracker.step(*e, *u);
        if k % 1000 == 0 {
            let t = run.time_s(k);
            match tracker.operator() {
                Ok(operator) => println!(
                    "{t:5.1} s  K_e {:.4}  K_e_dot {:.4}",
                    operator.k_e.value, operator.k_e_dot.value
                ),
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
