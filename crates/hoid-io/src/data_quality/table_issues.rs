//! Problems with the table columns from which a record is made.

use std::borrow::Cow;
use std::ops::Range;

use super::issue::{QualityIssue, QualityIssueKind};
use super::search::{find_issues, is_clock_name};
use super::signals::{Signal, Signals};
use crate::IoError;
use crate::record::ReadOptions;
use crate::table::{Column, Table, column_expression};

/// Returns the problems with the requested columns within the requested span, and the rows of this span.
///
/// # Errors
/// [`IoError::NoSuchColumn`] and [`IoError::Expression`].
pub(crate) fn issues_of_record(
    table: &Table<'_>,
    options: &ReadOptions,
) -> Result<(Vec<QualityIssue>, Range<usize>), IoError> {
    let file = table.source.file();
    let names = table.names();
    let signals = options.input.iter().chain([&options.output]);
    let signals: Vec<column_expression::Signal> =
        signals.map(|one| one.resolve(&names, file)).collect::<Result<_, _>>()?;
    let time = names.iter().position(|name| *name == "t");
    let rows = span_rows(table, time, options);
    Ok((issues_of_signals(table, time, signals.into_iter(), options), rows))
}

pub(crate) fn issues_of_signals(
    table: &Table<'_>,
    time: Option<usize>,
    signals: impl Iterator<Item = column_expression::Signal>,
    options: &ReadOptions,
) -> Vec<QualityIssue> {
    let signals: Vec<column_expression::Signal> = signals.collect();
    let mut used: Vec<usize> = signals
        .iter()
        .copied()
        .flat_map(column_expression::Signal::columns)
        .collect();
    used.sort_unstable();
    used.dedup();
    // A sampling frequency given for resampling is not the nominal rate of the recorder.
    let nominal_hz = options.sampling_hz.filter(|_| !options.repair.resample);
    let mut found = issues_of_columns(table, &used, time, nominal_hz, span_rows(table, time, options));
    // One term of a difference may be constant, such as a zero reference, without being a problem.
    let names = |one: &QualityIssue, at: usize| table.columns.get(at).is_some_and(|column| column.name == one.channel);
    let constant: Vec<QualityIssue> = found
        .iter()
        .filter(|one| one.kind == QualityIssueKind::Constant)
        .cloned()
        .collect();
    found.retain(|one| {
        let is_fair = |signal: &column_expression::Signal| match signal {
            column_expression::Signal::Difference(a, b) if names(one, *a) => {
                constant.iter().all(|other| !names(other, *b))
            }
            column_expression::Signal::Difference(a, b) if names(one, *b) => {
                constant.iter().all(|other| !names(other, *a))
            }
            _ => false,
        };
        one.kind != QualityIssueKind::Constant || !signals.iter().any(is_fair)
    });
    found
}

/// Returns the rows of the requested span, as far as the time in the file determines them.
fn span_rows(table: &Table<'_>, time: Option<usize>, options: &ReadOptions) -> Range<usize> {
    let at = |row: usize| match (time, options.sampling_hz) {
        (Some(time), _) => table.value(time, row),
        (None, Some(hz)) => row as f64 / hz,
        (None, None) => f64::NAN,
    };
    let (from, to) = options.span_s;
    let start = from.map_or(0, |from| {
        (0..table.rows).find(|row| at(*row) >= from).unwrap_or(table.rows)
    });
    let end = to.and_then(|to| (start..table.rows).find(|row| at(*row) >= to));
    start..end.unwrap_or(table.rows)
}

/// Returns the problems with some columns of a table.
fn issues_of_columns<'a>(
    table: &'a Table<'_>,
    used: &[usize],
    time: Option<usize>,
    nominal_hz: Option<f64>,
    rows: Range<usize>,
) -> Vec<QualityIssue> {
    // In a column filled in by --sparse, neither the filled-in values nor the originally missing ones are faults of the
    // recording.
    let own: Vec<(&Column, Cow<'_, [f64]>)> = (used.iter())
        .filter_map(|at| table.columns.get(*at))
        .map(|column| (column, column.recorded_values(rows.clone())))
        .collect();
    let signal = |column: &'a Column| Signal {
        name: &column.name,
        values: column.values.get(rows.clone()).unwrap_or_default(),
    };
    let is_clock = |(at, column): &(usize, &Column)| Some(*at) != time && is_clock_name(&column.name);
    let clocks = table.columns.iter().enumerate().filter(is_clock);
    let time = time.and_then(|time| table.columns.get(time));
    let mut found = find_issues(&Signals {
        columns: own
            .iter()
            .map(|(column, values)| Signal {
                name: &column.name,
                values,
            })
            .collect(),
        time: time.map(signal),
        precision: time.map(|time| time.precision).unwrap_or_default(),
        nominal_hz: nominal_hz.or(table.sample_time_s.map(|ts| 1.0 / ts)),
        clocks: clocks.map(|(_, column)| signal(column)).collect(),
        before: rows.start,
    });
    let is_sparse = |name: &str| {
        table
            .columns
            .iter()
            .any(|column| column.name == name && !column.filled_rows.is_empty())
    };
    found.retain(|one| one.kind != QualityIssueKind::Missing || !is_sparse(&one.channel));
    found
}
