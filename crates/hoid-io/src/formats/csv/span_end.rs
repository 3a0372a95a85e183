//! The end of the requested span in a long text, after which no row is read.
//!
//! A time after the span does not suffice to stop reading: in a file of several trials the time restarts, and the span
//! may lie in a later trial. The time is therefore probed at several positions in the unread part; unless the probed
//! times increase to the end of the file, the whole file is read.

use super::table::ParsedText;
use crate::record::ReadOptions;
use crate::table::{Source, Table};
use crate::time::with_time;

/// End of the requested span.
pub(super) enum SpanEnd {
    /// Samples are counted: number of rows up to the end of the span.
    Row(usize),
    /// Index of the time column, and the bounds of the span in the unit and with the origin of that column.
    Time { column: usize, from: f64, to: f64 },
}

/// Placeholder source for a table whose rows appear in no message.
struct PlaceholderSource<'a>(&'a str);

impl Source for PlaceholderSource<'_> {
    fn file(&self) -> &str {
        self.0
    }

    fn location(&self, row: usize) -> String {
        format!("row {}", row.saturating_add(1))
    }

    fn cell(&self, _: usize, _: usize) -> String {
        String::new()
    }
}

impl SpanEnd {
    /// Determines the end of the requested span from the first rows; `None` if all rows are needed.
    pub(super) fn of(head: &ParsedText, file: &str, options: &ReadOptions) -> Option<Self> {
        let to_s = options.span_s.1?;
        // Rows after the span may be needed to interpolate a sparse column or to find trials.
        if !options.sparse.is_empty() || options.trial.is_some() {
            return None;
        }
        let copy = |column: &crate::table::Column| crate::table::Column {
            name: column.name.clone(),
            unit: column.unit.clone(),
            values: column.values.clone(),
            ..crate::table::Column::default()
        };
        let first_rows = Table {
            columns: head.columns.iter().map(copy).collect(),
            rows: head.rows,
            sample_time_s: None,
            source: Box::new(PlaceholderSource(file)),
            notes: Vec::new(),
        };
        let table = with_time(first_rows, options.time.as_ref()).ok()?;
        let mut columns = table.columns.iter().zip(&head.columns).enumerate();
        let time = columns.find(|(_, (column, _))| column.name == "t");
        let first = time.and_then(|(_, (t, _))| t.values.first());
        let start_s = first.copied().unwrap_or(0.0);
        match (options.sampling_hz, time) {
            (Some(hz), time) if time.is_none() || !options.repair.resample => {
                let rows = ((to_s - start_s) * hz).ceil() + 2.0;
                (rows > 2.0).then_some(Self::Row(rows as usize))
            }
            (_, None) => None,
            (_, Some((column, (t, written)))) => {
                // The time t is the time in the file after a shift and a conversion of its unit.
                let (&[first, .., last], &[written, .., last_written]) = (&*t.values, &*written.values) else {
                    return None;
                };
                let unit = (last_written - written) / (last - first);
                let as_written = |s: f64| written + (s - start_s) * unit;
                let (from, to) = (
                    as_written(options.span_s.0.unwrap_or(f64::NEG_INFINITY)),
                    as_written(to_s),
                );
                (unit > 0.0 && to.is_finite()).then_some(Self::Time { column, from, to })
            }
        }
    }

    /// True if the rows read so far include rows of the span and extend beyond its end.
    pub(super) fn is_reached(&self, read: &ParsedText) -> bool {
        match *self {
            Self::Row(rows) => read.starts.len() >= rows,
            Self::Time { column, from, to } => read.columns.get(column).is_some_and(|column| {
                let t = &column.values;
                t.last().is_some_and(|t| *t > to) && t.iter().any(|t| *t >= from && *t < to)
            }),
        }
    }

    /// Returns the index of the time column; `None` if rows are counted.
    pub(super) fn time_column(&self) -> Option<usize> {
        match *self {
            Self::Row(_) => None,
            Self::Time { column, .. } => Some(column),
        }
    }

    /// True if no unread row lies in the span: the times increase through the rows read so far and on through the times
    /// probed in the unread part. A probed time is NaN if none was found.
    pub(super) fn is_last(&self, read: &ParsedText, probed: &[f64]) -> bool {
        let Some(column) = self.time_column() else {
            return true;
        };
        let rest = probed.iter().filter(|t| !t.is_nan());
        let column = read.columns.get(column);
        column.is_some_and(|column| column.values.iter().chain(rest).is_sorted())
    }
}
