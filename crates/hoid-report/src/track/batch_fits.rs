//! Batch fits for comparison with a recursive estimate.

use hoid_ident::{Estimator, Fit, IdentError};
use hoid_model::{Orders, Record};
use hoid_numerics::statistics::upper_median;
use hoid_track::{StartSource, Trace};

/// The span of a batch fit (s) and the fit.
pub type BatchFit = ((f64, f64), Fit);

/// Returns the orders of a trace. If the trace tracks the delay, nk is the median of the estimated delay in a span (s).
fn orders_within(trace: &Trace, (from, to): (f64, f64)) -> Orders {
    let orders = trace.options().orders;
    if trace.options().method.track_delay_s().is_none() {
        return orders;
    }
    let rows = trace
        .times_s()
        .iter()
        .enumerate()
        .filter(|(_, t)| (from..to).contains(*t));
    let mut delays: Vec<f64> = rows
        .filter_map(|(row, _)| Some(trace.operator_values(row).ok()?.tau_e_s.value))
        .collect();
    match upper_median(&mut delays) {
        Some(delay_s) => Orders {
            nk: (delay_s / trace.sample_time().s()).round() as usize + 1,
            ..orders
        },
        None => orders,
    }
}

/// Fits a span of a record with the structure and the orders of a trace. If the trace tracks the delay, the fit uses
/// the median of the estimated delay in that span.
///
/// # Errors
/// The errors of the fit.
pub fn batch_fit(trace: &Trace, record: &Record, (from, to): (f64, f64)) -> Result<BatchFit, IdentError> {
    let options = trace.options();
    let estimator = Estimator {
        search: options.search,
        ..Estimator::new(options.structure, orders_within(trace, (from, to)))
    };
    Ok(((from, to), estimator.fit(&[record.span(from, to)?])?))
}

/// Returns the default batch fits for comparison with a trace: the start fit and, unless the method starts without a
/// fit, a fit to the last third of the record. The second element is the error of the fit to the last third, if that
/// fit fails.
pub fn default_batch_fits(trace: &Trace, record: &Record) -> (Vec<BatchFit>, Option<IdentError>) {
    let mut all = Vec::new();
    if let (Some(start), StartSource::Span(Some((from, to)))) = (trace.start(), &trace.options().start)
        && let Ok(span) = record.span(*from, *to)
    {
        all.push(((span.time_s(0), span.time_s(span.len())), start.clone()));
    }
    if trace.options().method.is_self_starting() {
        // The orders of a method without a start fit are unsuitable for a batch fit, because the noise model is long
        // and the method tracks its own delay.
        return (all, None);
    }
    let last_third = (
        record.time_s(record.len() - record.len() / 3),
        record.time_s(record.len()),
    );
    match batch_fit(trace, record, last_third) {
        Ok(last) => {
            all.push(last);
            (all, None)
        }
        Err(error) => (all, Some(error)),
    }
}
