//! Reads samples `e,u` from standard input. After each sample it prints the six parameters of the operator, the
//! crossover frequency and the phase margin, each with its standard error, and the processing time of the sample in ns.
//! This is one of the places of `cargo xtask places`.
#![allow(clippy::print_stdout)]

use std::{
    error::Error,
    io::{BufRead, Write, stdin, stdout},
    time::Instant,
};

use hoid::prelude::*;

fn main() -> Result<(), Box<dyn Error>> {
    let sample_time = SampleTime::new(0.01)?;
    // The tracker starts with the default delay of 0.2 s.
    let options = TrackOptions {
        controlled_element: Some("90/(s(s+6))".parse()?),
        ..TrackOptions::default_for(Method::adaptive(), 21)
    };
    let mut tracker = Tracker::new(&options, None, sample_time)?;
    let mut out = stdout().lock();
    for line in stdin().lock().lines() {
        let line = line?;
        let (e, u) = line.split_once(',').ok_or("a line is not two numbers, e,u")?;
        let (e, u) = (e.parse()?, u.parse()?);
        let start_time = Instant::now();
        tracker.step(e, u);
        let operator = tracker.operator().ok();
        let found = tracker.open_loop().and_then(Result::ok);
        let took = start_time.elapsed();
        let rows = operator.map(|operator| operator.rows().map(|(.., estimate)| Some(estimate)));
        let of_loop = [found.map(|f| f.crossover_rad_s), found.map(|f| f.phase_margin_deg)];
        for estimate in rows.unwrap_or([None; 6]).into_iter().chain(of_loop) {
            let value = estimate.map_or(f64::NAN, |e| e.value);
            let error = estimate.and_then(|e| e.standard_error).unwrap_or(f64::NAN);
            write!(out, "{value:?},{error:?},")?;
        }
        writeln!(out, "{}", took.as_nanos())?;
    }
    Ok(())
}
