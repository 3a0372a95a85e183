//! Conversion of the columns of a file to a record: selection of rows, grid and values.

use hoid_model::{Channel, Record};

use super::read_options::ReadOptions;
use super::repair;
use super::table_reader::TableReader;
use super::time_grid::TimeGrid;
use crate::IoError;
use crate::data_quality::{QualityIssue, issues_of_signals};
use crate::preparation::{Preparation, Step};
use crate::table::{Column, ColumnExpression, Signal, Table};
use crate::wording::{format_name, list_names};

/// A record read from a file, the steps applied to it, and notes about the reading.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadRecord {
    /// The record, labelled with the name of the file without extension.
    pub record: Record,
    /// Notes on parts of the file that were not read or look wrong, one sentence each.
    pub notes: Vec<String>,
    /// Steps applied to the values of the file, in the order of application.
    pub steps: Vec<Step>,
    /// Problems with the input, the output and their time, in the part of the file that is read, before any step.
    pub quality_issues: Vec<QualityIssue>,
}

/// Converts a table to a record; if `drop_repeated` is true, duplicated rows are dropped first.
pub(super) fn record_of(
    mut table: Table<'_>,
    options: &ReadOptions,
    drop_repeated: bool,
) -> Result<ReadRecord, IoError> {
    let file = table.source.file().to_owned();
    let names = table.names();
    let resolve = |expression: &ColumnExpression| expression.resolve(&names, &file);
    let input = options.input.as_ref().map(resolve).transpose()?;
    let output = resolve(&options.output)?;
    if input == Some(output) {
        let asked = options.output.to_string();
        return Err(IoError::SameColumn { file, requested: asked });
    }
    let time = names.iter().position(|name| *name == "t");
    if time.is_none() && options.sampling_hz.is_none() {
        let available = list_names(&names);
        return Err(IoError::NoSampling { file, available });
    }
    let quality_issues = issues_of_signals(&table, time, input.into_iter().chain([output]), options);
    let mut steps = Vec::new();
    match (drop_repeated, time) {
        (true, Some(time)) => {
            let (kept, step) = repair::drop_repeated(table, time);
            table = kept;
            steps.extend(step);
        }
        (true, None) => table.notes.push(String::from(
            "no rows were dropped: without a column t, a repeated row cannot be distinguished from held values",
        )),
        _ => {}
    }
    let mut reader = TableReader {
        table,
        options,
        file,
        steps,
        signals: input.into_iter().chain([output]).flat_map(Signal::columns).collect(),
    };
    let grid = reader.time_grid(time)?;
    let input = input.zip(options.input.as_ref());
    let read = reader.record(grid, time, input, (output, &options.output))?;
    Ok(ReadRecord { quality_issues, ..read })
}

impl ReadRecord {
    /// Prepares the record, and appends the preparation steps to those applied in reading.
    pub(super) fn prepare(mut self, preparation: &Preparation) -> Result<Self, IoError> {
        let (record, steps) = preparation.apply(self.record)?;
        self.steps.extend(steps);
        Ok(Self { record, ..self })
    }
}

impl TableReader<'_> {
    fn record(
        mut self,
        grid: TimeGrid,
        time: Option<usize>,
        input: Option<(Signal, &ColumnExpression)>,
        output: (Signal, &ColumnExpression),
    ) -> Result<ReadRecord, IoError> {
        let signals = || input.into_iter().chain([output]);
        let used = |column: usize| signals().any(|(signal, _)| signal.columns().any(|used| used == column));
        let about = |column: &Column| {
            let channel = Channel::new(column.name.clone(), column.unit.clone(), Vec::new());
            (channel.with_role(column.role.clone()), column.is_held)
        };
        let all: Vec<(Channel, bool)> = self.table.columns.iter().map(about).collect();
        let mut columns: Vec<Option<Channel>> = Vec::with_capacity(all.len());
        for (column, (channel, is_held)) in all.into_iter().enumerate() {
            if !used(column) && (channel.name.is_empty() || Some(column) == time) {
                columns.push(None);
                continue;
            }
            let of_time = grid.t.as_ref().filter(|_| Some(column) == time);
            let values = match of_time {
                Some(t) => Ok(t.clone()),
                None => self.values(column, grid.rows.clone(), grid.t.as_deref()),
            };
            match values {
                Ok(values) => {
                    let values = match grid.t.as_ref().zip(grid.resampled) {
                        None => values,
                        Some((t, n)) => repair::resample(t, &values, (grid.start_s, grid.sample_time.s()), n, is_held),
                    };
                    columns.push(Some(Channel { values, ..channel }));
                }
                Err(error) if used(column) => return Err(error),
                Err(error) => {
                    self.table
                        .notes
                        .push(format!("column {} is left out: {error}", format_name(&channel.name)));
                    columns.push(None);
                }
            }
        }
        // Expressions are evaluated first, because a column that is itself a signal is then moved out of `columns`.
        let mut made: Vec<Channel> = signals()
            .map(|(signal, expression)| combine(signal, expression, &columns))
            .collect();
        for ((signal, _), made) in signals().zip(&mut made) {
            if let Signal::Column(column) = signal {
                *made = (columns.get_mut(column).and_then(Option::take)).unwrap_or_else(empty_channel);
            }
        }
        let output = made.pop().unwrap_or_else(empty_channel);
        let record = match made.pop() {
            Some(input) => Record::new(grid.sample_time, input, output),
            None => Record::from_output(grid.sample_time, output),
        };
        let mut record = record
            .map_err(|source| self.model_error(source))?
            .starting_at(grid.start_s);
        for channel in columns.into_iter().flatten() {
            record = record
                .with_channel(channel)
                .map_err(|source| self.model_error(source))?;
        }
        Ok(ReadRecord {
            record,
            notes: self.table.notes,
            steps: self.steps,
            quality_issues: Vec::new(),
        })
    }
}

/// Returns a channel without samples, which no record accepts.
fn empty_channel() -> Channel {
    Channel::new("", "", Vec::new())
}

/// Evaluates an expression of columns; an expression that is a single column gives an empty channel here. The channel
/// is named after the expression; a difference has a unit if both terms have the same unit.
fn combine(signal: Signal, expression: &ColumnExpression, columns: &[Option<Channel>]) -> Channel {
    let nothing = empty_channel();
    let column = |index: usize| columns.get(index).and_then(Option::as_ref).unwrap_or(&nothing);
    match signal {
        Signal::Column(_) => nothing,
        Signal::Negative(a) => {
            let values = column(a).values.iter().map(|v| -v).collect();
            Channel::new(expression.to_string(), column(a).unit.clone(), values)
        }
        Signal::Difference(a, b) => {
            let (a, b) = (column(a), column(b));
            let values = a.values.iter().zip(&b.values).map(|(a, b)| a - b).collect();
            let unit = if a.unit == b.unit { a.unit.as_str() } else { "" };
            Channel::new(expression.to_string(), unit, values)
        }
    }
}
