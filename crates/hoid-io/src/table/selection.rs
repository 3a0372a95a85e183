//! Selection of the columns of a table that are kept.

use super::column_option::ColumnOption;
use super::columns::{Source, Table};
use crate::IoError;
use crate::record::ReadOptions;
use crate::wording::{did_you_mean, list_names};

/// Source of a table from which columns were removed; messages still refer to the columns of the file.
struct ColumnSelection<'a> {
    source: Box<dyn Source + 'a>,
    columns: Vec<usize>,
}

impl Source for ColumnSelection<'_> {
    fn file(&self) -> &str {
        self.source.file()
    }

    fn location(&self, row: usize) -> String {
        self.source.location(row)
    }

    fn cell(&self, row: usize, column: usize) -> String {
        self.source
            .cell(row, self.columns.get(column).copied().unwrap_or(column))
    }

    fn is_open(&self, row: usize) -> bool {
        self.source.is_open(row)
    }
}

/// Returns the table with only the columns for which `keep` is true.
pub(crate) fn select_columns<'a>(table: Table<'a>, keep: impl Fn(usize, &str) -> bool) -> Table<'a> {
    let names = table.names();
    let columns = names.iter().enumerate().filter(|(at, name)| keep(*at, name));
    let columns: Vec<usize> = columns.map(|(at, _)| at).collect();
    if columns.len() == table.columns.len() {
        return table;
    }
    let Table {
        columns: all, source, ..
    } = table;
    let kept = |(at, _): &(usize, _)| columns.binary_search(at).is_ok();
    Table {
        columns: all
            .into_iter()
            .enumerate()
            .filter(kept)
            .map(|(_, column)| column)
            .collect(),
        source: Box::new(ColumnSelection { source, columns }),
        ..table
    }
}

/// Checks that the requested columns are among `names`.
///
/// # Errors
/// [`IoError::NoSuchColumn`] if a column of the input or the output, or an additional column, is not among `names`.
pub(crate) fn check_selected(names: &[&str], options: &ReadOptions, file: &str) -> Result<(), IoError> {
    let Some(kept) = &options.columns else { return Ok(()) };
    for signal in options.input.iter().chain([&options.output]) {
        signal.resolve(names, file)?;
    }
    match kept.iter().find(|column| !names.contains(&column.as_str())) {
        None => Ok(()),
        Some(missing) => Err(IoError::NoSuchColumn {
            file: file.to_owned(),
            missing: format!("\"{missing}\""),
            suggestion: did_you_mean(&[missing], names).into_boxed_str(),
            requested: kept.join(","),
            available: list_names(names),
            option: ColumnOption::Kept,
        }),
    }
}
