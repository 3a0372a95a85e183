//! Conversion of a table to a record: the columns are taken one by one, checked and repaired.

use std::ops::Range;

use hoid_model::{ModelError, numbers::count_with_noun};

use super::read_options::ReadOptions;
use super::repair::{self, OpenEnd};
use crate::IoError;
use crate::preparation::Step;
use crate::table::{Column, Table, interpolate};
use crate::wording::{format_name, sparse_option};

/// The table to be converted, and the steps applied to it.
pub(super) struct TableReader<'a> {
    pub(super) table: Table<'a>,
    pub(super) options: &'a ReadOptions,
    pub(super) file: String,
    pub(super) steps: Vec<Step>,
    /// Indices of the columns of the input and the output.
    pub(super) signals: Vec<usize>,
}

impl TableReader<'_> {
    pub(super) fn model_error(&self, source: ModelError) -> IoError {
        IoError::Model {
            file: self.file.clone(),
            source,
        }
    }

    /// Returns the rows to use. If missing values are interpolated, these are the rows in which all signals have values
    /// on both sides, because two topics in one table do not start and end in the same row; otherwise all `rows`.
    pub(super) fn rows_between_values(&mut self, rows: Range<usize>, time: Option<usize>) -> Range<usize> {
        if !self.options.repair.fill {
            return rows;
        }
        let finite = |column: &usize, row: &usize| self.table.value(*column, *row).is_finite();
        let begins = |column: &usize| rows.clone().find(|row| finite(column, row));
        let ends = |column: &usize| rows.clone().rev().find(|row| finite(column, row));
        let first = self.signals.iter().map(begins).collect::<Option<Vec<_>>>();
        let last = self.signals.iter().map(ends).collect::<Option<Vec<_>>>();
        let bounds = (first.and_then(|all| all.into_iter().max())).zip(last.and_then(|all| all.into_iter().min()));
        let Some((first, last)) = bounds.filter(|(first, last)| first < last) else {
            return rows;
        };
        let kept = first..last.saturating_add(1);
        let (before, after) = (kept.start.saturating_sub(rows.start), rows.end.saturating_sub(kept.end));
        if (before, after) != (0, 0) {
            let columns = self.signals.iter().filter_map(|column| self.table.columns.get(*column));
            let names: Vec<String> = columns.map(|column| format_name(&column.name)).collect();
            self.table.notes.push(format!(
                "{} at the start and {after} at the end left out: --fill has no value to bridge to there (columns: {})",
                count_with_noun(before, "row"),
                names.join(", ")
            ));
        }
        // A missing value in the first or the last row of the range has a neighbour outside the range, and is
        // interpolated here.
        for at in [first, last] {
            for &column in &self.signals {
                let value = self.interpolated_value(column, at, &rows, time);
                let place = self.table.columns.get_mut(column);
                if let (Some(value), Some(place)) = (value, place.and_then(|column| column.values.get_mut(at))) {
                    *place = value;
                }
            }
        }
        kept
    }

    /// Returns the value interpolated in row `at` between its neighbours; `None` if the value is not missing, or if
    /// there is no value on one side.
    fn interpolated_value(&self, column: usize, at: usize, rows: &Range<usize>, time: Option<usize>) -> Option<f64> {
        let source = self.table.columns.get(column)?;
        if !source.values.get(at)?.is_nan() || source.texts.binary_search(&at).is_ok() {
            return None;
        }
        let finite = |row: &usize| self.table.value(column, *row).is_finite();
        let (before, after) = (
            (rows.start..at).rev().find(finite)?,
            (at..rows.end).skip(1).find(finite)?,
        );
        let x = |row: usize| time.map_or(row as f64, |time| self.table.value(time, row));
        let part = (x(at) - x(before)) / (x(after) - x(before));
        let [before, after] = [before, after].map(|row| self.table.value(column, row));
        let value = interpolate(before, after, part);
        value.is_finite().then_some(value)
    }

    /// Returns the times at which the signal with the most samples has values, as two topics that share a table have
    /// separate clocks; `None` unless there are fewer of these times than rows.
    pub(super) fn recorded_times(&self, rows: &Range<usize>, time: usize, t: &[f64]) -> Option<Vec<f64>> {
        // If the time itself is a signal, it has a value in each row; its values have already been moved out of the
        // table.
        if self.signals.contains(&time) {
            return None;
        }
        let of = |column: &Column| -> Vec<f64> {
            let values = column.recorded_values(rows.clone());
            // The first and the last row are excluded because they may have been filled in.
            let inside = values.iter().zip(t).skip(1).take(values.len().saturating_sub(2));
            let own = inside.filter(|(value, _)| value.is_finite());
            own.map(|(_, t)| *t).collect()
        };
        let signals = self.signals.iter().filter_map(|column| self.table.columns.get(*column));
        let densest = signals.map(of).max_by_key(Vec::len)?;
        (densest.len() > 2 && t.len().saturating_sub(densest.len()) > 2).then_some(densest)
    }

    /// Returns the values of a column in use; missing values are interpolated if requested, and any other value that is
    /// not finite is an error.
    pub(super) fn values(&mut self, column: usize, rows: Range<usize>, t: Option<&[f64]>) -> Result<Vec<f64>, IoError> {
        let Some(source) = self.table.columns.get_mut(column) else {
            return Ok(Vec::new());
        };
        let lacks = source.is_sparse(rows.clone());
        let may_fill = self.options.repair.fill;
        let finite = |row: &usize| source.values.get(*row).is_some_and(|value| value.is_finite());
        let bad = |row: &usize| !(finite(row) || may_fill && source.is_missing(*row));
        if let Some(row) = rows.clone().find(bad) {
            return Err(self.table.bad_value_error(column, row, rows));
        }
        // The values are moved out of the table, since a column is read only once; long columns are thus not copied.
        let mut values = std::mem::take(&mut source.values);
        values.truncate(rows.end);
        values.drain(..rows.start);
        let bridged = repair::fill(&mut values, t).map_err(|open| {
            let (row, end) = match open {
                OpenEnd::Start => (rows.start, "start"),
                OpenEnd::End => (rows.end.saturating_sub(1), "end"),
            };
            IoError::NothingToBridgeTo {
                file: self.file.clone(),
                location: self.table.source.location(row),
                column: format_name(&source.name),
                end,
            }
        })?;
        if bridged.values > 0 && lacks && self.signals.contains(&column) {
            self.table.notes.push(format!(
                "column {} has many missing values, as if logged at its own times: --fill interpolates linearly; {} \
                 holds the last value",
                format_name(&source.name),
                sparse_option(&source.name)
            ));
        }
        if bridged.values > 0 {
            self.steps.push(Step::Fill {
                channel: source.name.clone(),
                values: bridged.values,
                longest: bridged.longest,
            });
        }
        Ok(values)
    }
}
