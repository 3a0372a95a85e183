//! Columns of the tables of a group, written and read by name.

use hoid_io::{ColumnKind, ColumnSchema, ColumnValues, OutputTable, TableSchema};

/// Returns text columns with these names.
pub(super) fn text_columns<S: AsRef<str>>(names: &[S]) -> impl Iterator<Item = (&str, ColumnKind)> {
    names.iter().map(|name| (name.as_ref(), ColumnKind::Text))
}

/// Returns columns of real numbers with these names.
pub(super) fn real_columns<S: AsRef<str>>(names: &[S]) -> impl Iterator<Item = (&str, ColumnKind)> {
    names.iter().map(|name| (name.as_ref(), ColumnKind::Real))
}

/// Returns the schema of a table with these columns.
pub(super) fn schema<'a>(columns: impl Iterator<Item = (&'a str, ColumnKind)>) -> TableSchema {
    TableSchema {
        comments: Vec::new(),
        columns: columns
            .map(|(name, kind)| ColumnSchema {
                name: name.to_owned(),
                kind,
            })
            .collect(),
    }
}

/// Reads a text column; empty if there is no such column.
pub(super) fn texts<'a>(table: &'a OutputTable, name: &str) -> &'a [String] {
    match table.column(name) {
        Some(ColumnValues::Text(values)) => values,
        _ => &[],
    }
}

/// Reads a numeric column; empty if there is no such column.
pub(super) fn numbers<'a>(table: &'a OutputTable, name: &str) -> &'a [f64] {
    match table.column(name) {
        Some(ColumnValues::Real(values)) => values,
        _ => &[],
    }
}

/// Separator between sentences in one cell.
const SENTENCE_SEPARATOR: &str = " | ";

/// Joins sentences into the text of one cell.
pub(super) fn join_sentences<'a>(sentences: impl Iterator<Item = &'a str>) -> String {
    sentences.collect::<Vec<_>>().join(SENTENCE_SEPARATOR)
}

/// Splits the text of a cell into its sentences.
pub(super) fn split_sentences(cell: &str) -> Vec<String> {
    cell.split(SENTENCE_SEPARATOR)
        .filter(|sentence| !sentence.is_empty())
        .map(str::to_owned)
        .collect()
}
