//! Reading of CSV as a table.
//!
//! ```text
//! # units: t s, e deg, u deg          comment lines start with #; these two are understood
//! # sample_time: 0.01 s
//! t,e,u                               names, divided by comma, semicolon or tab
//! 0,0.125,-0.5                        one line a sample, decimal points
//! ```
//!
//! If the separator is a semicolon or a tab, as in spreadsheets in many European locales, the numbers may have decimal
//! commas.
//!
//! Blank lines are skipped; a byte order mark and CRLF are accepted. The sample time stated in the comment is exact,
//! whereas t is rounded to its last digit; the stated value is used if t agrees with it.

use std::collections::HashSet;
use std::ops::Range;

use super::foreign::{joined_lines, mismatch};
use super::plain_rows::{Layout, RowStarts, read_plain_rows};
use super::quotes::check_quotes;
use super::text::{
    comments, has_decimal_commas, is_comment_or_blank, is_unit, location, reader, row_start, separator, single_line,
    text, unescape_formula, unterminated_line,
};
use crate::IoError;
use crate::table::{Cell, Column, Source, Table, check_column_count, check_names, read_comments, with_decimal_point};
use crate::time::{ClockTimes, is_time, sampling::pairs};
use crate::wording::{abbreviate, list_names};

/// The text of the file, which is parsed again if an error message needs a line or a cell.
struct CsvSource<'a> {
    file: &'a str,
    text: &'a str,
    separator: u8,
    starts: RowStarts,
    /// Position of the last line if this line has no line end.
    open: Option<usize>,
}

impl CsvSource<'_> {
    /// Returns the position in the text and the cells of a row.
    fn row(&self, row: usize) -> Option<(usize, csv::ByteRecord)> {
        let (from, behind) = self.starts.nearest_stored(row)?;
        let (start, record) = nth_row(self.text.as_bytes().get(from..)?, behind, self.separator)?;
        Some((from.saturating_add(start), record))
    }
}

/// Returns the position and the cells of the n-th row of text that starts with a row.
pub(super) fn nth_row(bytes: &[u8], n: usize, separator: u8) -> Option<(usize, csv::ByteRecord)> {
    let records = reader(bytes, separator).into_byte_records().map_while(Result::ok);
    let record = records.filter(|record| !is_blank_line(record)).nth(n)?;
    Some((row_start(bytes, position(&record)), record))
}

/// Returns the position at which the reader starts to read a record, before bytes that it skips.
fn position(record: &csv::ByteRecord) -> usize {
    record.position().map_or(0, |p| p.byte() as usize)
}

/// True if a record is a blank line, which does not count as a row.
fn is_blank_line(record: &csv::ByteRecord) -> bool {
    record.len() == 1 && record[0].trim_ascii().is_empty()
}

impl Source for CsvSource<'_> {
    fn file(&self) -> &str {
        self.file
    }

    fn location(&self, row: usize) -> String {
        let start = self.row(row).map_or(self.text.len(), |(start, _)| start);
        location(self.text.as_bytes(), start)
    }

    fn cell(&self, row: usize, column: usize) -> String {
        let record = self.row(row).map(|(_, record)| record);
        let cell = record.as_ref().and_then(|record| record.get(column));
        cell.map_or_else(String::new, |cell| abbreviate(&String::from_utf8_lossy(cell)))
    }

    fn is_open(&self, row: usize) -> bool {
        let begins_there = |open| self.starts.last().is_some_and(|last| last >= open);
        self.starts.len().checked_sub(1) == Some(row) && self.open.is_some_and(begins_there)
    }
}

/// The columns of the text, and the positions of its rows.
pub(super) struct ParsedText {
    pub(super) columns: Vec<Column>,
    pub(super) rows: usize,
    pub(super) separator: u8,
    /// True if the numbers of the text have decimal commas.
    pub(super) commas: bool,
    pub(super) starts: RowStarts,
    pub(super) sample_time_s: Option<f64>,
    pub(super) notes: Vec<String>,
}

/// Reads the table from the bytes of a CSV file.
pub(crate) fn parse<'a>(bytes: &'a [u8], file: &'a str) -> Result<Table<'a>, IoError> {
    let text = text(bytes, file)?;
    let parsed = parse_text(text, file)?;
    let source = CsvSource {
        file,
        text,
        separator: parsed.separator,
        starts: parsed.starts,
        open: unterminated_line(text),
    };
    let mut columns = parsed.columns;
    for (at, column) in columns.iter_mut().enumerate() {
        if parsed.separator == b';' && jumps_at_thousands(&column.values) {
            refuse_thousands(column, |row| source.cell(row, at));
        }
    }
    let mut notes = parsed.notes;
    let last = parsed.rows.checked_sub(1).filter(|last| source.is_open(*last));
    notes.extend(last.and_then(|last| truncated_number_note(&source, last)));
    Ok(Table {
        columns,
        rows: parsed.rows,
        sample_time_s: parsed.sample_time_s,
        source: Box::new(source),
        notes,
    })
}

/// Smallest ratio of a whole number to its neighbour with decimals at which the decimals may be thousands.
const THOUSANDS_JUMP: f64 = 100.0;

/// True if values may be whole numbers with a point between thousands, as in 999, 1.051: below 1000, not below 1 if
/// they have decimals, and with a jump between a whole number and a number with decimals.
fn jumps_at_thousands(values: &[f64]) -> bool {
    let is_whole = |value: f64| value.fract() == 0.0;
    let mut finite = values.iter().filter(|value| value.is_finite());
    finite.all(|value| value.abs() < 1000.0 && (is_whole(*value) || value.abs() > 1.0))
        && pairs(values).any(|(a, b)| {
            let (small, large) = if a.abs() < b.abs() { (a, b) } else { (b, a) };
            is_whole(large) && !is_whole(small) && large.abs() >= THOUSANDS_JUMP * small.abs()
        })
}

/// Treats the cells with a point as text if each has three digits after the point.
fn refuse_thousands(column: &mut Column, cell: impl Fn(usize) -> String) {
    let cells = (0..column.values.len()).map(|row| (row, cell(row)));
    let with_point: Vec<(usize, String)> = cells.filter(|(_, cell)| cell.contains('.')).collect();
    let in_thousands = |cell: &str| cell.trim().rsplit('.').next().is_some_and(|digits| digits.len() == 3);
    if !column.texts.is_empty() || !with_point.iter().all(|(_, cell)| in_thousands(cell)) {
        return;
    }
    column.texts = with_point.into_iter().map(|(row, _)| row).collect();
    for row in &column.texts {
        if let Some(value) = column.values.get_mut(*row) {
            *value = f64::NAN;
        }
    }
}

/// Reads the columns of the text.
pub(super) fn parse_text(text: &str, file: &str) -> Result<ParsedText, IoError> {
    let lines = joined_lines(text).map(|(_, line)| line);
    let mut lines = lines.filter(|line| !is_comment_or_blank(line));
    let Some(header_line) = lines.next() else {
        return Err(IoError::Empty { file: file.to_owned() });
    };
    if header_line.trim_start().starts_with('{') {
        return Err(IoError::Json { file: file.to_owned() });
    }
    if let Some(found) = mismatch(text) {
        let (file, place) = (file.to_owned(), format!("line {}", found.line));
        return Err(match found.header_words {
            0 => IoError::NoHeader {
                file,
                location: place,
                found: found.first_row,
            },
            words => IoError::Words {
                file,
                location: place,
                words,
                cells: found.cells,
            },
        });
    }
    let separator = separator(header_line, lines.next());
    let commas = has_decimal_commas(text, separator);
    let bytes = text.as_bytes();
    let first = first_record(bytes, separator);
    let (names, first) = first.ok_or_else(|| IoError::Empty { file: file.to_owned() })?;
    check_quotes(bytes, (first.start, first.end), &names, separator, file)?;
    let mut notes = Vec::new();
    let mut columns = header(&names, commas, file, &mut || location(bytes, first.start), &mut notes)?;
    let mut rows = RowReader {
        file,
        bytes,
        separator,
        commas,
        open: unterminated_line(text),
        times: columns.iter().map(|column| is_time(&column.name)).collect(),
        requested_columns: vec![true; columns.len()],
        moments: columns.iter().map(|_| ClockTimes::default()).collect(),
        starts: RowStarts::default(),
        empty_at_end: 0,
    };
    let mut at = first.end;
    while at < bytes.len() {
        at = rows.read_plain(at, &mut columns);
        at = rows.read_with_full_reader(at, &mut columns)?;
    }
    let RowReader {
        starts, empty_at_end, ..
    } = rows;
    // Rows that contain only separators are ignored at the end of the table, where spreadsheets leave them.
    let count = starts.len().saturating_sub(empty_at_end);
    for column in &mut columns {
        column.values.truncate(count);
    }
    if count == 0 {
        return Err(IoError::NoRows { file: file.to_owned() });
    }
    if commas {
        notes.push(String::from("the commas in the numbers are taken as decimal commas"));
    }
    Ok(ParsedText {
        sample_time_s: read_comments(comments(text), &mut columns),
        columns,
        rows: count,
        separator,
        commas,
        starts,
        notes,
    })
}

/// Returns the first record that is not a blank line, and its byte range.
fn first_record(bytes: &[u8], separator: u8) -> Option<(csv::ByteRecord, Range<usize>)> {
    let mut reader = reader(bytes, separator);
    let mut record = csv::ByteRecord::new();
    // The reader fails only on I/O errors, which cannot occur when reading from memory.
    while matches!(reader.read_byte_record(&mut record), Ok(true)) {
        if !is_blank_line(&record) {
            let start = row_start(bytes, position(&record));
            return Some((record, start..reader.position().byte() as usize));
        }
    }
    None
}

/// Number of rows that the full CSV reader reads before the fast reader is tried again.
const FULL_READER_ROWS: usize = 256;

/// Reader that adds the rows of the text to the columns of a table.
struct RowReader<'a> {
    file: &'a str,
    bytes: &'a [u8],
    separator: u8,
    commas: bool,
    open: Option<usize>,
    /// True for each column that may be a time.
    times: Vec<bool>,
    requested_columns: Vec<bool>,
    moments: Vec<ClockTimes>,
    starts: RowStarts,
    empty_at_end: usize,
}

impl RowReader<'_> {
    /// Reads plain rows starting at position `from`; returns the position of the first line that is not plain.
    fn read_plain(&mut self, from: usize, columns: &mut [Column]) -> usize {
        if self.commas {
            return from;
        }
        let layout = Layout {
            separator: self.separator,
            with_precision: &self.times,
            requested_columns: &self.requested_columns,
        };
        let (moments, starts, empty_at_end) = (&mut self.moments, &mut self.starts, &mut self.empty_at_end);
        read_plain_rows(self.bytes, from, layout, |run| {
            if run.starts.is_empty() {
                return;
            }
            *empty_at_end = 0;
            run.starts.into_iter().for_each(|start| starts.push(start));
            let each = columns.iter_mut().zip(&mut *moments).zip(run.values).zip(run.precision);
            for (((column, moments), values), precision) in each {
                if values.iter().any(|value| !value.is_nan()) {
                    moments.refuse(column);
                }
                column.values.extend(values);
                column.precision.join(precision);
            }
        })
    }

    /// Reads at most [`FULL_READER_ROWS`] rows starting at position `from` with the full CSV reader; returns the
    /// position of the next row.
    fn read_with_full_reader(&mut self, from: usize, columns: &mut [Column]) -> Result<usize, IoError> {
        let mut reader = reader(self.bytes.get(from..).unwrap_or_default(), self.separator);
        let mut record = csv::ByteRecord::new();
        for _ in 0..FULL_READER_ROWS {
            if !matches!(reader.read_byte_record(&mut record), Ok(true)) {
                return Ok(self.bytes.len());
            }
            if !is_blank_line(&record) {
                let start = row_start(self.bytes, from.saturating_add(position(&record)));
                let end = from.saturating_add(reader.position().byte() as usize);
                check_quotes(self.bytes, (start, end), &record, self.separator, self.file)?;
                self.add_row(&record, start, columns)?;
            }
        }
        Ok(from.saturating_add(reader.position().byte() as usize))
    }

    fn add_row(&mut self, record: &csv::ByteRecord, start: usize, columns: &mut [Column]) -> Result<(), IoError> {
        let line = || location(self.bytes, start);
        if record.len() < columns.len() && self.open.is_some_and(|open| start >= open) {
            return Err(IoError::CutRow {
                file: self.file.to_owned(),
                location: line(),
                found: record.len(),
                expected: columns.len(),
            });
        }
        let rest = self.bytes.get(start..).unwrap_or_default();
        let is_below_rows = columns.first().is_some_and(|column| !column.values.is_empty());
        if record.len() != columns.len() && is_below_rows && starts_table(rest, self.separator) {
            return Err(IoError::SecondTable {
                file: self.file.to_owned(),
                location: line(),
            });
        }
        if record.len() != columns.len() {
            return Err(IoError::RowLength {
                file: self.file.to_owned(),
                location: line(),
                found: record.len(),
                expected: columns.len(),
            });
        }
        let blank = record.iter().all(|cell| cell.trim_ascii().is_empty());
        self.empty_at_end = if blank { self.empty_at_end.saturating_add(1) } else { 0 };
        self.starts.push(start);
        let each = columns.iter_mut().zip(&self.times).zip(&mut self.moments).zip(record);
        for (((column, is_time), moments), cell) in each {
            // The text is valid UTF-8 and the separators are ASCII, so each cell is valid UTF-8.
            let cell = std::str::from_utf8(cell).unwrap_or("\u{fffd}");
            let cell = &*with_decimal_point(cell, self.commas);
            match Cell::parse(cell) {
                Cell::Number(value) => {
                    moments.refuse(column);
                    if *is_time {
                        column.precision.add(cell);
                    }
                    column.values.push(value);
                }
                Cell::Missing => column.values.push(f64::NAN),
                Cell::Text => moments.push(column, cell),
            }
        }
        Ok(())
    }
}

/// Number of lines whose last cells are compared with the last number of the file.
const COMPARED_LINES: usize = 8;

/// Detects a truncated last number and returns a note; `None` unless the last line has no line end, its last cell is at
/// least two characters shorter than the last cell of each of the [`COMPARED_LINES`] lines before, and these all have a
/// decimal point.
fn truncated_number_note(source: &CsvSource<'_>, last: usize) -> Option<String> {
    let last_cell = |row: usize| {
        let (start, _) = source.row(row)?;
        let line = source.text.get(start..)?.lines().next().unwrap_or_default();
        Some(
            line.rsplit(char::from(source.separator))
                .next()
                .unwrap_or_default()
                .trim(),
        )
    };
    let compared = last.checked_sub(COMPARED_LINES)?;
    let cut = last_cell(last)?;
    let length = cut.len().saturating_add(1);
    let is_longer = |row: usize| last_cell(row).is_some_and(|cell| cell.contains('.') && cell.len() > length);
    (compared..last).all(is_longer).then(|| {
        format!(
            "the last line of the file has no line ending, and its last number ({}) is shorter than those above: the \
             line may be truncated; exclude it with --to",
            abbreviate(cut)
        )
    })
}

fn header(
    record: &csv::ByteRecord,
    commas: bool,
    file: &str,
    place: &mut dyn FnMut() -> String,
    notes: &mut Vec<String>,
) -> Result<Vec<Column>, IoError> {
    check_column_count(record.len(), file)?;
    let names: Vec<String> = record
        .iter()
        .map(|name| single_line(unescape_formula(String::from_utf8_lossy(name).trim())).into_owned())
        .collect();
    let is_number = |name: &String| !matches!(Cell::parse(&with_decimal_point(name, commas)), Cell::Text);
    if names.iter().all(is_number) {
        return Err(IoError::NoHeader {
            file: file.to_owned(),
            location: place(),
            found: abbreviate(&names.join(", ")),
        });
    }
    let names = with_unique_names(names, notes);
    check_names(&names, file, notes)?;
    let column = |name: String| Column {
        unit: unit_in(&name).unwrap_or_default().to_owned(),
        name,
        ..Column::default()
    };
    Ok(names.into_iter().map(column).collect())
}

/// Makes names unique: columns with the same name are numbered by their position, so each of them can be selected as a
/// signal.
fn with_unique_names(names: Vec<String>, notes: &mut Vec<String>) -> Vec<String> {
    let mut known: HashSet<&str> = HashSet::new();
    let named = names.iter().map(String::as_str).filter(|name| !name.is_empty());
    let several: HashSet<&str> = named.filter(|name| !known.insert(name)).collect();
    let different = |(number, name): (usize, &String)| match several.contains(name.as_str()) {
        true => format!("{name} (column {number})"),
        false => name.clone(),
    };
    let found: Vec<String> = (1..).zip(&names).map(different).collect();
    let renamed: Vec<&str> = found
        .iter()
        .zip(&names)
        .filter(|(new, old)| new != old)
        .map(|(new, _)| new.as_str())
        .collect();
    if !renamed.is_empty() {
        notes.push(format!(
            "columns with the same name are renamed: {}",
            list_names(&renamed)
        ));
    }
    found
}

/// Returns the unit at the end of a name such as `Stick [V]` or `e (deg)`. A number in brackets is an index or part of
/// the name.
fn unit_in(name: &str) -> Option<&str> {
    let (before, unit) = match name.strip_suffix(']') {
        Some(inside) => inside.rsplit_once('[')?,
        None => name.strip_suffix(')')?.rsplit_once('(')?,
    };
    let unit = unit.trim();
    (!before.trim().is_empty() && is_unit(unit)).then_some(unit)
}

/// Number of lines in which the header of a second table is searched for.
const LINES_TO_HEADER: usize = 6;

/// True if text starts with a header of several columns, which a title may precede.
fn starts_table(text: &[u8], separator: u8) -> bool {
    let is_text = |cell: &[u8]| Cell::parse(std::str::from_utf8(cell).unwrap_or_default()) == Cell::Text;
    let mut lines = text.split(|byte| *byte == b'\n').take(LINES_TO_HEADER);
    lines.any(|line| {
        let cells = line.split(|byte| *byte == separator);
        cells.clone().count() > 1 && cells.clone().all(is_text)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names_and_rows(text: &str) -> (Vec<String>, usize) {
        let table = parse(text.as_bytes(), "run.csv").unwrap();
        (table.names().into_iter().map(str::to_owned).collect(), table.rows)
    }

    fn message(bytes: &[u8]) -> String {
        match parse(bytes, "run.csv") {
            Ok(_) => panic!("was read"),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn equivalent_notations_give_the_same_table() {
        for text in [
            "t,e,u\n0,1,2\n1,3,4\n",
            "t;e;u\n0;1;2\n1;3;4",
            "t\te\tu\r\n0\t1\t2\r\n1\t3\t4\r\n",
            "\u{feff}t,e,u\r\n\r\n0,1,2\r\n  \r\n1,3,4\r\n",
            "# made by hand\n\n#; ; ;\n \"t\" , e ,u\n# here, too\n0, 1 ,2\n1,3,4\n\n",
            "t,e,u\r0,1,2\r1,3,4\r",
            "t,e,u\n0,1,2\n1,3,4\n,,\n,,\n",
        ] {
            let table = parse(text.as_bytes(), "run.csv").unwrap();
            assert_eq!(table.rows, 2, "{text:?}");
            assert_eq!(table.columns[0].values, [0.0, 1.0], "{text:?}");
            assert_eq!(table.columns[2].values, [2.0, 4.0], "{text:?}");
        }
        assert_eq!(names_and_rows("\"a,b\";c\n1;2\n").0, ["a,b", "c"]);
        assert_eq!(names_and_rows(",t,e,u,\n0,0,1,2,\n").0, ["", "t", "e", "u", ""]);
    }

    /// The full CSV reader reads quoted cells; without quotes, the fast reader reads rows of numbers in several parts.
    /// Both readers give the same bits, text cells, precision and positions.
    #[test]
    fn fast_reader_matches_the_full_csv_reader() {
        let mut state = 7_u64;
        let mut draw = |below: u64| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % below
        };
        let odd = [
            "", " ", "-", "abc", "1e999", "NaN", "+.5", "-1.", " 7 ", "1e", "0x10", "1_0", ".", "-1e-3",
        ];
        let (mut plain, mut quoted) = (String::from("t,e,u\n"), String::from("t,e,u\n"));
        for row in 0..200_000 {
            let mut cells = vec![format!("{:.3}", f64::from(row) * 0.01)];
            for _ in 0..2 {
                let digits = draw(17) as usize;
                let value = (draw(1 << 30) as f64 / f64::from(1 << 20) - 512.0) * 10_f64.powi(draw(12) as i32 - 6);
                cells.push(match draw(200) {
                    0 => odd[draw(odd.len() as u64) as usize].to_owned(),
                    1 => format!("{value:e}"),
                    2 => format!("  {value} "),
                    _ => format!("{value:.digits$}"),
                });
            }
            let ends = ["\n", "\r\n", "\n\n", "\n# aside\n"][if draw(50) == 0 { draw(4) as usize } else { 0 }];
            plain += &(cells.join(",") + ends);
            let cells: Vec<String> = cells.iter().map(|cell| format!("\"{cell}\"")).collect();
            quoted += &(cells.join(",") + ends);
        }
        let (plain, quoted) = (plain.into_bytes(), quoted.into_bytes());
        assert!(plain.len() > 5 << 20);
        let [plain, quoted] = [&plain, &quoted].map(|bytes| parse(bytes, "run.csv").unwrap());
        assert_eq!(plain.rows, quoted.rows);
        for (at, (a, b)) in plain.columns.iter().zip(&quoted.columns).enumerate() {
            assert_eq!(
                (&a.texts, a.precision, a.is_clock_time),
                (&b.texts, b.precision, b.is_clock_time)
            );
            for (row, (a, b)) in a.values.iter().zip(&b.values).enumerate() {
                assert!(
                    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()),
                    "{row}: {a} {b}"
                );
            }
            for row in [0, 1023, 1024, 100_001, plain.rows - 1] {
                assert_eq!(plain.source.cell(row, at).trim(), quoted.source.cell(row, at).trim());
                assert_eq!(plain.source.location(row), quoted.source.location(row));
            }
        }
    }

    #[test]
    fn line_numbers_match_a_text_editor() {
        let text = "# one\r\n\r\nt,e,u\r\n0,1,2\r\n# five\r\n\r\n1,x,4\r\n";
        let table = parse(text.as_bytes(), "run.csv").unwrap();
        assert_eq!(table.source.location(0), "line 4");
        assert_eq!(table.source.location(1), "line 7");
        assert_eq!(table.source.cell(1, 1), "x");
        assert_eq!(table.columns[1].texts, [1]);
        assert!(message(b"# one\n\nt,e,u\n0,1,2\n#\n1,2\n").contains("run.csv, line 6: 2 values, expected 3"));
        assert!(message(b"t,e,u\n0,1,2,3\n").contains("line 2: 4 values, expected 3"));
    }

    #[test]
    fn units_and_sample_time_are_read_from_comments() {
        let text = "# units: t s, e deg, K_e deg/deg, stick x mV per deg, q -\n# sample_time: 0.0125 s\nt,e,K_e,stick,stick x\n0,1,2,3,4\n";
        let table = parse(text.as_bytes(), "run.csv").unwrap();
        let units: Vec<&str> = table.columns.iter().map(|c| c.unit.as_str()).collect();
        assert_eq!(units, ["s", "deg", "deg/deg", "", "mV per deg"]);
        assert_eq!(table.sample_time_s, Some(0.0125));
        let none = parse(b"# sample_time: -1 s\nt,e\n0,1\n# units: t h\n", "run.csv").unwrap();
        assert_eq!(none.sample_time_s, None);
        assert_eq!(none.columns[0].unit, "");
    }

    #[test]
    fn units_are_read_from_column_names() {
        let header = "t,Fehler [deg],Knüppel (V),x(1),x[2],[deg],y (left hand),z (°/s)";
        let text = format!("{header}\n0,1,2,3,4,5,6,7\n");
        let table = parse(text.as_bytes(), "run.csv").unwrap();
        let units: Vec<&str> = table.columns.iter().map(|c| c.unit.as_str()).collect();
        assert_eq!(units, ["", "deg", "V", "", "", "", "", "°/s"]);
    }

    #[test]
    fn clock_times_become_seconds_from_the_first() {
        let values = |cells: &str| {
            let text = format!("t,e\n{cells}");
            let table = parse(text.as_bytes(), "run.csv").unwrap();
            let [t, _] = table.columns.as_slice() else {
                panic!("two columns")
            };
            (t.values.clone(), t.texts.clone(), t.is_clock_time)
        };
        let (t, texts, is_clock_time) = values("10:11:59.98,1\n10:12:00.00,1\n,1\n10:12:00.04,1\n");
        assert_eq!((t[0], t[1], t[3]), (0.0, 0.02, 0.06));
        assert!(t[2].is_nan() && texts.is_empty() && is_clock_time);
        // If a number or another text is among the clock times, the column does not hold clock times.
        for other in ["1", "abc"] {
            let (t, texts, is_clock_time) = values(&format!("10:11:59,1\n,1\n{other},1\n10:12:00,1\n"));
            assert_eq!(texts, if other == "1" { vec![0, 3] } else { vec![0, 2, 3] });
            assert!(!is_clock_time && (t[0].is_nan() && t[3].is_nan()));
        }
    }

    #[test]
    fn truncated_file_is_reported() {
        let rows: String = (0..20).map(|k| format!("{k}.00,0.12{k:02},-0.5{k:02}1\n")).collect();
        let text = format!("t,e,u\n{rows}");
        let notes = |text: &str| parse(text.as_bytes(), "run.csv").unwrap().notes;
        assert!(notes(&text).is_empty());
        // A missing line end alone is not reported, since some programs never write the last line end.
        assert!(notes(text.trim_end()).is_empty());
        let found = notes(&text[..text.len() - 4]);
        assert!(
            found[0].contains("(-0.5)") && found[0].contains("may be truncated"),
            "{found:?}"
        );
        let found = message(&text.as_bytes()[..text.len() - 9]);
        assert!(
            found.contains("run.csv is truncated in line 21, the last line: 2 of 3 values"),
            "{found}"
        );
        // A short row in the middle of a file is not reported as truncation.
        assert!(message(b"t,e,u\n0,1\n1,2,3").contains("line 2: 2 values, expected 3"));
        let table = parse(b"t,e,u\n0,1,2\n1,2,-", "run.csv").unwrap();
        let error = table.bad_value_error(2, 1, 0..2).to_string();
        assert!(
            error.contains("line 3") && error.contains("ends in the middle"),
            "{error}"
        );
    }

    #[test]
    fn invalid_tables_are_errors() {
        assert!(message(b"").contains("run.csv is empty"));
        assert!(message(b"\n# only\n  \n").contains("is empty"));
        assert!(message(b"t,e,u\n").contains("no samples"));
        assert!(message(b"t,e,u\n,,\n").contains("no samples"));
        assert!(message(b"# t,e,u\n0,1,2\n").contains("line 2: the first line holds numbers (0, 1, 2)"));
        let text = b"t,e,u,e,\n0,1,2,3,4\n";
        let table = parse(text, "run.csv").unwrap();
        assert_eq!(table.names(), ["t", "e (column 2)", "u", "e (column 4)", ""]);
        assert!(
            table.notes[0].contains("renamed: e (column 2), e (column 4)"),
            "{:?}",
            table.notes
        );
        assert!(message(b"t,e\n0,1\xff\n").contains("line 2: the byte 0xFF"));
        assert!(message(b"PK\x03\x04\x00").contains("line 1: a zero byte"));
        let long = format!("t,e\n0,1\n{},2,3\n", "x".repeat(1000));
        assert!(message(long.as_bytes()).contains("line 3: 3 values"));
    }
}
