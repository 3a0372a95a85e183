//! Conversion of all arrays of a file to a table of results.

use super::column_path::ColumnContents;
use super::contents::Contents;
use crate::IoError;
use crate::results::{ColumnValues, OutputColumn, OutputTable};
use crate::wording::abbreviate;

/// Converts all columns to a table of results.
pub(crate) fn output_table_of(contents: Contents, file: &str) -> Result<OutputTable, IoError> {
    let mut columns: Vec<OutputColumn> = Vec::new();
    for column_path in contents.column_paths() {
        let error = || column_path.not_numeric_error(file);
        let values = match &column_path.holds {
            ColumnContents::Texts(texts) => ColumnValues::Text(texts.clone()),
            ColumnContents::Unread(_) => return Err(error()),
            ColumnContents::Numbers(numbers) => match numbers.counts() {
                Some(counts) if numbers.kind().is_whole() => ColumnValues::Whole(counts),
                _ => ColumnValues::Real(numbers.values()),
            },
        };
        if let Some(first) = columns.first().filter(|first| first.values.len() != values.len()) {
            return Err(IoError::UnequalColumns {
                file: file.to_owned(),
                column: abbreviate(&column_path.path),
                found: values.len(),
                other: abbreviate(&first.name),
                expected: first.values.len(),
            });
        }
        columns.push(OutputColumn {
            name: column_path.path,
            values,
        });
    }
    Ok(OutputTable {
        comments: contents.comments,
        columns,
    })
}
