//! Writing and reading of the columns of results in CSV.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::quotes::check_quotes;
use super::text::{
    comments, escape_formula, is_comment_or_blank, location, reader, row_start, separator, text, unescape_formula,
};
use crate::IoError;
use crate::formats::format::RowWriter;
use crate::results::{ColumnKind, ColumnValues, OutputColumn, OutputTable, TableSchema, Values};
use crate::table::{Cell, check_names};
use crate::wording::abbreviate;

/// State of a CSV file that is written in groups of rows.
struct CsvColumns {
    separator: u8,
}

/// Writes the comments and the header, with commas between the names.
pub(super) fn start_with_commas(file: &mut dyn Write, schema: &TableSchema) -> io::Result<Box<dyn RowWriter>> {
    Ok(Box::new(CsvColumns::start(file, schema, b',')?))
}

/// Writes the comments and the header, with tabs between the names.
pub(super) fn start_with_tabs(file: &mut dyn Write, schema: &TableSchema) -> io::Result<Box<dyn RowWriter>> {
    Ok(Box::new(CsvColumns::start(file, schema, b'\t')?))
}

impl RowWriter for CsvColumns {
    fn write_rows(&mut self, file: &mut dyn Write, columns: &[Values<'_>]) -> io::Result<()> {
        let mut csv = self.writer(file);
        let mut cell = String::new();
        for row in 0..columns.first().map_or(0, Values::len) {
            for column in columns {
                cell.clear();
                let written = match column {
                    // A real number is written with the fewest digits that reproduce it, and with a point or an
                    // exponent, which distinguishes it from an integer.
                    Values::Real(values) => {
                        (values.get(row).filter(|value| !value.is_nan())).map(|value| write!(cell, "{value:?}"))
                    }
                    Values::Whole(values) => values.get(row).map(|value| write!(cell, "{value}")),
                    Values::Text(values) => {
                        let text = values.get(row).map_or("", String::as_str);
                        csv.write_field(escape_formula(text).as_bytes())?;
                        continue;
                    }
                };
                // Writing to a String cannot fail.
                debug_assert!(written.is_none_or(|written| written.is_ok()));
                csv.write_field(&cell)?;
            }
            csv.write_record(None::<&[u8]>)?;
        }
        csv.flush()
    }

    fn finish(self: Box<Self>, _: &mut dyn Write) -> io::Result<()> {
        Ok(())
    }
}

impl CsvColumns {
    fn start(file: &mut dyn Write, schema: &TableSchema, separator: u8) -> io::Result<Self> {
        for comment in &schema.comments {
            writeln!(file, "# {comment}")?;
        }
        let this = Self { separator };
        let mut csv = this.writer(file);
        for column in &schema.columns {
            csv.write_field(escape_formula(&column.name).as_bytes())?;
        }
        csv.write_record(None::<&[u8]>)?;
        csv.flush()?;
        drop(csv);
        Ok(this)
    }

    fn writer<'a>(&self, file: &'a mut dyn Write) -> csv::Writer<&'a mut dyn Write> {
        csv::WriterBuilder::new()
            .delimiter(self.separator)
            // With this setting, text cells that start with # are quoted.
            .comment(Some(b'#'))
            .from_writer(file)
    }
}

/// Reads the columns from the bytes of a CSV file.
pub(super) fn read(bytes: &[u8], file: &str) -> Result<OutputTable, IoError> {
    let text = text(bytes, file)?;
    let mut lines = text.lines().filter(|line| !is_comment_or_blank(line));
    let Some(header_line) = lines.next() else {
        return Err(IoError::Empty { file: file.to_owned() });
    };
    let separator = separator(header_line, lines.next());
    let (names, kinds, rows) = survey_columns(text, file, separator)?;
    let mut values: Vec<ColumnValues> = kinds
        .iter()
        .map(|kind| match kind {
            ColumnKind::Real => ColumnValues::Real(Vec::with_capacity(rows)),
            ColumnKind::Whole => ColumnValues::Whole(Vec::with_capacity(rows)),
            ColumnKind::Text => ColumnValues::Text(Vec::with_capacity(rows)),
        })
        .collect();
    let mut reader = reader(text.as_bytes(), separator);
    let mut record = csv::ByteRecord::new();
    let mut header = true;
    while matches!(reader.read_byte_record(&mut record), Ok(true)) {
        if std::mem::replace(&mut header, false) {
            continue;
        }
        for (column, cell) in values.iter_mut().zip(&record) {
            let cell = utf8(cell);
            match column {
                ColumnValues::Real(values) => values.push(match Cell::parse(cell) {
                    Cell::Number(value) => value,
                    Cell::Missing | Cell::Text => f64::NAN,
                }),
                ColumnValues::Whole(values) => values.push(parse_integer(cell).unwrap_or_default()),
                ColumnValues::Text(values) => values.push(unescape_formula(cell).to_owned()),
            }
        }
    }
    let columns = names.into_iter().zip(values);
    Ok(OutputTable {
        comments: comments(text)
            .map(|line| line.strip_prefix(' ').unwrap_or(line).to_owned())
            .collect(),
        columns: columns.map(|(name, values)| OutputColumn { name, values }).collect(),
    })
}

/// Determines the names and kinds of the columns, and the number of rows.
fn survey_columns(text: &str, file: &str, separator: u8) -> Result<(Vec<String>, Vec<ColumnKind>, usize), IoError> {
    let mut reader = reader(text.as_bytes(), separator);
    let mut record = csv::ByteRecord::new();
    let mut names: Vec<String> = Vec::new();
    let mut kinds = Vec::new();
    let mut rows = 0_usize;
    // The reader fails only on I/O errors, which cannot occur when reading from memory.
    while matches!(reader.read_byte_record(&mut record), Ok(true)) {
        let bytes = text.as_bytes();
        let start = row_start(bytes, record.position().map_or(0, |p| p.byte() as usize));
        check_quotes(
            bytes,
            (start, reader.position().byte() as usize),
            &record,
            separator,
            file,
        )?;
        let line = || location(bytes, start);
        if names.is_empty() {
            names = record
                .iter()
                .map(|name| unescape_formula(utf8(name).trim()).to_owned())
                .collect();
            if names.iter().all(|name| !matches!(Cell::parse(name), Cell::Text)) {
                return Err(IoError::NoHeader {
                    file: file.to_owned(),
                    location: line(),
                    found: abbreviate(&names.join(", ")),
                });
            }
            check_names(&names, file, &mut Vec::new())?;
            kinds = vec![ColumnKind::Whole; names.len()];
            continue;
        }
        if record.len() != names.len() {
            return Err(IoError::RowLength {
                file: file.to_owned(),
                location: line(),
                found: record.len(),
                expected: names.len(),
            });
        }
        rows = rows.saturating_add(1);
        for (kind, cell) in kinds.iter_mut().zip(&record) {
            let cell = utf8(cell);
            *kind = match *kind {
                ColumnKind::Whole if parse_integer(cell).is_some() => ColumnKind::Whole,
                ColumnKind::Whole | ColumnKind::Real if Cell::parse(cell) != Cell::Text => ColumnKind::Real,
                _ => ColumnKind::Text,
            };
        }
    }
    if rows == 0 {
        kinds.fill(ColumnKind::Real);
    }
    Ok((names, kinds, rows))
}

/// Parses an integer as hoid writes it: digits without leading zeros.
fn parse_integer(cell: &str) -> Option<u64> {
    let digits = cell.bytes().all(|b| b.is_ascii_digit()) && (cell == "0" || !cell.starts_with('0'));
    digits.then(|| cell.parse().ok()).flatten()
}

/// The text is valid UTF-8 and the separators are ASCII, so each cell is valid UTF-8.
fn utf8(cell: &[u8]) -> &str {
    std::str::from_utf8(cell).unwrap_or("\u{fffd}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(text: &str) -> Vec<ColumnKind> {
        let table = read(text.as_bytes(), "run.csv").unwrap();
        table.columns.iter().map(|column| column.values.kind()).collect()
    }

    #[test]
    fn column_kinds_are_inferred() {
        use ColumnKind::{Real, Text, Whole};
        let text = "a,b,c,d,e,f\n1,1,1,,01,x\n18446744073709551615,1.0,,,2,1\n";
        assert_eq!(kinds(text), [Whole, Real, Real, Real, Real, Text]);
        assert_eq!(kinds("a,b\n"), [Real, Real]);
        assert_eq!(kinds("a\n18446744073709551616\n"), [Real]);
        assert_eq!(kinds("a\n-1\n"), [Real]);
    }

    #[test]
    fn invalid_tables_are_errors() {
        let message = |text: &str| read(text.as_bytes(), "run.csv").unwrap_err().to_string();
        assert!(message("# only\n").contains("is empty"));
        assert!(message("1,2\n3,4\n").contains("line 1: the first line holds numbers"));
        assert!(message("a,a\n1,2\n").contains("both named \"a\""));
        assert!(message("a,b\n1,2\n\n1\n").contains("line 4: 1 values, expected 2"));
        assert!(message("a,b\n1,\u{0}\n").contains("a zero byte"));
    }
}
