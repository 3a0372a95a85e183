//! Repairs of damaged records, applied only on request: duplicated rows are dropped, missing values are interpolated
//! linearly, and samples with an unevenly spaced t are interpolated onto an evenly spaced grid.
//!
//! Interpolated data are not measured. Over a gap of one or two samples this does little harm, but every estimator
//! attributes a long straight line to the operator.

use std::ops::Range;

use crate::preparation::Step;
use crate::table::{Table, interpolate, keep_rows};
use crate::time::sampling::pairs;

/// Fraction of a step by which rounding may shift a time: a held signal changes to the value of a row this fraction of
/// a step before the row.
const ROUNDING_FRACTION: f64 = 1e-6;

/// End of the column at which values are missing, where they cannot be interpolated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OpenEnd {
    Start,
    End,
}

/// Counts of interpolated values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct FillCounts {
    /// Number of interpolated values.
    pub(super) values: usize,
    /// Length of the longest run of interpolated values.
    pub(super) longest: usize,
}

/// Replaces each run of NaN by a straight line between its neighbours, as a function of `t` if it is known, otherwise
/// of the row number.
pub(super) fn fill(values: &mut [f64], t: Option<&[f64]>) -> Result<FillCounts, OpenEnd> {
    let mut bridged = FillCounts::default();
    let mut at = 0;
    let x = |row: usize| t.map_or(Some(row as f64), |t| t.get(row).copied()).unwrap_or(f64::NAN);
    while let Some(run) = next_missing_run(values, at) {
        let last_before = run.start.checked_sub(1).ok_or(OpenEnd::Start)?;
        let (Some(&before), Some(&after)) = (values.get(last_before), values.get(run.end)) else {
            return Err(OpenEnd::End);
        };
        let (from, to) = (x(last_before), x(run.end));
        for (row, value) in values.iter_mut().enumerate().take(run.end).skip(run.start) {
            *value = interpolate(before, after, (x(row) - from) / (to - from));
        }
        bridged.values = bridged.values.saturating_add(run.len());
        bridged.longest = bridged.longest.max(run.len());
        at = run.end;
    }
    Ok(bridged)
}

/// Drops each row that equals an earlier row in all columns, including the time: the row before, or, if a block of rows
/// was written twice, the row with the same time.
pub(super) fn drop_repeated(table: Table<'_>, time: usize) -> (Table<'_>, Option<Step>) {
    let t = |row: usize| table.value(time, row);
    let (mut advancing, mut repeated) = (Vec::new(), Vec::new());
    for row in 0..table.rows {
        if advancing.last().is_none_or(|last| t(row) > t(*last)) {
            advancing.push(row);
            continue;
        }
        let with_this_time = advancing.get(advancing.partition_point(|before| t(*before) < t(row)));
        let earlier = row.checked_sub(1).into_iter().chain(with_this_time.copied());
        if earlier.into_iter().any(|before| rows_are_equal(&table, before, row)) {
            repeated.push(row);
        }
    }
    let Some(first) = repeated.first() else {
        return (table, None);
    };
    let step = Step::DropRepeated {
        rows: repeated.len(),
        first_row: first.saturating_add(1),
    };
    let rows: Vec<usize> = (0..table.rows)
        .filter(|row| repeated.binary_search(row).is_err())
        .collect();
    (keep_rows(table, rows), Some(step))
}

/// True if two rows are equal in all columns.
pub(super) fn rows_are_equal(table: &Table<'_>, before: usize, row: usize) -> bool {
    table.columns.iter().enumerate().all(|(index, column)| {
        let [a, b] = [before, row].map(|row| table.value(index, row));
        let texts = [before, row].map(|row| column.texts.binary_search(&row).is_ok());
        match texts {
            [false, false] => a == b || a.is_nan() && b.is_nan(),
            [true, true] => table.source.cell(before, index) == table.source.cell(row, index),
            _ => false,
        }
    })
}

fn next_missing_run(values: &[f64], from: usize) -> Option<Range<usize>> {
    let mut rest = values.iter().enumerate().skip(from);
    let (start, _) = rest.find(|(_, v)| v.is_nan())?;
    let end = rest.find(|(_, v)| !v.is_nan());
    Some(start..end.map_or(values.len(), |(end, _)| end))
}

/// Interpolates the points `(t, value)`, where t increases, at the times `start + k step`, k = 0 .. n - 1: linearly, or
/// with the value of the last point if the signal is held. A held signal changes [`ROUNDING_FRACTION`] of a step before
/// each point, to allow for rounding.
pub(super) fn resample(t: &[f64], values: &[f64], (start, step): (f64, f64), n: usize, is_held: bool) -> Vec<f64> {
    let early = if is_held { ROUNDING_FRACTION * step } else { 0.0 };
    let mut lines = pairs(t).zip(pairs(values));
    let Some(mut this) = lines.next() else {
        return Vec::new();
    };
    let value = |k| {
        let time = start + k as f64 * step + early;
        while this.0.1 <= time
            && let Some(next) = lines.next()
        {
            this = next;
        }
        let ((from, to), (before, after)) = this;
        let share = ((time - from) / (to - from)).clamp(0.0, 1.0);
        let share = if is_held { share.floor() } else { share };
        interpolate(before, after, share)
    };
    (0..n).map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const MISSING: f64 = f64::NAN;

    #[test]
    fn only_interior_gaps_are_filled() {
        let mut values = [1.0, MISSING, 3.0, 4.0, MISSING, MISSING, MISSING, 0.0];
        let bridged = fill(&mut values, None).unwrap();
        assert_eq!(values, [1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0, 0.0]);
        assert_eq!((bridged.values, bridged.longest), (4, 3));
        assert_eq!(fill(&mut [MISSING, 1.0], None), Err(OpenEnd::Start));
        assert_eq!(fill(&mut [1.0, MISSING], None), Err(OpenEnd::End));
        assert_eq!(fill(&mut [MISSING], None), Err(OpenEnd::Start));
        assert_eq!(fill(&mut [], None), Ok(FillCounts::default()));
    }

    #[test]
    fn gaps_are_filled_linearly_in_time() {
        let mut values = [0.0, MISSING, 10.0];
        fill(&mut values, Some(&[0.0, 0.3, 1.0])).unwrap();
        assert!((values[1] - 3.0).abs() < 1e-15);
    }

    #[test]
    fn a_straight_line_is_resampled_exactly() {
        let t = [0.0, 0.11, 0.19, 0.3, 0.9, 1.0];
        let values = t.map(|t| 2.0 - 3.0 * t);
        let even = resample(&t, &values, (0.0, 0.1), 11, false);
        for (k, value) in even.iter().enumerate() {
            // The result is a sum of two products of numbers of order 1, with rounding errors of a few units in the
            // last place.
            assert!((value - (2.0 - 0.3 * k as f64)).abs() < 1e-14, "{k}");
        }
        assert_eq!(even[0], 2.0);
        // If rounding puts the last sample beyond the data, it takes the last value.
        assert_eq!(resample(&t, &values, (0.0, 1.0 + 1e-12), 2, false)[1], values[5]);
        // A held signal changes only at the rows, regardless of the rounding of the grid.
        let held = resample(&t, &values, (0.0, 0.1), 11, true);
        let rows = [0, 0, 2, 3, 3, 3, 3, 3, 3, 4, 5];
        assert_eq!(held, rows.map(|row| values[row]));
    }
}
