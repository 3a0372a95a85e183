//! Simulates a run of condition C4, tracks it by RLS, RPEM and the recursion in physical
//! parameters, and writes the report:
//! `cargo run -p hoid-report --example sample_track_report -- report.html`.

use std::error::Error;

use hoid_ident::{Estimator, Fit};
use hoid_model::{
    Record, Structure,
    scenario::{Condition, Scenario},
};
use hoid_report::{BatchLine, TraceSection, TrackReport};
use hoid_sim::{RunSeed, Simulator};
use hoid_track::{Method, StartSource, Trace, TrackOptions, track};

/// Spans of the batch fits (s): before and after the change at 40.96 s.
const SPANS: [(f64, f64); 2] = [(0.0, 30.72), (51.20, 81.92)];

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args()
        .nth(1)
        .ok_or("give the file to write, such as report.html")?;
    let simulator = Simulator::new(&Scenario::condition(Condition::C4))?;
    let run_seed = RunSeed {
        seed: 1,
        ..RunSeed::default()
    };
    let record = simulator.run(run_seed, false)?;
    let arx = fit_spans(Structure::Arx, &record)?;
    let bj = fit_spans(Structure::BoxJenkins, &record)?;
    let traces = [
        track_with(Method::rls(), &record)?,
        track_with(Method::rpem(), &record)?,
        track_with(hoid_survey::physical(), &record)?,
    ];
    let section = |name: &str, trace, batch| TraceSection {
        name: name.to_owned(),
        trace,
        batch,
    };
    let report = TrackReport {
        title: "A simulated run of condition C4, tracked".to_owned(),
        settings: vec![
            ("hoid".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
            ("condition".to_owned(), Condition::C4.to_string()),
            ("seed".to_owned(), "1".to_owned()),
        ],
        record: &record,
        traces: vec![
            section("RLS, ARX", &traces[0], batch_lines(&arx)),
            section("RPEM, BJ", &traces[1], batch_lines(&bj)),
            section("physical", &traces[2], Vec::new()),
        ],
        verdict: None,
        notes: Vec::new(),
    };
    std::fs::write(path, report.to_html()?)?;
    Ok(())
}

fn fit_spans(structure: Structure, record: &Record) -> Result<Vec<Fit>, Box<dyn Error>> {
    let estimator = Estimator::new(structure, structure.operator_orders(29));
    let fit = |(from, to)| -> Result<Fit, Box<dyn Error>> { Ok(estimator.fit(&[record.span(from, to)?])?) };
    SPANS.into_iter().map(fit).collect()
}

fn batch_lines(fits: &[Fit]) -> Vec<BatchLine<'_>> {
    let spans = SPANS.into_iter().zip(fits);
    spans
        .map(|((from_s, to_s), fit)| BatchLine { from_s, to_s, fit })
        .collect()
}

fn track_with(method: Method, record: &Record) -> Result<Trace, Box<dyn Error>> {
    let structure = method.default_structure();
    let mut options = TrackOptions::new(method, structure, structure.operator_orders(29));
    options.start = StartSource::Span(Some(SPANS[0]));
    Ok(track(record, &options, 1)?)
}
