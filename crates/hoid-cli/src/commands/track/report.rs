//! The page about a trace.

use std::path::PathBuf;

use hoid::analysis::Tracked;
use hoid::report::{BatchFit, TrackReport, batch_fit, default_batch_fits, figures::trace_panels, write_report};

use crate::{args::TrackArgs, commands::figure, error::CliError, output};

/// Writes the page to the directory of `--report` and the parameters over time to the file of
/// `--figure`; nothing without them.
pub fn write(args: &TrackArgs, tracked: &Tracked, batch: &[BatchFit]) -> Result<Option<PathBuf>, CliError> {
    if args.report.is_none() && args.picture.figure.is_none() {
        return Ok(None);
    }
    let report = TrackReport::of_tracked(tracked, batch);
    if let Some(path) = &args.picture.figure {
        let grid = match report.response_grid()? {
            Some(grid) => grid,
            None if tracked.has_operator() => report.operator_grid()?,
            None => report.coefficient_grid()?,
        };
        figure::write(path, &trace_panels("tracked", &report.title, &grid), args.picture.width)?;
    }
    let Some(directory) = &args.report else {
        return Ok(None);
    };
    Ok(Some(write_report(directory, &report.to_html()?)?))
}

/// The batch fits for comparison on the page: those of the given spans, otherwise the start fit and
/// that of the last third. A default span that cannot be fitted is omitted with a note.
pub fn batch_fits(args: &TrackArgs, tracked: &Tracked) -> Result<Vec<BatchFit>, CliError> {
    if args.report.is_none() {
        return Ok(Vec::new());
    }
    let (record, trace) = (tracked.record(), &tracked.trace);
    if !args.batch.is_empty() {
        return Ok(args
            .batch
            .iter()
            .map(|span| batch_fit(trace, record, *span))
            .collect::<Result<_, _>>()?);
    }
    let (all, missing) = default_batch_fits(trace, record);
    if let Some(error) = missing {
        output::notice("", format!("the report has no batch fit of the last third: {error}"));
    }
    Ok(all)
}
