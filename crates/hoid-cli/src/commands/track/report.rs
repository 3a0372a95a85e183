//! The page about a trace.

use std::path::PathBuf;

use hoid_ident::{Estimator, Fit, IdentError};
use hoid_report::{BatchLine, TraceSection, TrackReport};

use super::result::Tracked;
use crate::{
    args::TrackArgs,
    commands::{identify::write_page, reading::accounts},
    error::CliError,
    output,
};

/// A batch fit and its span, s.
type Batch = ((f64, f64), Fit);

/// Writes the page into the directory that was asked for, nothing where none was.
pub fn write(args: &TrackArgs, tracked: &Tracked<'_>, batch: &[Batch]) -> Result<Option<PathBuf>, CliError> {
    let Some(directory) = &args.report else {
        return Ok(None);
    };
    let line = |((from_s, to_s), fit)| BatchLine { from_s, to_s, fit };
    let batch: Vec<BatchLine<'_>> = batch.iter().map(|(span, fit)| line((*span, fit))).collect();
    let mut settings = vec![
        ("hoid".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ("record".to_owned(), tracked.file.clone()),
    ];
    settings.extend(tracked.settings.iter().cloned());
    settings.extend(accounts(
        std::slice::from_ref(&tracked.file),
        std::slice::from_ref(tracked.account),
    ));
    let options = tracked.trace.options();
    let report = TrackReport {
        title: format!("{} tracked by {}", tracked.record.label(), options.method.name()),
        settings,
        record: tracked.record,
        traces: vec![TraceSection {
            name: format!("{}, {}", options.method.name(), options.structure),
            trace: tracked.trace,
            batch,
        }],
        notes: Vec::new(),
    };
    write_page(directory, &report.to_html()?).map(Some)
}

/// The batch fits that the page compares with: of the spans as typed, else the start fit and that of the last third. A span of the
/// program's own choice that cannot be fitted is left out with a note.
pub fn batch_fits(args: &TrackArgs, tracked: &Tracked<'_>) -> Result<Vec<Batch>, CliError> {
    if args.report.is_none() {
        return Ok(Vec::new());
    }
    let (record, options) = (tracked.record, tracked.trace.options());
    let fit = |(from, to): (f64, f64)| -> Result<Batch, IdentError> {
        let estimator = Estimator {
            search: options.search,
            ..Estimator::new(options.structure, options.orders)
        };
        Ok(((from, to), estimator.fit(&[record.span(from, to)?])?))
    };
    if !args.batch.is_empty() {
        return Ok(args.batch.iter().map(|span| fit(*span)).collect::<Result<_, _>>()?);
    }
    let mut all = Vec::new();
    if let (Some(start), Some(span)) = (tracked.trace.start(), &tracked.span) {
        all.push(((span.time_s(0), span.time_s(span.len())), start.clone()));
    }
    match fit((
        record.time_s(record.len() - record.len() / 3),
        record.time_s(record.len()),
    )) {
        Ok(last) => all.push(last),
        Err(error) => output::complain(&format!("the report has no batch fit of the last third: {error}")),
    }
    Ok(all)
}
