//! The report page and the figure of a trace.

use std::path::PathBuf;

use hoid::analysis::TrackingResult;
use hoid::report::{BatchFit, TrackReport, batch_fit, default_batch_fits, figures::trace_panels, write_report};

use crate::{args::TrackArgs, commands::figure, error::CliError, output};

/// Writes the report page if `--report` gives a directory, and the figure of the parameters over time if `--figure`
/// gives a file.
pub fn write(args: &TrackArgs, tracked: &TrackingResult, batch: &[BatchFit]) -> Result<Option<PathBuf>, CliError> {
    if args.report.is_none() && args.picture.figure.is_none() {
        return Ok(None);
    }
    let report = TrackReport::from_tracked(tracked, batch);
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

/// Returns the batch fits with which the page compares the trace: the fits of the given spans, otherwise the start fit
/// and a fit of the last third; empty without `--report`. If the last third cannot be fitted, its fit is omitted with a
/// note.
pub fn batch_fits(args: &TrackArgs, tracked: &TrackingResult) -> Result<Vec<BatchFit>, CliError> {
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
        output::add_notice("", format!("the report has no batch fit of the last third: {error}"));
    }
    Ok(all)
}
