//! Columns of numbers as stored in a file, before selection, checks and repair.
//!
//! Each format fills a [`Table`]; all further processing (selection of columns, sampling, repair) is the same for all
//! formats. A value that is missing or not a number is stored as NaN. Tables of a million rows are processed quickly,
//! because the file is read again only if an error message quotes a cell.

use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;

use super::cell::{Cell, DECIMAL_COMMA_REMEDY, has_decimal_comma, looks_like_date_or_time};
use super::precision::Precision;
use crate::IoError;
use crate::wording::{abbreviate, format_name};

/// Minimum number of separate gaps in a sparse column, and minimum fraction of its rows without a value. A dropout is a
/// single gap.
const SPARSE_LIMITS: (usize, f64) = (5, 0.05);

/// A column of a table.
#[derive(Debug, Default)]
pub(crate) struct Column {
    /// Name of the column; empty if the header has none.
    pub(crate) name: String,
    /// Unit of the column; empty if unknown.
    pub(crate) unit: String,
    /// Role of the signal for the person; empty if unknown.
    pub(crate) role: String,
    /// One value per row; NaN if the cell contains no number.
    pub(crate) values: Vec<f64>,
    /// Rows that contain text, in increasing order.
    pub(crate) texts: Vec<usize>,
    /// True if the values are clock times, converted to s from the first one.
    pub(crate) is_clock_time: bool,
    /// Rows whose value was not recorded but computed from other values of the column (`--sparse`), in increasing
    /// order.
    pub(crate) filled_rows: Vec<usize>,
    /// True if the computed values are held, which makes the signal constant from each recorded value to the next.
    pub(crate) is_held: bool,
    /// Precision of the printed values; kept only for the time.
    pub(crate) precision: Precision,
}

impl Column {
    /// True if the column has neither a number nor text in a row.
    pub(crate) fn is_missing(&self, row: usize) -> bool {
        self.values.get(row).is_none_or(|value| value.is_nan()) && self.texts.binary_search(&row).is_err()
    }

    /// True if values are missing in many places, as for a topic with another rate, and not only in a dropout.
    pub(crate) fn is_sparse(&self, rows: Range<usize>) -> bool {
        let missing = |row: &usize| self.is_missing(*row);
        let follows = |row: &usize| {
            row.checked_sub(1)
                .is_some_and(|row| rows.contains(&row) && missing(&row))
        };
        let places = rows.clone().filter(|row| missing(row) && !follows(row));
        let count = rows.clone().filter(missing).count();
        places.count() >= SPARSE_LIMITS.0 && count as f64 >= SPARSE_LIMITS.1 * rows.len() as f64
    }

    /// Returns the values of the column in some rows, with NaN for values that were not recorded.
    pub(crate) fn recorded_values(&self, rows: Range<usize>) -> Cow<'_, [f64]> {
        let values = self.values.get(rows.clone()).unwrap_or_default();
        if self.filled_rows.is_empty() {
            return Cow::Borrowed(values);
        }
        let is_made = |row: &usize| self.filled_rows.binary_search(row).is_ok();
        let own = |(row, value): (usize, &f64)| if is_made(&row) { f64::NAN } else { *value };
        Cow::Owned(rows.zip(values).map(own).collect())
    }
}

/// The file from which the rows of a table were read, for messages.
pub(crate) trait Source {
    /// Returns the name of the file.
    fn file(&self) -> &str;
    /// Returns the location of a row in the file: "line 12" or "row 12".
    fn location(&self, row: usize) -> String;
    /// Returns the contents of a cell, shortened to a readable length.
    fn cell(&self, row: usize, column: usize) -> String;
    /// True if the file appears to end in the middle of this row.
    fn is_open(&self, _row: usize) -> bool {
        false
    }
}

/// The columns of a file.
pub(crate) struct Table<'a> {
    pub(crate) columns: Vec<Column>,
    pub(crate) rows: usize,
    /// Sample time stated in the file, s; `None` if the file states none.
    pub(crate) sample_time_s: Option<f64>,
    pub(crate) source: Box<dyn Source + 'a>,
    pub(crate) notes: Vec<String>,
}

impl Table<'_> {
    /// Returns the names of all columns in order.
    pub(crate) fn names(&self) -> Vec<&str> {
        self.columns.iter().map(|c| c.name.as_str()).collect()
    }

    /// Returns the value of a column in a row; NaN if the row does not exist.
    pub(crate) fn value(&self, column: usize, row: usize) -> f64 {
        let value = self.columns.get(column).and_then(|column| column.values.get(row));
        value.copied().unwrap_or(f64::NAN)
    }

    /// True if no column has a number in a row, as in a row of units.
    pub(crate) fn row_has_no_numbers(&self, row: usize) -> bool {
        let has_none = |column: &Column| column.values.get(row).is_none_or(|value| value.is_nan());
        self.columns.iter().all(has_none)
    }

    /// Returns the error that explains why the non-finite value of column `at` in a row cannot be used. `rows` are the
    /// rows in use.
    pub(crate) fn bad_value_error(&self, at: usize, row: usize, rows: Range<usize>) -> IoError {
        let unknown = Column::default();
        let column = self.columns.get(at).unwrap_or(&unknown);
        let file = self.source.file().to_owned();
        let place = self.source.location(row);
        let found = self.source.cell(row, at);
        let is_last_cell = self.columns.len().checked_sub(1) == Some(at);
        let name = format_name(&column.name);
        // A sign or a point at the end of a truncated file is the start of a number.
        let is_unfinished_number = is_last_cell && self.source.is_open(row) && matches!(found.as_str(), "-" | ".");
        if is_unfinished_number || column.texts.binary_search(&row).is_ok() {
            let remedy = if has_decimal_comma(&found) {
                DECIMAL_COMMA_REMEDY
            } else if matches!(Cell::parse(&found), Cell::Number(_)) {
                "the point may separate thousands, as the column jumps between such numbers and whole numbers: write \
                 the numbers without thousands separators, or all of them with decimals"
            } else if column.texts.len() == self.rows
                && !column.is_clock_time
                && (column.name == "t" || looks_like_date_or_time(&found))
            {
                UNREAD_MOMENT_REMEDY
            } else if looks_like_date_or_time(&found) && column.texts.len() == self.rows {
                "the column holds dates or clock times: choose it with --time, or choose another column"
            } else if looks_like_date_or_time(&found) {
                "the column mixes numbers with dates or clock times: write it in one format, or give --fs HZ if the \
                 samples are evenly spaced"
            } else if row == 0 && self.rows > 1 && self.row_has_no_numbers(row) {
                UNITS_ROW_REMEDY
            } else if is_last_cell && self.source.is_open(row) {
                "the file ends in the middle of this line: copy or record the file again, or remove this line"
            } else {
                "correct the cell, empty it and bridge it with --fill, or choose another column"
            };
            return IoError::NotANumber {
                file,
                location: place,
                column: name,
                found,
                remedy,
            };
        }
        if column.values.get(row).is_some_and(|value| value.is_infinite()) {
            return IoError::Infinite {
                file,
                location: place,
                column: name,
                found,
            };
        }
        let count = rows.clone().filter(|row| column.is_missing(*row)).count();
        let examined = rows.len();
        let found = if found.is_empty() { String::from("empty") } else { found };
        if column.is_sparse(rows) {
            return IoError::Sparse {
                file,
                location: place,
                column: name,
                found,
                count,
                rows: examined,
            };
        }
        IoError::Missing {
            file,
            location: place,
            column: name,
            found,
            count,
            rows: examined,
        }
    }
}

/// Remedy for a column of dates or clock times in a format that is not read.
const UNREAD_MOMENT_REMEDY: &str = "if these are times, write them as 2024-03-05 10:11:12.5, 05.03.2024 10:11:12.5, \
                                    05 Mar 2024 10:11:12.5, 10:11:12.5 or in s, or give --fs HZ if the samples are \
                                    evenly spaced";

/// Remedy for a first row of the data without numbers.
pub(crate) const UNITS_ROW_REMEDY: &str =
    "no column has a number in this row: if it contains the units, remove it and give --unit e=deg,u=deg";

/// Checks that the names are unique, and adds a note on columns without a name.
pub(crate) fn check_names(names: &[String], file: &str, notes: &mut Vec<String>) -> Result<(), IoError> {
    check_column_count(names.len(), file)?;
    let mut known: HashMap<&str, usize> = HashMap::new();
    for (second, name) in (1..).zip(names) {
        if name.is_empty() {
            notes.push(format!("column {second} has no name and is left out"));
        } else if let Some(first) = known.insert(name, second) {
            return Err(IoError::DuplicateColumn {
                file: file.to_owned(),
                name: abbreviate(name),
                first,
                second,
            });
        }
    }
    Ok(())
}

/// Maximum number of columns of a table; recordings typically have a few tens of columns.
const MAX_COLUMNS: usize = 10_000;

/// Checks the number of columns before memory is allocated for them.
pub(crate) fn check_column_count(columns: usize, file: &str) -> Result<(), IoError> {
    if columns <= MAX_COLUMNS {
        return Ok(());
    }
    Err(IoError::TooManyColumns {
        file: file.to_owned(),
        found: columns,
        max_columns: MAX_COLUMNS,
    })
}

/// Reads the units and the roles from the comments above a table, and returns the sample time stated in the comments.
pub(crate) fn read_comments<'a>(comments: impl Iterator<Item = &'a str>, columns: &mut [Column]) -> Option<f64> {
    let mut sample_time_s = None;
    for line in comments {
        let line = line.trim_start_matches('#').trim();
        if let Some(units) = line.strip_prefix("units:") {
            for_each_named(units, columns, |column, unit| column.unit = unit);
        } else if let Some(roles) = line.strip_prefix("roles:") {
            for_each_named(roles, columns, |column, role| column.role = role);
        } else if let Some(stated) = line.strip_prefix("sample_time:") {
            let value = stated.trim().trim_end_matches('s').trim().parse().ok();
            sample_time_s = value.filter(|ts: &f64| ts.is_finite() && *ts > 0.0);
        }
    }
    sample_time_s
}

/// Calls `set` with each column named in a list `NAME WORDS, NAME WORDS`, and with its words.
fn for_each_named(list: &str, columns: &mut [Column], set: impl Fn(&mut Column, String)) {
    // If the list has more entries than there are columns, the remaining entries are ignored.
    for part in list.split(',').take(columns.len()).map(str::trim) {
        // Both a name and its words may contain blanks: if several column names match, the longest one applies.
        let words_of = |column: &Column| {
            let words = part.strip_prefix(column.name.as_str())?;
            words.starts_with(char::is_whitespace).then(|| words.trim().to_owned())
        };
        let named = columns
            .iter_mut()
            .filter(|c| !c.name.is_empty() && words_of(c).is_some());
        if let Some(column) = named.max_by_key(|c| c.name.len()) {
            let words = words_of(column).unwrap_or_default();
            set(column, words);
        }
    }
}

/// Source of a table from which rows were removed; messages still refer to the rows of the file.
struct RowSelection<'a> {
    source: Box<dyn Source + 'a>,
    rows: Vec<usize>,
}

impl Source for RowSelection<'_> {
    fn file(&self) -> &str {
        self.source.file()
    }

    fn location(&self, row: usize) -> String {
        self.source.location(self.rows.get(row).copied().unwrap_or(row))
    }

    fn cell(&self, row: usize, column: usize) -> String {
        self.source.cell(self.rows.get(row).copied().unwrap_or(row), column)
    }
}

/// Returns a table with only the given rows.
pub(crate) fn keep_rows(table: Table<'_>, rows: Vec<usize>) -> Table<'_> {
    let Table {
        mut columns, source, ..
    } = table;
    for column in &mut columns {
        column.values = rows.iter().filter_map(|row| column.values.get(*row).copied()).collect();
        let still = |of: &[usize]| {
            let found = rows.iter().enumerate().filter(|(_, row)| of.binary_search(row).is_ok());
            found.map(|(at, _)| at).collect()
        };
        (column.texts, column.filled_rows) = (still(&column.texts), still(&column.filled_rows));
    }
    Table {
        columns,
        rows: rows.len(),
        source: Box::new(RowSelection { source, rows }),
        sample_time_s: table.sample_time_s,
        notes: table.notes,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(values: &[f64]) -> Column {
        Column {
            values: values.to_vec(),
            ..Column::default()
        }
    }

    #[test]
    fn slower_topic_is_sparse_but_a_dropout_is_not() {
        let every = |m: usize| {
            column(
                &(0..100)
                    .map(|k| if k % m == 0 { f64::NAN } else { 1.0 })
                    .collect::<Vec<_>>(),
            )
        };
        assert!(every(2).is_sparse(0..100) && every(20).is_sparse(0..100));
        assert!(!every(50).is_sparse(0..100));
        let dropout = column(
            &(0..100)
                .map(|k| if k > 40 { f64::NAN } else { 1.0 })
                .collect::<Vec<_>>(),
        );
        assert!(!dropout.is_sparse(0..100) && !dropout.is_sparse(3..3));
    }
}
