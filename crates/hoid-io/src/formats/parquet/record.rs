//! Records in Parquet.
//!
//! Numeric columns of any type are read as numbers, a null is a missing value, and text columns are treated as in CSV.
//! Units and sample time are in the comments, in the same format as in CSV.

use super::columns::{ColumnData, ReadColumn};
use super::read::read;
use crate::IoError;
use crate::table::{Cell, Column, Precision, Source, Table, check_names, read_comments};
use crate::time::{ClockTimes, is_time, seconds_between};
use crate::wording::abbreviate;

/// The original cells of a file, for messages about values that are not finite numbers.
struct ParquetSource<'a> {
    file: &'a str,
    columns: Vec<Cells>,
}

/// The cells of a column that its numbers do not represent.
enum Cells {
    Numbers {
        nulls: Vec<usize>,
        infinite: Vec<(usize, f64)>,
    },
    Texts {
        texts: Vec<String>,
        nulls: Vec<usize>,
    },
    Moments {
        nulls: Vec<usize>,
    },
    Unread(&'static str),
}

impl Source for ParquetSource<'_> {
    fn file(&self) -> &str {
        self.file
    }

    fn location(&self, row: usize) -> String {
        format!("row {}", row.saturating_add(1))
    }

    fn cell(&self, row: usize, column: usize) -> String {
        match self.columns.get(column) {
            Some(Cells::Numbers { nulls, .. } | Cells::Texts { nulls, .. } | Cells::Moments { nulls })
                if nulls.binary_search(&row).is_ok() =>
            {
                String::from("null")
            }
            Some(Cells::Numbers { infinite, .. }) => {
                let found = infinite.binary_search_by_key(&row, |cell| cell.0).ok();
                let cell = found.and_then(|k| infinite.get(k));
                cell.map_or_else(|| String::from("NaN"), |(_, value)| value.to_string())
            }
            Some(Cells::Texts { texts, .. }) => texts.get(row).map_or_else(String::new, |text| abbreviate(text)),
            Some(Cells::Moments { .. }) => String::from("a date or time"),
            Some(Cells::Unread(what)) => String::from(*what),
            None => String::new(),
        }
    }
}

/// Reads the table from the bytes of a Parquet file.
pub(super) fn parse<'a>(bytes: Vec<u8>, file: &'a str) -> Result<Table<'a>, IoError> {
    let read = read(bytes, file)?;
    let rows = read.rows;
    if rows == 0 || read.columns.is_empty() {
        return Err(IoError::NoRows { file: file.to_owned() });
    }
    let mut notes = Vec::new();
    let names: Vec<String> = read.columns.iter().map(|column| column.name.clone()).collect();
    check_names(&names, file, &mut notes)?;
    let (mut columns, cells): (Vec<Column>, Vec<Cells>) =
        read.columns.into_iter().map(|column| column_of(column, rows)).unzip();
    let sample_time_s = read_comments(read.comments.iter().map(String::as_str), &mut columns);
    Ok(Table {
        columns,
        rows,
        sample_time_s,
        source: Box::new(ParquetSource { file, columns: cells }),
        notes,
    })
}

fn column_of(read: ReadColumn, rows: usize) -> (Column, Cells) {
    let mut column = Column {
        name: read.name,
        ..Column::default()
    };
    let nulls = read.nulls;
    let single = read.single;
    column.values = match read.data {
        ColumnData::Real(values) => values,
        ColumnData::Signed(values) => values.into_iter().map(|value| value as f64).collect(),
        ColumnData::Unsigned(values) => values.into_iter().map(|value| value as f64).collect(),
        ColumnData::Text(texts) => {
            let mut moments = ClockTimes::default();
            for text in &texts {
                match Cell::parse(text) {
                    Cell::Number(value) => {
                        moments.refuse(&mut column);
                        column.values.push(value);
                    }
                    Cell::Missing => column.values.push(f64::NAN),
                    Cell::Text => moments.push(&mut column, text),
                }
            }
            return (column, Cells::Texts { texts, nulls });
        }
        ColumnData::Moments(moments) => {
            let known = |row: &usize| nulls.binary_search(row).is_err();
            let first = (moments.iter().enumerate()).find(|(row, _)| known(row));
            let first = first.map_or(0, |(_, moment)| *moment);
            column.is_clock_time = true;
            column.unit = String::from("s");
            column.values = moments.into_iter().map(|ns| seconds_between(ns, first)).collect();
            mark_missing(&mut column.values, &nulls);
            column.precision = Precision::from_times(&column.values, single);
            return (column, Cells::Moments { nulls });
        }
        ColumnData::Unread(what) => {
            column.values = vec![f64::NAN; rows];
            column.texts = (0..rows).collect();
            return (column, Cells::Unread(what));
        }
    };
    mark_missing(&mut column.values, &nulls);
    if is_time(&column.name) {
        column.precision = Precision::from_times(&column.values, single);
    }
    let infinite = column
        .values
        .iter()
        .enumerate()
        .filter(|(_, value)| value.is_infinite());
    let infinite = infinite.map(|(row, value)| (row, *value)).collect();
    (column, Cells::Numbers { nulls, infinite })
}

/// Marks the values of the given rows as missing.
pub(super) fn mark_missing(values: &mut [f64], nulls: &[usize]) {
    for row in nulls {
        if let Some(value) = values.get_mut(*row) {
            *value = f64::NAN;
        }
    }
}
