//! Linear interpolation of the columns of one stream to the times of another.

use std::ops::Range;

use super::column_path::ColumnPath;
use super::numbers::Numbers;
use crate::IoError;
use crate::wording::abbreviate;

/// A column interpolated to the times of another stream.
pub(super) struct AlignedColumn {
    pub(super) numbers: Numbers,
    /// Rows of the other stream whose time lies within the stream of the column.
    pub(super) rows: Range<usize>,
    pub(super) note: String,
}

/// Interpolates the column `column_path` to the times of the stream with the path `neighbour`.
pub(super) fn align_column(
    column_paths: &[ColumnPath],
    column_path: &ColumnPath,
    neighbour: &str,
    file: &str,
) -> Result<AlignedColumn, IoError> {
    let (from, to) = (
        stream_times(column_paths, &column_path.parent, file)?,
        stream_times(column_paths, neighbour, file)?,
    );
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
        interpolate(known, known_values, *t)
    };
    let numbers: Vec<f64> = to.iter().map(value).collect();
    let hz = |t: &[f64]| match t {
        [first, .., last] => t.len().saturating_sub(1) as f64 / (last - first),
        _ => f64::NAN,
    };
    let (from_hz, to_hz) = (hz(&from), hz(&to));
    let mut note = format!(
        "{} is interpolated linearly from {from_hz:.3} Hz to the {to_hz:.3} Hz of {}, where both have samples",
        abbreviate(&column_path.path),
        abbreviate(neighbour)
    );
    if from_hz > 1.5 * to_hz {
        note.push_str("; no low-pass filter was applied");
    }
    Ok(AlignedColumn {
        numbers: Numbers::from_f64(&numbers),
        rows: start..end.max(start),
        note,
    })
}

/// Evaluates the line through the first two points at `at`.
fn interpolate(t: &[f64], values: &[f64], at: f64) -> f64 {
    match (t, values) {
        ([t0, t1, ..], [v0, v1, ..]) => {
            let part = (at - t0) / (t1 - t0);
            // The result is exact at both points.
            if part == 1.0 { *v1 } else { v0 + part * (v1 - v0) }
        }
        ([_], [v0]) => *v0,
        _ => f64::NAN,
    }
}

/// Returns the times of a structure; they must increase.
fn stream_times(column_paths: &[ColumnPath], place: &str, file: &str) -> Result<Vec<f64>, IoError> {
    let time = column_paths
        .iter()
        .find(|column_path| column_path.parent == place && column_path.name() == "t");
    let times = time
        .and_then(ColumnPath::numbers)
        .map(Numbers::values)
        .unwrap_or_default();
    let pairs = (2_usize..).zip(times.iter().zip(times.iter().skip(1)));
    let mut standing = pairs.filter(|(_, (t, next))| next.partial_cmp(t) != Some(std::cmp::Ordering::Greater));
    match standing.next().map(|(row, (t, next))| (row, *t, *next)) {
        None if times.is_empty() => Err(IoError::NoRows { file: file.to_owned() }),
        None => Ok(times),
        Some((row, previous, found)) => Err(IoError::NotIncreasing {
            file: file.to_owned(),
            place: format!("stream {}, row {row}", abbreviate(place)),
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
        ];
        let column_paths: Vec<ColumnPath> = entries
            .iter()
            .flat_map(|entry| entry.column_paths(Indexing::Python))
            .collect();
        let found = align_column(&column_paths, &column_paths[1], "b", "f").unwrap();
        assert_eq!(found.rows, 1..6);
        assert_eq!(found.numbers.values()[1..6], [0.0, 5.0, 10.0, 0.0, -10.0]);
        assert!(matches!(
            align_column(&column_paths, &column_paths[1], "c", "f"),
            Err(IoError::NotIncreasing { .. })
        ));
        assert!(
            align_column(&column_paths, &column_paths[1], "d", "f")
                .unwrap()
                .rows
                .is_empty()
        );
        assert!(matches!(
            align_column(&column_paths, &column_paths[1], "e", "f"),
            Err(IoError::NoRows { .. })
        ));
    }
}
