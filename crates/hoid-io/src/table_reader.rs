//! A table on its way to a record: its columns are taken one by one, checked and repaired.

use std::ops::Range;

use hoid_model::ModelError;

use crate::IoError;
use crate::preparation::Step;
use crate::read_options::ReadOptions;
use crate::repair::{self, OpenEnd};
use crate::table::Table;
use crate::wording::named;

/// The table, and what was done to it.
pub(crate) struct TableReader<'a> {
    pub(crate) table: Table<'a>,
    pub(crate) options: &'a ReadOptions,
    pub(crate) file: String,
    pub(crate) steps: Vec<Step>,
}

impl TableReader<'_> {
    pub(crate) fn model(&self, source: ModelError) -> IoError {
        IoError::Model {
            file: self.file.clone(),
            source,
        }
    }

    /// The values of a column in use: all finite, the missing ones bridged where that was asked
    /// for.
    pub(crate) fn values(&mut self, column: usize, rows: Range<usize>, t: Option<&[f64]>) -> Result<Vec<f64>, IoError> {
        let source = &mut self.table.columns[column];
        let may_fill = self.options.repair.fill;
        let bridgeable =
            |row: &usize| may_fill && source.values[*row].is_nan() && source.texts.binary_search(row).is_err();
        let bad = |row: &usize| !source.values[*row].is_finite() && !bridgeable(row);
        if let Some(row) = rows.clone().find(bad) {
            return Err(self.table.bad_value(column, row, rows));
        }
        // Nobody reads a column twice: what a file of hours fills is not copied.
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
