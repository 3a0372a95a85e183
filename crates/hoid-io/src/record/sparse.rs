//! Columns that were logged at their own times: topics with several rates in one table, as produced by an outer join.
//!
//! Let `x_i` be the values logged in a column at the times `t_i`, and t the time of a row between `t_i` and `t_{i+1}`:
//!
//! | treatment | value in that row |
//! |---|---|
//! | [`SparseTreatment::Hold`] | `x_i`, as for a display or an actuator that is updated at `t_i` |
//! | [`SparseTreatment::Linear`] | `x_i + (x_{i+1} - x_i) (t - t_i)/(t_{i+1} - t_i)`, for a signal that is smooth between samples |
//! | [`SparseTreatment::Drop`] | none: the row is omitted |
//!
//! On average, a held value is late by half the time between logged values. Rows before the first logged value and
//! after the last one are cut. All values are computed before the rows and the span are cut, so a row at the start of a
//! span takes the value logged before the span. Text and infinite numbers do not count as missing values: they remain,
//! and reading rejects them.

use std::ops::Range;

use super::read_options::{ReadOptions, SparseTreatment};
use crate::IoError;
use crate::preparation::Step;
use crate::table::{Column, ColumnExpression, Signal, Table, keep_rows};
use hoid_model::numbers::count_with_noun;

use crate::wording::{format_name, list_names};

const STEP_NAME: &str = "sparse";

/// In the columns named as sparse, fills in the rows without a value or drops these rows; returns the table and the
/// applied steps.
///
/// # Errors
/// [`IoError::Preparation`] if a column does not exist, is the time, is named twice or is completely empty, or if no
/// row remains; [`IoError::NoSuchColumn`].
pub(super) fn close_gaps<'a>(mut table: Table<'a>, options: &ReadOptions) -> Result<(Table<'a>, Vec<Step>), IoError> {
    if options.sparse.is_empty() {
        return Ok((table, Vec::new()));
    }
    let x = abscissa(&table, options);
    let mut steps = Vec::new();
    let mut bounds = 0..table.rows;
    let mut dropped: Vec<usize> = Vec::new();
    let columns = sparse_columns(&table, options)?;
    for &(column, how) in &columns {
        let Some(sparse) = table.columns.get_mut(column) else {
            continue;
        };
        let gaps = ColumnCoverage::of(sparse);
        let name = format_name(&sparse.name);
        let Some(own) = gaps.value_range.clone() else {
            let found = format!("column {name} has no value in {} rows", table.rows);
            return Err(sparse_error(
                &table,
                found,
                "a column with some values; check the recording",
            ));
        };
        if gaps.missing.is_empty() {
            let note = format!("column {name} has a value in every row: --sparse has no effect on it");
            table.notes.push(note);
            continue;
        }
        bounds = bounds.start.max(own.start)..bounds.end.min(own.end);
        steps.push(gaps.step(&sparse.name, how, &x));
        match how {
            SparseTreatment::Drop => dropped.extend(gaps.missing),
            SparseTreatment::Hold | SparseTreatment::Linear => gaps.fill(sparse, how, &x),
        }
    }
    dropped.sort_unstable();
    let rows: Vec<usize> = bounds
        .clone()
        .filter(|row| dropped.binary_search(row).is_err())
        .collect();
    if rows.is_empty() {
        let named = columns.iter().filter_map(|(at, _)| table.columns.get(*at));
        let names: Vec<&str> = named.map(|column| column.name.as_str()).collect();
        let found = format!(
            "the columns {} have no rows in common between their first and last values",
            list_names(&names)
        );
        return Err(sparse_error(&table, found, "columns that were logged at the same time"));
    }
    if rows.len() < table.rows {
        report_cut(&mut table, &bounds);
        table = keep_rows(table, rows);
    }
    Ok((table, steps))
}

fn report_cut(table: &mut Table<'_>, bounds: &Range<usize>) {
    let (before, after) = (bounds.start, table.rows.saturating_sub(bounds.end));
    if (before, after) != (0, 0) {
        table.notes.push(format!(
            "{} at the start and {after} at the end were cut: a sparse column has no values there",
            count_with_noun(before, "row")
        ));
    }
}

fn sparse_error(table: &Table<'_>, found: String, expected: &str) -> IoError {
    IoError::Preparation {
        record: table.source.file().to_owned(),
        step: STEP_NAME,
        found,
        expected: expected.to_owned(),
    }
}

/// Returns the named columns with their treatment. `e` and `u` denote the input and the output unless a column has that
/// name.
fn sparse_columns(table: &Table<'_>, options: &ReadOptions) -> Result<Vec<(usize, SparseTreatment)>, IoError> {
    let names = table.names();
    let file = table.source.file();
    let of = |expression: Option<&ColumnExpression>| -> Result<Vec<usize>, IoError> {
        let signal = expression.map(|one| one.resolve(&names, file)).transpose()?;
        Ok(signal.into_iter().flat_map(Signal::columns).collect())
    };
    let mut all: Vec<(usize, SparseTreatment)> = Vec::new();
    for (name, how) in &options.sparse {
        let found = match (names.iter().position(|known| known == name), name.as_str()) {
            (Some(_), "t") => {
                let expected = "a column other than t, because every row needs a time";
                return Err(sparse_error(table, "t is the time".to_owned(), expected));
            }
            (Some(at), _) => vec![at],
            (None, "e") => of(options.input.as_ref())?,
            (None, "u") => of(Some(&options.output))?,
            (None, _) => Vec::new(),
        };
        if found.is_empty() {
            let found = format!("there is no column \"{}\"", format_name(name));
            let expected = format!("one of {}, or e for the input and u for the output", list_names(&names));
            return Err(sparse_error(table, found, &expected));
        }
        for column in found {
            if all.iter().any(|(known, _)| *known == column) {
                let found = format!(
                    "column {} is named twice",
                    names.get(column).map_or_else(String::new, |name| format_name(name))
                );
                return Err(sparse_error(table, found, "each column once"));
            }
            all.push((column, *how));
        }
    }
    Ok(all)
}

/// Returns the time of each row of the table, s: the time t, or the time that follows from counting the samples.
fn abscissa(table: &Table<'_>, options: &ReadOptions) -> Vec<f64> {
    let time = table.columns.iter().find(|column| column.name == "t");
    match (time, options.sampling_hz) {
        (Some(time), None) => time.values.clone(),
        (Some(time), Some(_)) if options.repair.resample => time.values.clone(),
        (_, hz) => (0..table.rows).map(|row| row as f64 / hz.unwrap_or(1.0)).collect(),
    }
}

/// Returns the value in a row; NaN if the row does not exist.
fn at(values: &[f64], row: usize) -> f64 {
    values.get(row).copied().unwrap_or(f64::NAN)
}

/// Rows of a column with and without a value.
struct ColumnCoverage {
    /// Range from the first to the last row with a value; `None` if no row has a value.
    value_range: Option<Range<usize>>,
    /// Rows without a value.
    missing: Vec<usize>,
}

impl ColumnCoverage {
    fn of(column: &Column) -> Self {
        let is_missing = |row: &usize| column.is_missing(*row);
        let rows = 0..column.values.len();
        let first = rows.clone().find(|row| !is_missing(row));
        let last = rows.clone().rev().find(|row| !is_missing(row));
        Self {
            value_range: first.zip(last).map(|(first, last)| first..last.saturating_add(1)),
            missing: rows.filter(is_missing).collect(),
        }
    }

    /// Returns the runs of missing rows that have a value on both sides, each with the row before the run.
    fn runs(&self) -> Vec<(usize, Range<usize>)> {
        let own = self.value_range.clone().unwrap_or_default();
        let mut runs: Vec<(usize, Range<usize>)> = Vec::new();
        for row in self.missing.iter().copied().filter(|row| own.contains(row)) {
            let end = row.saturating_add(1);
            match runs.last_mut() {
                Some((_, run)) if run.end == row => run.end = end,
                _ => runs.push((row.saturating_sub(1), row..end)),
            }
        }
        runs
    }

    fn step(&self, name: &str, how: SparseTreatment, x: &[f64]) -> Step {
        let runs = self.runs();
        let inside: usize = runs.iter().map(|(_, run)| run.len()).sum();
        let own = self.value_range.as_ref().map_or(0, Range::len);
        let since = |before: usize, row: usize| at(x, row) - at(x, before);
        let span = |(before, run): &(usize, Range<usize>)| since(*before, run.end);
        let ages = (runs.iter()).flat_map(|(before, run)| run.clone().map(move |row| since(*before, row)));
        let mean_age_s = ages.sum::<f64>() / own.max(1) as f64;
        Step::Sparse {
            channel: name.to_owned(),
            how: how.name(),
            own: own.saturating_sub(inside),
            rows: inside,
            longest_s: runs.iter().map(span).fold(0.0, f64::max),
            mean_age_s: (how == SparseTreatment::Hold && mean_age_s.is_finite()).then_some(mean_age_s),
        }
    }

    /// Fills in a value in each missing row that has values on both sides.
    fn fill(&self, column: &mut Column, how: SparseTreatment, x: &[f64]) {
        let values = &mut column.values;
        for (before, run) in self.runs() {
            let (a, b) = (at(values, before), at(values, run.end));
            let (from, to) = (at(x, before), at(x, run.end));
            for (value, x) in (values.iter_mut().zip(x)).take(run.end).skip(run.start) {
                let share = (x - from) / (to - from);
                *value = match how {
                    // Linear interpolation between two equal times is undefined.
                    SparseTreatment::Linear if share.is_finite() => a * (1.0 - share) + b * share,
                    _ => a,
                };
            }
        }
        column.filled_rows.clone_from(&self.missing);
        column.is_held = how == SparseTreatment::Hold;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(values: &[f64]) -> Column {
        Column {
            name: "e".to_owned(),
            values: values.to_vec(),
            ..Column::default()
        }
    }

    const MISSING: f64 = f64::NAN;

    #[test]
    fn sparse_values_are_held_or_interpolated_in_time() {
        let x = [0.0, 0.1, 0.4, 0.5, 1.0, 1.1];
        for (how, expected) in [
            (SparseTreatment::Hold, [1.0, 1.0, 1.0, 6.0, 6.0]),
            (SparseTreatment::Linear, [1.0, 2.0, 5.0, 6.0, 11.0]),
        ] {
            let mut e = column(&[1.0, MISSING, MISSING, 6.0, MISSING, 12.0]);
            ColumnCoverage::of(&e).fill(&mut e, how, &x);
            for (found, expected) in e.values.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-14, "{how}: {:?}", e.values);
            }
            assert_eq!(
                (e.filled_rows, e.is_held),
                (vec![1, 2, 4], how == SparseTreatment::Hold)
            );
        }
        // If the times are constant, the earlier value is used.
        let mut e = column(&[1.0, MISSING, 2.0]);
        ColumnCoverage::of(&e).fill(&mut e, SparseTreatment::Linear, &[0.0; 3]);
        assert_eq!(e.values, [1.0, 1.0, 2.0]);
    }
}
