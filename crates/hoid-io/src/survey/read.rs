//! The columns of a file of any format, before any selection.

use crate::formats::arrays::{ColumnContents, ColumnPath, Contents, TIME_NAMES};
use crate::table::{Column, DECIMAL_COMMA_REMEDY, Precision, Table, UNITS_ROW_REMEDY, has_decimal_comma};
use crate::wording::format_name;

/// A column as read.
pub(super) struct RawColumn {
    pub(super) path: String,
    pub(super) parent: String,
    pub(super) name: String,
    pub(super) unit: String,
    pub(super) kind: String,
    pub(super) values: Option<Vec<f64>>,
    pub(super) rows: usize,
    pub(super) precision: Precision,
}

/// Returns the columns of a flat table, and notes about problems in reading it.
pub(super) fn columns_of_table(mut table: Table<'_>) -> (Vec<RawColumn>, Vec<String>) {
    let rows = table.rows;
    let commas = decimal_comma_notes(&table);
    table.notes.extend(commas);
    let unusable = unusable_column_notes(&table);
    table.notes.extend(unusable);
    if rows > 1 && table.row_has_no_numbers(0) {
        let place = table.source.location(0);
        table.notes.push(format!("{place}: {UNITS_ROW_REMEDY}"));
    }
    let read = |column: Column| {
        let text = column.texts.len() == rows;
        RawColumn {
            path: column.name.clone(),
            parent: String::new(),
            name: column.name,
            unit: column.unit,
            kind: String::from(if text { "text" } else { "numbers" }),
            values: (!text).then_some(column.values),
            rows,
            precision: column.precision,
        }
    };
    (table.columns.into_iter().map(read).collect(), table.notes)
}

/// Describes text columns that would be numeric if each decimal comma were a point.
fn decimal_comma_notes(table: &Table<'_>) -> Vec<String> {
    let first_text = |(at, column): (usize, &Column)| {
        let row = *column.texts.first()?;
        let cell = table.source.cell(row, at);
        has_decimal_comma(&cell).then(|| {
            let (name, place) = (format_name(&column.name), table.source.location(row));
            let (count, rows) = (column.texts.len(), table.rows);
            format!("column {name}, {place}: \"{cell}\" is text ({count} of {rows} cells); {DECIMAL_COMMA_REMEDY}")
        })
    };
    table.columns.iter().enumerate().filter_map(first_text).collect()
}

/// Describes each numeric column that has some text or infinite cells, with the message that reading it as a signal
/// would give.
fn unusable_column_notes(table: &Table<'_>) -> Vec<String> {
    let first = |(at, column): (usize, &Column)| {
        let numbers = column.values.iter().any(|value| value.is_finite());
        let row = (0..table.rows)
            .find(|row| table.value(at, *row).is_infinite() || column.texts.binary_search(row).is_ok())
            .filter(|row| numbers && !(*row == 0 && table.row_has_no_numbers(0)))?;
        let comma = has_decimal_comma(&table.source.cell(row, at));
        (!comma).then(|| table.bad_value_error(at, row, 0..table.rows).to_string())
    };
    table.columns.iter().enumerate().filter_map(first).collect()
}

/// Returns the columns of a file of named arrays.
pub(super) fn columns_of_arrays(contents: &Contents) -> (Vec<RawColumn>, Vec<String>) {
    let column_paths = contents.column_paths();
    let read = |column_path: ColumnPath| {
        let (values, single) = match &column_path.holds {
            ColumnContents::Numbers(numbers) => (Some(numbers.values()), numbers.kind().is_single()),
            ColumnContents::Texts(_) | ColumnContents::Unread(_) => (None, false),
        };
        let times = values.as_deref().filter(|_| TIME_NAMES.contains(&column_path.name()));
        RawColumn {
            parent: column_path.parent.clone(),
            name: column_path.name().to_owned(),
            unit: column_path.unit.clone(),
            kind: column_path.description(),
            rows: column_path.len(),
            precision: times.map_or_else(Precision::default, |t| Precision::from_times(t, single)),
            values,
            path: column_path.path,
        }
    };
    (column_paths.into_iter().map(read).collect(), contents.notes.clone())
}
