//! Columns with their own times: linear interpolation to the times of another structure or stream.

use std::ops::Range;

use super::column_path::ColumnPath;
use super::numbers::Numbers;
use crate::IoError;
use crate::table::interpolate;
use crate::wording::abbreviate;

/// Largest difference between equal times, as a fraction of the mean step: rounding, or single precision.
const EQUAL_TIMES: f64 = 0.01;

/// A column interpolated to other times.
pub(super) struct AlignedColumn {
    pub(super) numbers: Numbers,
    /// Rows of the other times that lie within the times of the column.
    pub(super) rows: Range<usize>,
    pub(super) note: String,
}

/// Interpolates a column with the times `own` to the times `other`; `None` if these times are equal.
pub(super) fn align_column(
    column_path: &ColumnPath,
    own: &ColumnPath,
    other: &ColumnPath,
    file: &str,
) -> Result<Option<AlignedColumn>, IoError> {
    if are_equal(own, other) {
        return Ok(None);
    }
    let (from, to) = (increasing_times(own, file)?, increasing_times(other, file)?);
    let values = column_path.numbers().map(Numbers::values).unwrap_or_default();
    let (Some(first), Some(last)) = (from.first(), from.last()) else {
        return Err(IoError::NoRows { file: file.to_owned() });
    };
    let start = to.partition_point(|t| t < first);
    let end = to.partition_point(|t| t <= last);
    let (mut known, mut known_values) = (from.as_slice(), values.as_slice());
    let value = |t: &f64| {
        while let [_, later @ ..] = known
            && let [next, _, ..] = later
            && next < t
        {
            known = later;
            known_values = known_values.get(1..).unwrap_or_default();
        }
        line_through(known, known_values, *t)
    };
    let numbers: Vec<f64> = to.iter().map(value).collect();
    let (from_hz, to_hz) = (1.0 / mean_step(&from), 1.0 / mean_step(&to));
    // The unit of other times is not known here.
    let names = match own.unit == "s" && other.unit == "s" {
        true => [
            format!("{from_hz:.3} Hz"),
            format!("{to_hz:.3} Hz of {}", abbreviate(&other.parent)),
        ],
        false => [
            format!("the times {}", abbreviate(&own.path)),
            format!("times {}", abbreviate(&other.path)),
        ],
    };
    let mut note = format!(
        "{} is interpolated linearly from {}, where both have samples",
        abbreviate(&column_path.path),
        names.join(" to the ")
    );
    if from_hz > 1.5 * to_hz {
        note.push_str("; no low-pass filter was applied");
    }
    Ok(Some(AlignedColumn {
        numbers: Numbers::from_f64(&numbers),
        rows: start..end.max(start),
        note,
    }))
}

fn times(time: &ColumnPath) -> Vec<f64> {
    time.numbers().map(Numbers::values).unwrap_or_default()
}

fn mean_step(t: &[f64]) -> f64 {
    match t {
        [first, .., last] => (last - first) / t.len().saturating_sub(1) as f64,
        _ => f64::NAN,
    }
}

/// True if two columns hold the same times.
pub(super) fn are_equal(one: &ColumnPath, other: &ColumnPath) -> bool {
    if one.path == other.path {
        return true;
    }
    let (one, other) = (times(one), times(other));
    let limit = EQUAL_TIMES * mean_step(&one).abs();
    let is_near = |(a, b): (&f64, &f64)| a == b || (a - b).abs() <= limit || a.is_nan() && b.is_nan();
    one.len() == other.len() && one.iter().zip(&other).all(is_near)
}

/// Evaluates the line through the first two points at `at`.
fn line_through(t: &[f64], values: &[f64], at: f64) -> f64 {
    match (t, values) {
        ([t0, t1, ..], [v0, v1, ..]) => interpolate(*v0, *v1, (at - t0) / (t1 - t0)),
        ([_], [v0]) => *v0,
        _ => f64::NAN,
    }
}

/// Returns times, which must increase.
fn increasing_times(time: &ColumnPath, file: &str) -> Result<Vec<f64>, IoError> {
    let times = times(time);
    let pairs = (2_usize..).zip(times.iter().zip(times.iter().skip(1)));
    let mut standing = pairs.filter(|(_, (t, next))| next.partial_cmp(t) != Some(std::cmp::Ordering::Greater));
    match standing.next().map(|(row, (t, next))| (row, *t, *next)) {
        None if times.is_empty() => Err(IoError::NoRows { file: file.to_owned() }),
        None => Ok(times),
        Some((row, previous, found)) => Err(IoError::NotIncreasing {
            file: file.to_owned(),
            location: format!("{}, row {row}", abbreviate(&time.path)),
            found,
            previous,
            remedy: "sort the rows by t, and write t with all its digits",
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::arrays::array::Array;
    use crate::formats::arrays::contents::{Entry, Indexing, Value};

    #[test]
    fn signals_are_interpolated_to_another_clock() {
        let entry = |parent: &str, name: &str, values: &[f64]| {
            Entry::field(parent, name, Value::Array(Array::vector(Numbers::from_f64(values))))
        };
        let entries = [
            entry("a", "t", &[0.0, 1.0, 3.0]),
            entry("a", "x", &[0.0, 10.0, -10.0]),
            entry("b", "t", &[-1.0, 0.0, 0.5, 1.0, 2.0, 3.0, 3.5]),
            entry("c", "t", &[0.0, 1.0, 1.0]),
            entry("d", "t", &[7.0]),
            entry("e", "t", &[]),
            entry("f", "t", &[0.0, 1.000_000_1, 3.0]),
        ];
        let column_paths: Vec<ColumnPath> = entries
            .iter()
            .flat_map(|entry| entry.column_paths(Indexing::Python))
            .collect();
        let align = |to: usize| align_column(&column_paths[1], &column_paths[0], &column_paths[to], "f");
        let found = align(2).unwrap().unwrap();
        assert_eq!(found.rows, 1..6);
        assert_eq!(found.numbers.values()[1..6], [0.0, 5.0, 10.0, 0.0, -10.0]);
        assert_eq!(
            found.note,
            "a.x is interpolated linearly from the times a.t to the times b.t, where both have samples"
        );
        assert!(matches!(align(3), Err(IoError::NotIncreasing { .. })));
        assert!(align(4).unwrap().unwrap().rows.is_empty());
        assert!(matches!(align(5), Err(IoError::NoRows { .. })));
        // The same times in single precision count as equal.
        assert!(align(6).unwrap().is_none() && align(0).unwrap().is_none());
    }
}
