//! Conversion of a table to a record: its columns are taken one by one, checked and repaired.

use std::ops::Range;

use hoid_model::ModelError;

use super::read_options::ReadOptions;
use super::repair::{self, OpenEnd};
use crate::IoError;
use crate::preparation::Step;
use crate::table::Table;
use crate::wording::{named, sparse_option};

/// The table, and the steps applied to it.
pub(super) struct TableReader<'a> {
    pub(super) table: Table<'a>,
    pub(super) options: &'a ReadOptions,
    pub(super) file: String,
    pub(super) steps: Vec<Step>,
    /// Columns of the input and the output.
    pub(super) signals: Vec<usize>,
}

impl TableReader<'_> {
    pub(super) fn model(&self, source: ModelError) -> IoError {
        IoError::Model {
            file: self.file.clone(),
            source,
        }
    }

    /// The range of these rows in which all signals have values on both sides, if missing ones are interpolated: two
    /// topics in one table do not start and end in the same row.
    pub(super) fn between_values(&mut self, rows: Range<usize>, time: Option<usize>) -> Range<usize> {
        if !self.options.repair.fill {
            return rows;
        }
        let finite = |column: &usize, row: &usize| self.table.columns[*column].values[*row].is_finite();
        let begins = |column: &usize| rows.clone().find(|row| finite(column, row));
        let ends = |column: &usize| rows.clone().rev().find(|row| finite(column, row));
        let first = self.signals.iter().map(begins).collect::<Option<Vec<_>>>();
        let last = self.signals.iter().map(ends).collect::<Option<Vec<_>>>();
        let bounds = (first.and_then(|all| all.into_iter().max())).zip(last.and_then(|all| all.into_iter().min()));
        let Some((first, last)) = bounds.filter(|(first, last)| first < last) else {
            return rows;
        };
        let (before, behind) = (first - rows.start, rows.end - 1 - last);
        if before + behind > 0 {
            let names: Vec<String> = (self.signals.iter())
                .map(|column| named(&self.table.columns[*column].name))
                .collect();
            self.table.notes.push(format!(
                "{before} rows at the start and {behind} at the end are left out: {} have not all a value there to bridge to",
                names.join(" and ")
            ));
        }
        // The first and the last row of the range lie between values outside it.
        for at in [first, last] {
            for &column in &self.signals {
                if let Some(value) = self.between(column, at, &rows, time) {
                    self.table.columns[column].values[at] = value;
                }
            }
        }
        first..last + 1
    }

    /// A missing value of a column in a row, interpolated between its neighbours; `None` if it is not missing, or one
    /// side has no value.
    fn between(&self, column: usize, at: usize, rows: &Range<usize>, time: Option<usize>) -> Option<f64> {
        let source = &self.table.columns[column];
        if !source.values[at].is_nan() || source.texts.binary_search(&at).is_ok() {
            return None;
        }
        let finite = |row: &usize| source.values[*row].is_finite();
        let (before, behind) = ((rows.start..at).rev().find(finite)?, (at + 1..rows.end).find(finite)?);
        let x = |row: usize| time.map_or(row as f64, |time| self.table.columns[time].values[row]);
        let part = (x(at) - x(before)) / (x(behind) - x(before));
        let value = source.values[before] + part * (source.values[behind] - source.values[before]);
        value.is_finite().then_some(value)
    }

    /// The times of the signal with the most samples, if there are fewer than rows: each of two topics in one table has
    /// its own clock.
    pub(super) fn own_times(&self, rows: &Range<usize>, t: &[f64]) -> Option<Vec<f64>> {
        let of = |column: &usize| -> Vec<f64> {
            let values = self.table.columns[*column].own_values(rows.clone());
            // The first and the last row may be filled.
            let inside = values.iter().zip(t).skip(1).take(values.len().saturating_sub(2));
            let own = inside.filter(|(value, _)| value.is_finite());
            own.map(|(_, t)| *t).collect()
        };
        let densest = self.signals.iter().map(of).max_by_key(Vec::len)?;
        (densest.len() > 2 && densest.len() + 2 < t.len()).then_some(densest)
    }

    /// The values of a column in use: all finite, the missing ones interpolated if requested.
    pub(super) fn values(&mut self, column: usize, rows: Range<usize>, t: Option<&[f64]>) -> Result<Vec<f64>, IoError> {
        let lacks = self.table.columns[column].is_sparse(rows.clone());
        let source = &mut self.table.columns[column];
        let may_fill = self.options.repair.fill;
        let bridgeable =
            |row: &usize| may_fill && source.values[*row].is_nan() && source.texts.binary_search(row).is_err();
        let bad = |row: &usize| !source.values[*row].is_finite() && !bridgeable(row);
        if let Some(row) = rows.clone().find(bad) {
            return Err(self.table.bad_value(column, row, rows));
        }
        // A column is read only once: long files are not copied.
        let mut values = std::mem::take(&mut source.values);
        values.truncate(rows.end);
        values.drain(..rows.start);
        let bridged = repair::fill(&mut values, t).map_err(|open| {
            let (row, end) = match open {
                OpenEnd::Start => (rows.start, "start"),
                OpenEnd::End => (rows.end - 1, "end"),
            };
            IoError::NothingToBridgeTo {
                file: self.file.clone(),
                place: self.table.source.place(row),
                column: named(&source.name),
                end,
            }
        })?;
        if bridged.values > 0 && lacks && self.signals.contains(&column) {
            self.table.notes.push(format!(
                "column {} lacks values at many places, as if logged at instants of its own: --fill draws straight lines, {} holds the last value",
                named(&source.name),
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
