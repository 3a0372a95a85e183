//! Columns of results, into files and out of them.
//!
//! | | CSV | Parquet |
//! |---|---|---|
//! | real | the fewest digits that give the number back, always with a point or an exponent; empty for NaN | DOUBLE, null for NaN |
//! | whole | digits | INT64 without sign |
//! | text | quoted where that is needed | BYTE_ARRAY in UTF-8 |
//! | comments | lines above the header, behind `# ` | lines under the key `hoid.comments` |
//!
//! Parquet gives back what was written. CSV keeps no types: a column is whole where each cell is, real where each cell is a
//! number or empty, else text. What hoid writes comes back the same but for a column of text that looks like numbers, and one
//! of no rows.

use std::ops::Range;
use std::path::Path;

use crate::arrays::output_table_of;
use crate::format::{Format, bytes_of, format_to_write};
use crate::table::shown;
use crate::table_writer::write_values;
use crate::{IoError, csv_columns, mat, npz, parquet, xdf};

/// Columns to be written.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OutputTable {
    /// What to know about the table, a line each.
    pub comments: Vec<String>,
    /// The columns, all of one length.
    pub columns: Vec<OutputColumn>,
}

/// One column of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputColumn {
    /// Its name, of which there is one in a table.
    pub name: String,
    /// One value a row.
    pub values: ColumnValues,
}

/// Values of one kind.
#[derive(Debug, Clone, PartialEq)]
pub enum ColumnValues {
    /// NaN is an empty cell.
    Real(Vec<f64>),
    /// Counts and flags.
    Whole(Vec<u64>),
    /// Names.
    Text(Vec<String>),
}

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnKind {
    /// Real numbers.
    Real,
    /// Whole numbers.
    Whole,
    /// Texts.
    Text,
}

/// A table without its rows.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TableSchema {
    /// What to know about the table, a line each.
    pub comments: Vec<String>,
    /// The columns.
    pub columns: Vec<ColumnSchema>,
}

/// Name and kind of a column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnSchema {
    /// Its name.
    pub name: String,
    /// What it holds.
    pub kind: ColumnKind,
}

impl OutputTable {
    /// The table without its rows.
    #[must_use]
    pub fn schema(&self) -> TableSchema {
        let column = |column: &OutputColumn| ColumnSchema {
            name: column.name.clone(),
            kind: column.values.kind(),
        };
        TableSchema {
            comments: self.comments.clone(),
            columns: self.columns.iter().map(column).collect(),
        }
    }

    /// The values of a column.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&ColumnValues> {
        self.columns.iter().find(|c| c.name == name).map(|c| &c.values)
    }

    /// The rows of all columns.
    pub(crate) fn rows(&self, file: &str) -> Result<usize, IoError> {
        let expected = self.columns.first().map_or(0, |column| column.values.len());
        match self.columns.iter().find(|column| column.values.len() != expected) {
            None => Ok(expected),
            Some(column) => Err(IoError::ColumnLength {
                file: file.to_owned(),
                column: column.name.clone(),
                found: column.values.len(),
                expected,
            }),
        }
    }

    pub(crate) fn values(&self) -> Vec<Values<'_>> {
        self.columns.iter().map(|column| column.values.all()).collect()
    }
}

impl ColumnValues {
    /// The number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.all().len()
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// What the values are.
    #[must_use]
    pub fn kind(&self) -> ColumnKind {
        match self {
            Self::Real(_) => ColumnKind::Real,
            Self::Whole(_) => ColumnKind::Whole,
            Self::Text(_) => ColumnKind::Text,
        }
    }

    pub(crate) fn all(&self) -> Values<'_> {
        match self {
            Self::Real(values) => Values::Real(values),
            Self::Whole(values) => Values::Whole(values),
            Self::Text(values) => Values::Text(values),
        }
    }
}

impl TableSchema {
    /// The schema as it can be written: each comment one line, each name one that is found again.
    pub(crate) fn checked(self, file: &str) -> Result<Self, IoError> {
        if self.columns.is_empty() {
            return Err(IoError::NoColumns { file: file.to_owned() });
        }
        for (second, column) in self.columns.iter().enumerate() {
            let name = &column.name;
            let reason = if name.is_empty() {
                Some("it has no name")
            } else if name != name.trim() {
                Some("there are blanks around the name")
            } else {
                None
            };
            if let Some(reason) = reason {
                return Err(IoError::ChannelName {
                    file: file.to_owned(),
                    name: name.clone(),
                    reason,
                });
            }
            if let Some(first) = self.columns[..second].iter().position(|other| other.name == *name) {
                return Err(IoError::DuplicateColumn {
                    file: file.to_owned(),
                    name: name.clone(),
                    first: first + 1,
                    second: second + 1,
                });
            }
        }
        let lines = self.comments.iter().flat_map(|comment| comment.split(['\n', '\r']));
        Ok(Self {
            comments: lines.map(str::to_owned).collect(),
            columns: self.columns,
        })
    }
}

/// Values of a column, borrowed.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Values<'a> {
    Real(&'a [f64]),
    Whole(&'a [u64]),
    Text(&'a [String]),
}

impl Values<'_> {
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Real(values) => values.len(),
            Self::Whole(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }

    pub(crate) fn part(&self, rows: Range<usize>) -> Self {
        match self {
            Self::Real(values) => Self::Real(&values[rows]),
            Self::Whole(values) => Self::Whole(&values[rows]),
            Self::Text(values) => Self::Text(&values[rows]),
        }
    }
}

/// Whether a table can be written to a place of this name; to be asked before long work.
///
/// # Errors
/// [`IoError::UnknownFormat`] for an extension that stands for no format, [`IoError::Directory`].
pub fn check_table_path(path: &Path) -> Result<(), IoError> {
    format_to_write(path).map(drop)
}

/// Writes a table, whole or not at all: as CSV (`.csv`, `.txt`, with tabs `.tsv`), Parquet (`.parquet`, `.pq`),
/// NPZ (`.npz`) or for MATLAB (`.mat`). The same
/// table gives the same bytes.
///
/// # Errors
/// Those of [`check_table_path`]; [`IoError::ColumnLength`], [`IoError::NoColumns`], [`IoError::DuplicateColumn`] or
/// [`IoError::ChannelName`] for what cannot be written; those of [`write_atomically`](crate::write_atomically).
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
    table.rows(&path.display().to_string())?;
    write_values(path, table.schema(), &table.values())
}

/// Reads a table back, with the kinds that it was written with; see the table of this module for those of CSV. A column of
/// integers in a Parquet file of other origin is whole where no value is missing or negative, else real.
///
/// # Errors
/// [`IoError`], naming the place in the file.
pub fn read_table(path: &Path) -> Result<OutputTable, IoError> {
    let file = path.display().to_string();
    let (format, bytes) = bytes_of(path)?;
    match format {
        Format::Csv { .. } => csv_columns::read(&bytes, &file),
        Format::Parquet => from_parquet(bytes, &file),
        Format::Npz => output_table_of(npz::read(&bytes, &file)?, &file),
        Format::Mat => output_table_of(mat::read(bytes, &file)?, &file),
        Format::Xdf => output_table_of(xdf::read(&bytes, &file)?, &file),
        Format::Npy => output_table_of(npz::read_single(bytes, &file)?, &file),
    }
}

fn from_parquet(bytes: Vec<u8>, file: &str) -> Result<OutputTable, IoError> {
    let read = parquet::read(bytes, file)?;
    let mut columns = Vec::with_capacity(read.columns.len());
    for parquet::ReadColumn { name, data, nulls, .. } in read.columns {
        let real = |mut values: Vec<f64>| {
            nulls.iter().for_each(|row| values[*row] = f64::NAN);
            ColumnValues::Real(values)
        };
        let values = match data {
            parquet::Data::Real(values) => real(values),
            parquet::Data::Signed(values) if nulls.is_empty() && values.iter().all(|value| *value >= 0) => {
                ColumnValues::Whole(values.into_iter().map(|value| value as u64).collect())
            }
            parquet::Data::Signed(values) => real(values.into_iter().map(|value| value as f64).collect()),
            parquet::Data::Unsigned(values) if nulls.is_empty() => ColumnValues::Whole(values),
            parquet::Data::Unsigned(values) => real(values.into_iter().map(|value| value as f64).collect()),
            // A missing text was read as an empty one.
            parquet::Data::Text(values) => ColumnValues::Text(values),
            parquet::Data::Unread(what) => {
                return Err(IoError::Unsupported {
                    file: file.to_owned(),
                    found: format!("column {} holds {what}", shown(&name)),
                    remedy: "write the table without it",
                });
            }
        };
        columns.push(OutputColumn { name, values });
    }
    Ok(OutputTable {
        comments: read.comments,
        columns,
    })
}
