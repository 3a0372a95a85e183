//! Conversion of arrays to columns.
//!
//! An array with one long side is a column. In a matrix, time runs along the longer side, and each row or column of the
//! matrix in this direction is a column of data with its own path: `x(:,2)` or `x(2,:)` in MATLAB notation, counted
//! from 1, `x[:,1]` or `x[1,:]` in Python notation, counted from 0. In a square matrix the first index is time.

use super::contents::{Contents, Entry, Indexing, OBJECT_PREFIX, Value};
use super::numbers::Numbers;
use crate::IoError;
use crate::wording::abbreviate;

/// A matrix with more channels than this counts as an image.
const MAX_MATRIX_CHANNELS: usize = 256;

/// One column of a file, with its path.
#[derive(Debug, Clone)]
pub(crate) struct ColumnPath {
    pub(crate) path: String,
    /// Path of the enclosing structure; empty at top level.
    pub(crate) parent: String,
    pub(crate) unit: String,
    pub(crate) holds: ColumnContents,
}

/// Contents of a column.
#[derive(Debug, Clone)]
pub(crate) enum ColumnContents {
    Numbers(Numbers),
    Texts(Vec<String>),
    Unread(String),
}

impl ColumnPath {
    /// Returns the number of rows; 0 for unsupported content.
    pub(crate) fn len(&self) -> usize {
        match &self.holds {
            ColumnContents::Numbers(numbers) => numbers.len(),
            ColumnContents::Texts(texts) => texts.len(),
            ColumnContents::Unread(_) => 0,
        }
    }

    /// Returns the numbers of the column; `None` if it does not hold numbers.
    pub(crate) fn numbers(&self) -> Option<&Numbers> {
        match &self.holds {
            ColumnContents::Numbers(numbers) => Some(numbers),
            _ => None,
        }
    }

    /// Returns the last part of the path.
    pub(crate) fn name(&self) -> &str {
        let name = self.path.strip_prefix(self.parent.as_str()).unwrap_or(&self.path);
        if self.parent.is_empty() {
            name
        } else {
            name.trim_start_matches('.')
        }
    }

    /// Returns the error that explains why this column is not numeric.
    pub(super) fn not_numeric_error(&self, file: &str) -> IoError {
        IoError::Unsupported {
            file: file.to_owned(),
            found: format!("{} holds {}", abbreviate(&self.path), self.description()),
            remedy: "save the column as an array of real numbers",
        }
    }

    /// True if the value is a MATLAB object.
    pub(super) fn holds_object(&self) -> bool {
        matches!(&self.holds, ColumnContents::Unread(what) if what.starts_with(OBJECT_PREFIX))
    }

    /// Describes the contents of the column in words.
    pub(crate) fn description(&self) -> String {
        match &self.holds {
            ColumnContents::Numbers(numbers) => numbers.kind().name().to_owned(),
            ColumnContents::Texts(_) => String::from("text"),
            ColumnContents::Unread(what) => what.clone(),
        }
    }
}

/// Returns the path without its last part. A point inside brackets does not separate parts.
pub(crate) fn parent(path: &str) -> &str {
    let mut depth = 0_usize;
    for (at, byte) in path.bytes().enumerate().rev() {
        match byte {
            b')' | b']' | b'}' => depth = depth.saturating_add(1),
            b'(' | b'[' | b'{' => depth = depth.saturating_sub(1),
            b'.' if depth == 0 => return &path[..at],
            _ => {}
        }
    }
    ""
}

impl Contents {
    /// Returns the columns of all entries.
    pub(crate) fn column_paths(&self) -> Vec<ColumnPath> {
        self.entries
            .iter()
            .flat_map(|entry| entry.column_paths(self.indexing))
            .collect()
    }
}

impl Entry {
    /// Returns the columns of this entry.
    pub(super) fn column_paths(&self, indexing: Indexing) -> Vec<ColumnPath> {
        let column_path = |path: String, holds| ColumnPath {
            path,
            parent: self.parent.clone(),
            unit: self.unit.clone(),
            holds,
        };
        let one = |holds| vec![column_path(self.path.clone(), holds)];
        match &self.value {
            Value::Texts(texts) => one(ColumnContents::Texts(texts.clone())),
            Value::Unread(what) => one(ColumnContents::Unread(what.clone())),
            Value::Array(array) => {
                let sides: Vec<usize> = array.dims.iter().copied().filter(|side| *side != 1).collect();
                match sides.as_slice() {
                    [] | [_] => one(ColumnContents::Numbers(array.numbers.clone())),
                    [..] if sides.contains(&0) => one(ColumnContents::Numbers(array.numbers.clone())),
                    [rows, columns] if array.dims.len() == 2 && *rows.min(columns) <= MAX_MATRIX_CHANNELS => {
                        let count = *rows.min(columns);
                        let along_first = rows >= columns;
                        let name = |k: usize| match (indexing, along_first) {
                            (Indexing::Matlab, true) => format!("{}(:,{})", self.path, k.saturating_add(1)),
                            (Indexing::Matlab, false) => format!("{}({},:)", self.path, k.saturating_add(1)),
                            (Indexing::Python, true) => format!("{}[:,{k}]", self.path),
                            (Indexing::Python, false) => format!("{}[{k},:]", self.path),
                        };
                        (0..count)
                            .map(|k| column_path(name(k), ColumnContents::Numbers(array.line(k, along_first))))
                            .collect()
                    }
                    _ => {
                        let sides: Vec<String> = array.dims.iter().map(usize::to_string).collect();
                        one(ColumnContents::Unread(format!("an array of {}", sides.join(" x "))))
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::arrays::array::Array;

    fn matrix(dims: &[usize], last_fastest: bool, indexing: Indexing) -> Vec<(String, Vec<f64>)> {
        let count: usize = dims.iter().product();
        let numbers: Vec<f64> = (0..count).map(|k| k as f64).collect();
        let array = Array {
            numbers: Numbers::from_f64(&numbers),
            dims: dims.to_vec(),
            is_row_major: last_fastest,
        };
        let column_paths = Entry::new("x", Value::Array(array)).column_paths(indexing);
        let values = |column_path: ColumnPath| {
            (
                column_path.path.clone(),
                column_path.numbers().map(Numbers::values).unwrap_or_default(),
            )
        };
        column_paths.into_iter().map(values).collect()
    }

    #[test]
    fn matrices_are_split_into_columns() {
        let found = matrix(&[3, 2], true, Indexing::Python);
        assert_eq!(
            found,
            [
                ("x[:,0]".into(), vec![0.0, 2.0, 4.0]),
                ("x[:,1]".into(), vec![1.0, 3.0, 5.0])
            ]
        );
        let found = matrix(&[3, 2], false, Indexing::Matlab);
        assert_eq!(
            found,
            [
                ("x(:,1)".into(), vec![0.0, 1.0, 2.0]),
                ("x(:,2)".into(), vec![3.0, 4.0, 5.0])
            ]
        );
        let found = matrix(&[2, 3], true, Indexing::Python);
        assert_eq!(found[1], ("x[1,:]".into(), vec![3.0, 4.0, 5.0]));
        let found = matrix(&[2, 3], false, Indexing::Matlab);
        assert_eq!(found[1], ("x(2,:)".into(), vec![1.0, 3.0, 5.0]));
        assert_eq!(
            matrix(&[1, 3, 1], true, Indexing::Python),
            [("x".into(), vec![0.0, 1.0, 2.0])]
        );
        assert_eq!(matrix(&[2, 2, 2], true, Indexing::Python), [("x".into(), vec![])]);
        assert_eq!(matrix(&[0, 5], true, Indexing::Python), [("x".into(), vec![])]);
    }

    #[test]
    fn parent_is_the_path_without_its_last_part() {
        assert_eq!(parent("e"), "");
        assert_eq!(parent("data.run(3).e"), "data.run(3)");
        assert_eq!(parent("run(3).x(:,2)"), "run(3)");
        assert_eq!(parent("c{1}"), "");
        assert_eq!(parent("c{1.5}"), "");
    }
}
