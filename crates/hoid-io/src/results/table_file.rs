//! Writing and reading of tables of results, in the format determined by the extension.

use std::path::Path;

use super::output_table::OutputTable;
use super::table_writer::write_values;
use crate::IoError;
use crate::formats::{format_to_write, read_with_format};

/// Checks that a table can be written to a file with this name, before long computations.
///
/// # Errors
/// [`IoError::UnknownFormat`] for an extension of no known format, [`IoError::Directory`].
pub fn check_table_path(path: &Path) -> Result<(), IoError> {
    format_to_write(path).map(drop)
}

/// Writes a table atomically: as CSV (`.csv`, `.txt`; with tabs `.tsv`), Parquet (`.parquet`, `.pq`), NPZ (`.npz`) or
/// MATLAB (`.mat`). The same table gives the same bytes.
///
/// # Errors
/// The errors of [`check_table_path`]; [`IoError::ColumnLength`], [`IoError::NoColumns`], [`IoError::DuplicateColumn`]
/// or [`IoError::ChannelName`] for a table that cannot be written; the errors of
/// [`write_atomically`](crate::write_atomically).
///
/// ```
/// use hoid_io::{ColumnValues, OutputColumn, OutputTable, read_table, write_table};
/// let column = |name: &str, values| OutputColumn { name: name.into(), values };
/// let table = OutputTable {
///     comments: vec!["method: rpem".into()],
///     columns: vec![
///         column("t", ColumnValues::Real(vec![0.0, 0.01])),
///         column("convertible", ColumnValues::Whole(vec![0, 1])),
///     ],
/// };
/// let path = std::env::temp_dir().join("hoid-example.parquet");
/// write_table(&path, &table)?;
/// assert_eq!(read_table(&path)?, table);
/// # std::fs::remove_file(&path).unwrap();
/// # Ok::<(), hoid_io::IoError>(())
/// ```
pub fn write_table(path: &Path, table: &OutputTable) -> Result<(), IoError> {
    table.row_count(&path.display().to_string())?;
    write_values(path, table.schema(), &table.values())
}

/// Reads a table with the column kinds with which it was written; see `output_table` for the kinds in CSV. An integer
/// column in a Parquet file from another program is read as integers if no value is missing or negative, otherwise as
/// reals.
///
/// # Errors
/// [`IoError`] with the place in the file.
pub fn read_table(path: &Path) -> Result<OutputTable, IoError> {
    let file = path.display().to_string();
    let (format, bytes) = read_with_format(path)?;
    format.results(bytes, &file)
}
