//! Fast reader for rows of plain numbers; nearly all rows of a recording are plain.
//!
//! A row is plain if each cell of a requested column is empty or a number with a decimal point, with only blanks around
//! it; cells of other columns may contain any text without quotes. Any other row (text, quotes, comments, too many or
//! too few cells) ends the run and is read by the full CSV reader ([`super::table`]). Both readers round correctly and
//! return the same numbers (D. Lemire, *Software: Practice and Experience* 51 (2021) 1700-1727).
//!
//! A long file is divided at line ends into parts that are read in parallel. For each part the reader reports the
//! position of the first row that is not plain; parts after this row are discarded.

use std::ops::Range;
use std::thread;

use crate::table::Precision;

/// Size, in bytes, of a part that one thread reads: large enough to justify a thread, and small compared with the
/// columns.
const PART_BYTES: usize = 4 << 20;
/// Size in bytes of the first part, which is read without a thread; it contains a row that is not plain if such rows
/// are frequent.
const FIRST_PART_BYTES: usize = 64 << 10;
/// Maximum number of threads.
const MAX_THREADS: usize = 8;
/// Positions of rows in the text of a table: of every [`KEPT_ROW_INTERVAL`](RowStarts::KEPT_ROW_INTERVAL)-th row and of
/// the last row.
#[derive(Debug, Default)]
pub(super) struct RowStarts {
    stored_positions: Vec<usize>,
    rows: usize,
    last: usize,
}

impl RowStarts {
    /// Interval between rows whose position is kept.
    pub(super) const KEPT_ROW_INTERVAL: usize = 1024;

    /// Adds the position of the next row.
    pub(super) fn push(&mut self, start: usize) {
        if self.rows.is_multiple_of(Self::KEPT_ROW_INTERVAL) {
            self.stored_positions.push(start);
        }
        self.rows = self.rows.saturating_add(1);
        self.last = start;
    }

    /// Returns the number of rows.
    pub(super) fn len(&self) -> usize {
        self.rows
    }

    /// Returns the position of the last row; `None` if there are no rows.
    pub(super) fn last(&self) -> Option<usize> {
        (self.rows > 0).then_some(self.last)
    }

    /// Returns the kept position of the nearest row at or before `row`, and the number of rows from that row to `row`.
    pub(super) fn nearest_stored(&self, row: usize) -> Option<(usize, usize)> {
        Some((
            *self.stored_positions.get(row / Self::KEPT_ROW_INTERVAL)?,
            row % Self::KEPT_ROW_INTERVAL,
        ))
    }
}

/// Consecutive plain rows, as read by one thread.
#[derive(Debug, Default)]
pub(super) struct PlainRows {
    /// Values, one vector for each column.
    pub(super) values: Vec<Vec<f64>>,
    /// Precision of the columns for which it was requested.
    pub(super) precision: Vec<Precision>,
    /// Positions of the rows.
    pub(super) starts: Vec<usize>,
    /// Position of the first row that is not plain; the end of the text if there is none.
    pub(super) end: usize,
}

/// Layout of the rows: the separator, the columns whose precision is requested, and the columns whose values are
/// requested.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout<'a> {
    pub(super) separator: u8,
    pub(super) with_precision: &'a [bool],
    /// True for each column whose values are requested; cells of other columns may hold any text without quotes.
    pub(super) requested_columns: &'a [bool],
}

/// Reads plain rows starting at position `from` and passes them to `take`, run by run; returns the position of the
/// first row that is not plain.
pub(super) fn read_plain_rows(bytes: &[u8], from: usize, layout: Layout<'_>, mut take: impl FnMut(PlainRows)) -> usize {
    let threads = thread::available_parallelism().map_or(1, |n| n.get().min(MAX_THREADS));
    let mut at = from;
    let first = from..end_of_part(bytes, from, FIRST_PART_BYTES);
    if !first.is_empty() {
        let run = read_plain_part(bytes, first.clone(), layout);
        at = run.end;
        take(run);
        if at < first.end {
            return at;
        }
    }
    while at < bytes.len() {
        let mut parts: Vec<Range<usize>> = Vec::with_capacity(threads);
        let mut start = at;
        while parts.len() < threads && start < bytes.len() {
            let end = end_of_part(bytes, start, PART_BYTES);
            parts.push(start..end);
            start = end;
        }
        let runs: Vec<PlainRows> = if let [only] = parts.as_slice() {
            vec![read_plain_part(bytes, only.clone(), layout)]
        } else {
            thread::scope(|scope| {
                let each = |part: &Range<usize>| {
                    let part = part.clone();
                    scope.spawn(move || read_plain_part(bytes, part, layout))
                };
                let running: Vec<_> = parts.iter().map(each).collect();
                // If a thread panicked, the full CSV reader reads its part.
                let joined = running.into_iter().zip(&parts);
                joined
                    .map(|(thread, part)| thread.join().unwrap_or_else(|_| PlainRows::empty(layout, part.start)))
                    .collect()
            })
        };
        for (run, part) in runs.into_iter().zip(&parts) {
            at = run.end;
            take(run);
            if at < part.end {
                return at;
            }
        }
    }
    at
}

/// Returns the end of the part that starts at `start`, which is after the first line end beyond `length` bytes.
fn end_of_part(bytes: &[u8], start: usize, length: usize) -> usize {
    let mut remaining = bytes.iter().enumerate().skip(start.saturating_add(length));
    let line = remaining.find(|(_, byte)| **byte == b'\n');
    line.map_or(bytes.len(), |(at, _)| at.saturating_add(1))
}

impl PlainRows {
    fn empty(layout: Layout<'_>, at: usize) -> Self {
        let columns = layout.with_precision.len();
        Self {
            values: vec![Vec::new(); columns],
            precision: vec![Precision::default(); columns],
            starts: Vec::new(),
            end: at,
        }
    }
}

/// Reads the plain rows of a part.
fn read_plain_part(bytes: &[u8], part: Range<usize>, layout: Layout<'_>) -> PlainRows {
    let columns = layout.with_precision.len();
    let mut found = PlainRows::empty(layout, part.start);
    let mut rest = bytes.get(part.clone()).unwrap_or_default();
    let at = |rest: &[u8]| part.end.saturating_sub(rest.len());
    // Memory is reserved on the assumption that all rows are about as long as the first row.
    let line = rest
        .split_inclusive(|byte| *byte == b'\n')
        .next()
        .map_or(1, <[u8]>::len);
    let rows = (rest.len() as f64 / line as f64 * 1.07) as usize;
    for (values, wanted) in found.values.iter_mut().zip(layout.requested_columns) {
        values.reserve(if *wanted { rows } else { 0 });
    }
    found.starts.reserve(rows);
    let mut row = vec![f64::NAN; columns];
    let mut printed: Vec<&[u8]> = vec![b""; columns];
    while let [first, remaining @ ..] = rest {
        // Blank lines are not rows.
        if matches!(first, b'\n' | b'\r') {
            rest = remaining;
            continue;
        }
        let Some(remaining) = parse_plain_row(rest, layout, &mut row, &mut printed) else {
            break;
        };
        found.starts.push(at(rest));
        let columns = found.values.iter_mut().zip(&mut found.precision);
        let asked = layout.requested_columns.iter().zip(layout.with_precision);
        for (((values, precision), (wanted, with_precision)), (value, printed)) in
            columns.zip(asked).zip(row.iter().zip(&printed))
        {
            if !*wanted {
                continue;
            }
            values.push(*value);
            if *with_precision && !value.is_nan() {
                precision.add_bytes(printed);
            }
        }
        rest = remaining;
    }
    found.end = at(rest);
    found
}

/// Reads the numbers of a row, and returns the text after the row; `None` if the row is not plain.
#[inline]
fn parse_plain_row<'a>(
    mut rest: &'a [u8],
    layout: Layout<'_>,
    row: &mut [f64],
    printed: &mut [&'a [u8]],
) -> Option<&'a [u8]> {
    let last = row.len().checked_sub(1)?;
    let mut empty = true;
    for (column, ((value, printed), wanted)) in row.iter_mut().zip(printed).zip(layout.requested_columns).enumerate() {
        if *wanted {
            rest = skip_spaces(rest);
            *value = f64::NAN;
            if matches!(rest, [b'0'..=b'9' | b'-' | b'+' | b'.', ..]) {
                let (number, length) = fast_float2::parse_partial::<f64, _>(rest).ok()?;
                if !number.is_finite() {
                    return None;
                }
                *value = number;
                (*printed, rest) = rest.split_at_checked(length)?;
                rest = skip_spaces(rest);
                empty = false;
            }
        } else {
            let ends = |byte: &u8| *byte == layout.separator || matches!(byte, b'\n' | b'\r' | b'"');
            let length = rest.iter().position(ends).unwrap_or(rest.len());
            empty &= length == 0;
            rest = rest.get(length..)?;
        }
        match rest {
            [byte, remaining @ ..] if *byte == layout.separator && column < last => rest = remaining,
            [b'\n' | b'\r', ..] | [] if column == last => {}
            _ => return None,
        }
    }
    // A row without any value, as spreadsheets may leave after the end of a table, is handled by the full CSV reader.
    (!empty).then_some(rest)
}

fn skip_spaces(mut rest: &[u8]) -> &[u8] {
    while let [b' ', remaining @ ..] = rest {
        rest = remaining;
    }
    rest
}
