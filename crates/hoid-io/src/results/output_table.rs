//! Columns of results, for writing and reading.
//!
//! | | CSV | Parquet |
//! |---|---|---|
//! | real | the fewest digits that reproduce the number, always with a point or an exponent; empty for NaN | DOUBLE, null for NaN |
//! | whole | digits | unsigned INT64 |
//! | text | quoted if necessary | BYTE_ARRAY in UTF-8 |
//! | comments | lines above the header, after `# ` | lines under the key `hoid.comments` |
//!
//! Parquet reproduces the written data. CSV stores no types: a column is read as integers if each cell is an integer,
//! as reals if each cell is a number or empty, otherwise as text. Tables written by hoid are reproduced, except text
//! columns in which all cells look like numbers, and columns without rows.

use std::ops::Range;

use crate::IoError;

/// A table of results: comments and columns.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OutputTable {
    /// Comments of the table, one per line.
    pub comments: Vec<String>,
    /// Columns of equal length.
    pub columns: Vec<OutputColumn>,
}

/// Column of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputColumn {
    /// Name of the column, unique in the table.
    pub name: String,
    /// One value per row.
    pub values: ColumnValues,
}

/// Values of a column, which are all of one kind.
#[derive(Debug, Clone, PartialEq)]
pub enum ColumnValues {
    /// Real numbers; NaN is written as an empty cell.
    Real(Vec<f64>),
    /// Counts and flags.
    Whole(Vec<u64>),
    /// Names.
    Text(Vec<String>),
}

/// Kind of the values of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnKind {
    /// Real numbers.
    Real,
    /// Integers.
    Whole,
    /// Texts.
    Text,
}

/// Comments, names and kinds of the columns of a table.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TableSchema {
    /// Comments of the table, one per line.
    pub comments: Vec<String>,
    /// The columns.
    pub columns: Vec<ColumnSchema>,
}

/// Name and kind of a column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnSchema {
    /// Name of the column.
    pub name: String,
    /// Kind of the values.
    pub kind: ColumnKind,
}

impl OutputTable {
    /// Returns the schema of the table.
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

    /// Returns the values of the column with this name; `None` if there is none.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&ColumnValues> {
        self.columns.iter().find(|c| c.name == name).map(|c| &c.values)
    }

    /// Returns the number of rows; an error if the columns differ in length.
    pub(super) fn row_count(&self, file: &str) -> Result<usize, IoError> {
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

    pub(super) fn values(&self) -> Vec<Values<'_>> {
        self.columns.iter().map(|column| column.values.as_values()).collect()
    }
}

impl ColumnValues {
    /// Returns the number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.as_values().len()
    }

    /// True if the column has no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the kind of the values.
    #[must_use]
    pub fn kind(&self) -> ColumnKind {
        match self {
            Self::Real(_) => ColumnKind::Real,
            Self::Whole(_) => ColumnKind::Whole,
            Self::Text(_) => ColumnKind::Text,
        }
    }

    pub(super) fn as_values(&self) -> Values<'_> {
        match self {
            Self::Real(values) => Values::Real(values),
            Self::Whole(values) => Values::Whole(values),
            Self::Text(values) => Values::Text(values),
        }
    }
}

impl TableSchema {
    /// Returns the schema in a form that can be written (each comment on one line), after checking that names are
    /// unique.
    pub(super) fn checked(self, file: &str) -> Result<Self, IoError> {
        if self.columns.is_empty() {
            return Err(IoError::NoColumns { file: file.to_owned() });
        }
        for (second, column) in self.columns.iter().enumerate() {
            let name = &column.name;
            let reason = if name.is_empty() {
                Some("it has no name")
            } else if name != name.trim() {
                Some("its name starts or ends with a blank")
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
            if let Some(first) = self.columns.iter().take(second).position(|other| other.name == *name) {
                return Err(IoError::DuplicateColumn {
                    file: file.to_owned(),
                    name: name.clone(),
                    first: first.saturating_add(1),
                    second: second.saturating_add(1),
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

/// Borrowed values of a column.
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

    pub(crate) fn slice(&self, rows: Range<usize>) -> Self {
        match self {
            Self::Real(values) => Self::Real(values.get(rows).unwrap_or_default()),
            Self::Whole(values) => Self::Whole(values.get(rows).unwrap_or_default()),
            Self::Text(values) => Self::Text(values.get(rows).unwrap_or_default()),
        }
    }
}
