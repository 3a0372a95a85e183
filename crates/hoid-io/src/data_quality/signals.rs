//! The columns to examine, and the known properties of their time.

use std::ops::Range;

use super::issue::RowSpan;
use crate::table::Precision;

/// A column to examine.
#[derive(Clone, Copy)]
pub(crate) struct Signal<'a> {
    pub(crate) name: &'a str,
    pub(crate) values: &'a [f64],
}

impl Signal<'_> {
    /// Returns the values in the row before a row and in the row; `None` for the first row.
    pub(super) fn values_around_step(&self, row: usize) -> Option<(f64, f64)> {
        Some((*self.values.get(row.checked_sub(1)?)?, *self.values.get(row)?))
    }

    /// True if the value of a row equals the value of the row before.
    pub(super) fn repeats(&self, row: usize) -> bool {
        self.values_around_step(row)
            .is_some_and(|(before, value)| value == before)
    }
}

/// Columns of equal length, and the known properties of their time.
#[derive(Default)]
pub(crate) struct Signals<'a> {
    pub(crate) columns: Vec<Signal<'a>>,
    pub(crate) time: Option<Signal<'a>>,
    /// Precision with which the times are printed in the file.
    pub(crate) precision: Precision,
    /// Sampling frequency given by the user or stated in the file, Hz.
    pub(crate) nominal_hz: Option<f64>,
    /// Further columns that contain times.
    pub(crate) clocks: Vec<Signal<'a>>,
    /// Number of rows before the first examined row.
    pub(crate) before: usize,
}

/// Returns a row as a range.
pub(super) fn row_range(row: usize) -> Range<usize> {
    row..row.saturating_add(1)
}

/// Returns all ranges of consecutive true values.
pub(super) fn runs(holds: impl Iterator<Item = bool>) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (row, _) in holds.enumerate().filter(|(_, hold)| *hold) {
        match runs.last_mut() {
            Some(run) if run.end == row => run.end = row_range(row).end,
            _ => runs.push(row_range(row)),
        }
    }
    runs
}

impl Signals<'_> {
    /// Returns the number of rows.
    pub(super) fn row_count(&self) -> usize {
        let lengths = self.columns.iter().chain(&self.time).map(|signal| signal.values.len());
        lengths.min().unwrap_or(0)
    }

    /// Returns the time of a row in s; `None` if it is unknown.
    pub(super) fn time_s(&self, row: usize) -> Option<f64> {
        match (&self.time, self.nominal_hz) {
            (Some(time), _) => time.values.get(row).copied().filter(|t| t.is_finite()),
            (None, Some(hz)) => Some(row as f64 / hz).filter(|t| t.is_finite()),
            (None, None) => None,
        }
    }

    pub(super) fn row_span(&self, rows: &Range<usize>) -> RowSpan {
        RowSpan {
            row: self.before.saturating_add(rows.start).saturating_add(1),
            rows: rows.len(),
            from_s: self.time_s(rows.start),
            to_s: self
                .time_s(rows.end)
                .or_else(|| self.time_s(rows.end.saturating_sub(1))),
        }
    }
}
