//! Tables of results in Parquet.

use super::columns::{ColumnData, ReadColumn};
use super::read::read as read_columns;
use super::record::mark_missing;
use crate::IoError;
use crate::results::{ColumnValues, OutputColumn, OutputTable};
use crate::wording::abbreviate;

/// Reads the columns of a file, with their original kinds.
pub(super) fn read(bytes: Vec<u8>, file: &str) -> Result<OutputTable, IoError> {
    let read = read_columns(bytes, file)?;
    let unread = |name: &str, what: &str| IoError::Unsupported {
        file: file.to_owned(),
        found: format!("column {} holds {what}", abbreviate(name)),
        remedy: "write the table without it",
    };
    let mut columns = Vec::with_capacity(read.columns.len());
    for ReadColumn { name, data, nulls, .. } in read.columns {
        let real = |mut values: Vec<f64>| {
            mark_missing(&mut values, &nulls);
            ColumnValues::Real(values)
        };
        let values = match data {
            ColumnData::Real(values) => real(values),
            ColumnData::Signed(values) if nulls.is_empty() && values.iter().all(|value| *value >= 0) => {
                ColumnValues::Whole(values.into_iter().map(|value| value as u64).collect())
            }
            ColumnData::Signed(values) => real(values.into_iter().map(|value| value as f64).collect()),
            ColumnData::Unsigned(values) if nulls.is_empty() => ColumnValues::Whole(values),
            ColumnData::Unsigned(values) => real(values.into_iter().map(|value| value as f64).collect()),
            // A missing text is read as an empty text.
            ColumnData::Text(values) => ColumnValues::Text(values),
            ColumnData::Moments(_) => return Err(unread(&name, "a date or time")),
            ColumnData::Unread(what) => return Err(unread(&name, what)),
        };
        columns.push(OutputColumn { name, values });
    }
    Ok(OutputTable {
        comments: read.comments,
        columns,
    })
}
