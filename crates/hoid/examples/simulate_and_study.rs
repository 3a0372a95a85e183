//! A small Monte Carlo study: ARX compared with Box-Jenkins on simulated runs.
//! `cargo run --example simulate_and_study`.
#![allow(clippy::print_stdout)]

use std::error::Error;

use hoid::prelude::*;

const PLAN: &str = r#"
name = "example"
seed = 1
replications = 8

[[scenarios]]
condition = ["C1", "C2"]
remnant = { order = 1, noise_level = 0.1 }

[[estimators]]
name = "polynomial"
method = "fit"
structure = ["arx", "bj"]
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let plan = Plan::parse(PLAN, "example.toml")?;
    let folder = std::env::temp_dir().join(format!("hoid-study-{}", std::process::id()));
    let outcome = run_study(&plan, &folder, &RunOptions::default(), &|_| (), &|| true)?;
    println!("{} estimates, finished: {}", plan.estimate_count(), outcome.finished);
    let results = hoid::study::Results::read(&folder)?;
    for row in results.find(&hoid::study::Query::of("bias_omega_nm")) {
        println!(
            "cell {} {}: median {:+.3} %",
            row.cell, row.estimator, row.statistics.median
        );
    }
    std::fs::remove_dir_all(&folder)?;
    Ok(())
}
