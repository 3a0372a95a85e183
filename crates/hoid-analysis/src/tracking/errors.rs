//! Errors of a trace relative to the true values in its record.

use hoid_model::{NotConvertible, Record, uncertainty::OperatorEstimate};
use hoid_numerics::statistics::mean;
use hoid_track::{Trace, operator_parameter};

/// Returns, for each parameter whose true value is in the record, the root mean square of the relative error over all
/// rows from `first` on that have an operator.
pub fn relative_errors(
    record: &Record,
    trace: &Trace,
    operators: &[Result<OperatorEstimate, NotConvertible>],
    first: usize,
    columns: &[&'static str],
) -> Vec<(&'static str, f64)> {
    let (start_s, ts) = (record.time_s(0), record.sample_time().s());
    let of = |name: &'static str| {
        let truth = record.channel(name)?;
        let squares: Vec<f64> = (first..trace.len())
            .filter_map(|row| {
                let found = operator_parameter(&operators[row], name)?.value;
                let k = ((trace.times_s()[row] - start_s) / ts).round() as usize;
                let truth = truth.get(k).copied().filter(|v| *v != 0.0)?;
                Some((found / truth - 1.0).powi(2))
            })
            .collect();
        (!squares.is_empty()).then(|| (name, mean(&squares).sqrt()))
    };
    columns.iter().copied().filter_map(of).collect()
}
