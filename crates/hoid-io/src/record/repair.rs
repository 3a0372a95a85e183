//! Repairs of damaged records, applied only on request: duplicated rows are dropped, missing values
//! are interpolated linearly, and samples with an uneven t are interpolated to an even grid.
//!
//! Interpolated data are invented. Over a gap of one or two samples that does little harm; a long
//! straight line looks to every estimator like the behaviour of the operator.

use std::ops::Range;

use crate::preparation::Step;
use crate::table::{Table, kept};

/// Part of a step within which a time on the grid is that of a row: the rounding of times.
const ROUNDING: f64 = 1e-6;

/// Reason why missing values could not be interpolated: there is no value on one side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OpenEnd {
    Start,
    End,
}

/// The interpolated values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Bridged {
    /// Number of values.
    pub(super) values: usize,
    /// Longest run of them.
    pub(super) longest: usize,
}

/// Replaces each run of NaN by the straight line between its neighbours, along `t` if it is known,
/// otherwise by rows.
pub(super) fn fill(values: &mut [f64], t: Option<&[f64]>) -> Result<Bridged, OpenEnd> {
    let mut bridged = Bridged::default();
    let mut at = 0;
    while let Some(run) = next_run(values, at) {
        let (before, behind) = match (run.start.checked_sub(1), values.get(run.end)) {
            (None, _) => return Err(OpenEnd::Start),
            (_, None) => return Err(OpenEnd::End),
            (Some(row), Some(value)) => ((row, values[row]), (run.end, *value)),
        };
        let x = |row: usize| t.map_or(row as f64, |t| t[row]);
        let (from, to) = (x(before.0), x(behind.0));
        for row in run.clone() {
            values[row] = line(before.1, behind.1, (x(row) - from) / (to - from));
        }
        bridged.values += run.len();
        bridged.longest = bridged.longest.max(run.len());
        at = run.end;
    }
    Ok(bridged)
}

/// Drops each row that equals the row before in all columns, including the time.
pub(super) fn drop_repeated(table: Table<'_>) -> (Table<'_>, Option<Step>) {
    let same = |row: &usize| {
        table.columns.iter().enumerate().all(|(index, column)| {
            let (a, b) = (column.values[row - 1], column.values[*row]);
            let texts = [row - 1, *row].map(|row| column.texts.binary_search(&row).is_ok());
            match texts {
                [false, false] => a == b || a.is_nan() && b.is_nan(),
                [true, true] => table.source.cell(row - 1, index) == table.source.cell(*row, index),
                _ => false,
            }
        })
    };
    let repeated: Vec<usize> = (1..table.rows).filter(same).collect();
    let Some(first) = repeated.first() else {
        return (table, None);
    };
    let step = Step::DropRepeated {
        rows: repeated.len(),
        first_row: first + 1,
    };
    let rows: Vec<usize> = (0..table.rows)
        .filter(|row| repeated.binary_search(row).is_err())
        .collect();
    (kept(table, rows), Some(step))
}

fn next_run(values: &[f64], from: usize) -> Option<Range<usize>> {
    let start = from + values[from..].iter().position(|v| v.is_nan())?;
    let end = values[start..]
        .iter()
        .position(|v| !v.is_nan())
        .map_or(values.len(), |n| start + n);
    Some(start..end)
}

/// Values between the points `(t, value)` at `start + k step`, k = 0 .. n; t increases. They are on straight lines, or
/// those of the last point if the signal is held, which counts as reached [`ROUNDING`] of a step before it.
pub(super) fn resample(t: &[f64], values: &[f64], (start, step): (f64, f64), n: usize, is_held: bool) -> Vec<f64> {
    let early = if is_held { ROUNDING * step } else { 0.0 };
    let mut left = 0;
    (0..n)
        .map(|k| {
            let time = start + k as f64 * step + early;
            while left + 2 < t.len() && t[left + 1] <= time {
                left += 1;
            }
            let share = ((time - t[left]) / (t[left + 1] - t[left])).clamp(0.0, 1.0);
            let share = if is_held { share.floor() } else { share };
            line(values[left], values[left + 1], share)
        })
        .collect()
}

fn line(a: f64, b: f64, share: f64) -> f64 {
    // This form gives exactly a and b at the ends and does not overflow between them.
    a * (1.0 - share) + b * share
}

#[cfg(test)]
mod tests {
    use super::*;

    const GONE: f64 = f64::NAN;

    #[test]
    fn bridges_inside_only() {
        let mut values = [1.0, GONE, 3.0, 4.0, GONE, GONE, GONE, 0.0];
        let bridged = fill(&mut values, None).unwrap();
        assert_eq!(values, [1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0, 0.0]);
        assert_eq!((bridged.values, bridged.longest), (4, 3));
        assert_eq!(fill(&mut [GONE, 1.0], None), Err(OpenEnd::Start));
        assert_eq!(fill(&mut [1.0, GONE], None), Err(OpenEnd::End));
        assert_eq!(fill(&mut [GONE], None), Err(OpenEnd::Start));
        assert_eq!(fill(&mut [], None), Ok(Bridged::default()));
    }

    #[test]
    fn bridges_along_time() {
        let mut values = [0.0, GONE, 10.0];
        fill(&mut values, Some(&[0.0, 0.3, 1.0])).unwrap();
        assert!((values[1] - 3.0).abs() < 1e-15);
    }

    #[test]
    fn a_straight_line_is_resampled_exactly() {
        let t = [0.0, 0.11, 0.19, 0.3, 0.9, 1.0];
        let values = t.map(|t| 2.0 - 3.0 * t);
        let even = resample(&t, &values, (0.0, 0.1), 11, false);
        for (k, value) in even.iter().enumerate() {
            // Two products of numbers of order 1: a few units in the last place.
            assert!((value - (2.0 - 0.3 * k as f64)).abs() < 1e-14, "{k}");
        }
        assert_eq!(even[0], 2.0);
        // A last sample beyond the data due to rounding takes the last value.
        assert_eq!(resample(&t, &values, (0.0, 1.0 + 1e-12), 2, false)[1], values[5]);
        // A held signal changes at the rows alone, whatever the rounding of the grid.
        let held = resample(&t, &values, (0.0, 0.1), 11, true);
        let rows = [0, 0, 2, 3, 3, 3, 3, 3, 3, 4, 5];
        assert_eq!(held, rows.map(|row| values[row]));
    }
}
