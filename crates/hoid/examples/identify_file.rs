//! Identifies a person from a file and writes a report:
//! `cargo run --example identify_file -- run1.csv report`.
//!
//! The file has the columns t (s), e and u. Without arguments, a simulated run is used instead.
#![allow(clippy::print_stdout)]

use std::{error::Error, path::PathBuf};

use hoid::prelude::*;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let record = match arguments.next() {
        Some(path) => read(path)?,
        None => Simulator::new(&Scenario::condition(Condition::C1))?.run(RunSeed::default(), false)?,
    };
    let folder = arguments
        .next()
        .map_or(std::env::temp_dir().join("hoid-example"), PathBuf::from);

    let records = [record];
    let person = identify(&records)?;
    println!("{person}\n");
    // Fits a polynomial model to the same records and tests its residuals.
    let choice = identify_box_jenkins(&records)?;
    println!("{}\n", choice.fit);
    match choice.fit.operator() {
        Ok(operator) => println!("{operator}\n"),
        Err(reason) => println!("no operator parameters: {reason}\n"),
    }
    println!("{}", choice.fit.validate(&records[0])?);

    let html = Report::of("Example", &records, &choice).to_html()?;
    println!("report: {}", write_report(&folder, &html)?.display());
    Ok(())
}
