//! Helpers of the group tests: files and columns of tables.
// Each test file uses only part of this module.
#![allow(dead_code, clippy::unwrap_used)]

use std::{collections::BTreeMap, fs, path::Path};

use hoid_io::{ColumnValues, OutputTable};

/// Returns the contents of all files of a directory, by name.
pub fn content(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path());
    files
        .filter(|path| path.is_file())
        .map(|path| {
            (
                path.file_name().unwrap().to_string_lossy().into_owned(),
                fs::read(&path).unwrap(),
            )
        })
        .collect()
}

/// Returns a column of strings.
pub fn texts<'a>(table: &'a OutputTable, name: &str) -> &'a [String] {
    match table.column(name) {
        Some(ColumnValues::Text(values)) => values,
        other => panic!("{name}: {other:?}"),
    }
}

/// Returns a column of numbers.
pub fn reals<'a>(table: &'a OutputTable, name: &str) -> &'a [f64] {
    match table.column(name) {
        Some(ColumnValues::Real(values)) => values,
        other => panic!("{name}: {other:?}"),
    }
}
