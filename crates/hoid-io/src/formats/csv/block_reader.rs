//! Reading of a long text of plain numbers, block by block: neither the whole text nor the columns that were not
//! requested are kept in memory.
//!
//! The first lines, which contain names, units and notes, are read as in any other table. All further rows must be
//! plain ([`super::plain_rows`]); if a row is not plain, no table is returned, and the whole text is read by
//! [`super::table`].
//!
//! Reading stops after the requested span ([`super::span_end`]).

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::foreign::convert_to_plain_csv;
use super::line_limit::{LineLimit, MAX_LINE_BYTES};
use super::plain_rows::{Layout, RowStarts, read_plain_rows};
use super::span_end::SpanEnd;
use super::table::{ParsedText, nth_row, parse_text};
use crate::IoError;
use crate::record::ReadOptions;
use crate::table::{Cell, Column, Source, Table, check_selected, select_columns};
use crate::time::{is_time, is_time_unit, may_be_time};
use crate::wording::abbreviate;

/// Minimum size, in bytes, of a file that is read block by block.
const MIN_LONG_FILE_BYTES: u64 = 16 << 20;
/// Number of bytes read to obtain the header and the first rows.
const HEAD_BYTES: usize = 256 << 10;
/// Size of the first block in bytes; each further block is twice as long as the previous block, up to
/// [`MAX_LINE_BYTES`].
const FIRST_BLOCK_BYTES: usize = 1 << 20;
/// Number of positions in the unread part of a file at which the time is probed.
const PROBE_COUNT: u32 = 64;
/// Number of bytes read at a probed position; it exceeds the length of a line.
const PROBE_BYTES: usize = 64 << 10;

/// Reads the table of a long text; `None` if the text is short, or if it contains anything other than plain numbers.
///
/// # Errors
/// [`IoError::Unreadable`]; [`IoError::LongLine`].
pub(crate) fn table<'a>(path: &Path, file: &'a str, options: &ReadOptions) -> Result<Option<Table<'a>>, IoError> {
    read_long_table(path, file, options, MIN_LONG_FILE_BYTES)
}

/// Reads the table of a file of at least `long` bytes.
fn read_long_table<'a>(
    path: &Path,
    file: &'a str,
    options: &ReadOptions,
    long: u64,
) -> Result<Option<Table<'a>>, IoError> {
    let unreadable = |source| IoError::Unreadable {
        file: file.to_owned(),
        source,
    };
    let Ok(about) = std::fs::metadata(path) else {
        return Ok(None);
    };
    if !about.is_file() || about.len() < long {
        return Ok(None);
    }
    let mut text = LongText {
        file: File::open(path).map_err(unreadable)?,
        position: 0,
        buffer: Vec::new(),
        lines: 0,
        length: about.len() as usize,
        next: FIRST_BLOCK_BYTES,
    };
    let Some(mut parsed) = text.read_head(file, options).map_err(unreadable)? else {
        return Ok(None);
    };
    let separator = parsed.separator;
    let names: Vec<String> = parsed.columns.iter().map(|column| column.name.clone()).collect();
    // If a column is missing, the reader of whole files reports it with a list of all existing columns.
    let known: Vec<&str> = names.iter().map(String::as_str).collect();
    if check_selected(&known, options, file).is_err() {
        return Ok(None);
    }
    let wanted: Vec<bool> = (parsed.columns.iter().enumerate())
        .map(|(at, Column { name, unit, .. })| {
            options.needs_column(name) || may_be_time(at, name, options.time.as_ref()) || is_time_unit(unit)
        })
        .collect();
    let times: Vec<bool> = names.iter().map(|name| is_time(name)).collect();
    let layout = Layout {
        separator,
        with_precision: &times,
        requested_columns: &wanted,
    };
    let end = SpanEnd::of(&parsed, file, options);
    // The columns get capacity for all rows, whose number is estimated from the length of the first rows: unused
    // capacity takes no physical memory.
    let parts = text.length as f64 / text.position as f64;
    let rows = if end.is_some() { 0.0 } else { parsed.rows as f64 * parts };
    for (column, _) in parsed.columns.iter_mut().zip(&wanted).filter(|(_, wanted)| **wanted) {
        // The size of a sparse file may exceed any memory although it contains few rows; a failed reservation is
        // ignored.
        let _ = column.values.try_reserve((rows as usize).saturating_sub(parsed.rows));
    }
    let mut may_end = end.is_some();
    let mut limit = LineLimit::starting_at(text.position);
    while let Some(base) = text.advance(&mut limit, file)? {
        let read = read_plain_rows(text.lines(), 0, layout, |run| {
            run.starts
                .iter()
                .for_each(|start| parsed.starts.push(base.saturating_add(*start)));
            let each = parsed.columns.iter_mut().zip(run.values).zip(run.precision);
            for ((column, values), precision) in each {
                column.values.extend(values);
                column.precision.join(precision);
            }
        });
        if read < text.lines {
            return Ok(None);
        }
        if let Some(end) = end.as_ref().filter(|end| may_end && end.is_reached(&parsed)) {
            may_end = false;
            let probed = end.time_column().map(|column| text.probe_column(column, separator));
            let probed = probed.transpose().map_err(unreadable)?;
            if end.is_last(&parsed, &probed.unwrap_or_default()) {
                break;
            }
        }
    }
    let rows = parsed.starts.len();
    let source = LongSource {
        file,
        path: path.to_owned(),
        separator,
        starts: parsed.starts,
    };
    let table = Table {
        columns: parsed.columns,
        rows,
        sample_time_s: parsed.sample_time_s,
        source: Box::new(source),
        notes: parsed.notes,
    };
    Ok(Some(select_columns(table, |at, _| wanted.get(at) == Some(&true))))
}

/// A text file that is read block by block from start to end.
struct LongText {
    file: File,
    /// Position of the next unread byte.
    position: usize,
    /// Bytes in memory; the first `lines` of them form complete lines.
    buffer: Vec<u8>,
    lines: usize,
    length: usize,
    /// Size of the next block in bytes.
    next: usize,
}

impl LongText {
    /// Reads the first lines as for any other table; `None` unless the table contains only numbers with decimal points.
    fn read_head(&mut self, file: &str, options: &ReadOptions) -> io::Result<Option<ParsedText>> {
        let mut bytes = self.read_at(0, HEAD_BYTES)?;
        let Some(line) = bytes.iter().rposition(|byte| *byte == b'\n') else {
            return Ok(None);
        };
        bytes.truncate(line.saturating_add(1));
        self.position = bytes.len();
        let last = self.read_at(self.length.saturating_sub(1), 1)?;
        let is_marked = bytes.starts_with(b"\xef\xbb\xbf");
        if last != b"\n" || is_marked || bytes.contains(&0) {
            return Ok(None);
        }
        // If the head is rewritten, the rest of the text may need the same changes.
        let found = bytes.clone();
        if !convert_to_plain_csv(&mut bytes, options).is_empty() || bytes != found {
            return Ok(None);
        }
        self.file.seek(SeekFrom::Start(self.position as u64))?;
        let is_plain = |parsed: &ParsedText| {
            let numbers = parsed.columns.iter().all(|column| !column.is_clock_time);
            numbers && !parsed.commas && parsed.starts.len() == parsed.rows
        };
        let parsed = std::str::from_utf8(&bytes)
            .ok()
            .and_then(|text| parse_text(text, file).ok());
        Ok(parsed.filter(is_plain))
    }

    /// Returns the complete lines of the block that was read last.
    fn lines(&self) -> &[u8] {
        self.buffer.get(..self.lines).unwrap_or(&self.buffer)
    }

    /// Reads the next lines and returns the position of the first of them; `None` at the end of the file. An error if a
    /// line is too long to be kept in memory.
    fn advance(&mut self, limit: &mut LineLimit, file: &str) -> Result<Option<usize>, IoError> {
        // The same buffer is used for all blocks.
        self.buffer.drain(..self.lines);
        let base = self.position.saturating_sub(self.buffer.len());
        loop {
            let from = self.buffer.len();
            let read = (&mut self.file).take(self.next as u64).read_to_end(&mut self.buffer);
            let read = read.map_err(|source| IoError::Unreadable {
                file: file.to_owned(),
                source,
            })?;
            self.position = self.position.saturating_add(read);
            self.next = self.next.saturating_mul(2).min(MAX_LINE_BYTES);
            limit.add(self.buffer.get(from..).unwrap_or_default(), file)?;
            let mut new = self.buffer.iter().enumerate().skip(from);
            let line = new.rfind(|(_, byte)| matches!(byte, b'\n' | b'\r'));
            self.lines = line.map_or(self.buffer.len(), |(at, _)| at.saturating_add(1));
            if line.is_some() || read == 0 {
                return Ok((self.lines > 0).then_some(base));
            }
        }
    }

    /// Reads up to `most` bytes from position `from` of the file, regardless of the current reading position.
    fn read_at(&mut self, from: usize, most: usize) -> io::Result<Vec<u8>> {
        self.file.seek(SeekFrom::Start(from as u64))?;
        let mut bytes = Vec::with_capacity(most);
        (&mut self.file).take(most as u64).read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    /// Returns the values of a column at several positions in the unread part of the file, in the order of the file;
    /// NaN where no value was found.
    fn probe_column(&mut self, column: usize, separator: u8) -> io::Result<Vec<f64>> {
        let here = self.position;
        let from = here.saturating_sub(self.buffer.len().saturating_sub(self.lines));
        // If the file grows while it is read, the reading position may exceed the original length.
        let rest = self.length.saturating_sub(from) as f64;
        let value = |text: &mut Self, part: f64| -> io::Result<f64> {
            let bytes = text.read_at(from.saturating_add((rest * part) as usize), PROBE_BYTES)?;
            // A probed position may be in the middle of a line; the next line is complete.
            let line = bytes.split(|byte| *byte == b'\n').nth(1).unwrap_or_default();
            let row = nth_row(line, 0, separator);
            let cell = row.as_ref().and_then(|(_, row)| row.get(column)).unwrap_or_default();
            Ok(match Cell::parse(&String::from_utf8_lossy(cell)) {
                Cell::Number(value) => value,
                Cell::Missing | Cell::Text => f64::NAN,
            })
        };
        // The fractional parts of multiples of the golden ratio are not periodic, so they do not coincide with trials
        // of equal length.
        let mut parts: Vec<f64> = (1..=PROBE_COUNT)
            .map(|k| (f64::from(k) * 0.618_033_988_749_895).fract())
            .collect();
        parts.sort_unstable_by(f64::total_cmp);
        let probed = parts
            .into_iter()
            .map(|part| value(self, part))
            .collect::<io::Result<_>>()?;
        self.file.seek(SeekFrom::Start(here as u64))?;
        Ok(probed)
    }
}

/// The file on the disk, from which a line or a cell is read again if a message needs it.
struct LongSource<'a> {
    file: &'a str,
    path: PathBuf,
    separator: u8,
    starts: RowStarts,
}

impl LongSource<'_> {
    /// Returns the position and the cells of a row.
    fn row(&self, row: usize) -> Option<(usize, csv::ByteRecord)> {
        let (from, behind) = self.starts.nearest_stored(row)?;
        let mut file = File::open(&self.path).ok()?;
        file.seek(SeekFrom::Start(from as u64)).ok()?;
        // The bytes read end at the next row with a known position, or a fixed length after the start of the last row.
        let end = self
            .starts
            .nearest_stored(row.saturating_add(RowStarts::KEPT_ROW_INTERVAL))
            .map_or(self.starts.last()?.saturating_add(PROBE_BYTES), |next| next.0);
        let mut bytes = Vec::new();
        file.take(end.saturating_sub(from) as u64)
            .read_to_end(&mut bytes)
            .ok()?;
        let (start, record) = nth_row(&bytes, behind, self.separator)?;
        Some((from.saturating_add(start), record))
    }
}

impl Source for LongSource<'_> {
    fn file(&self) -> &str {
        self.file
    }

    fn location(&self, row: usize) -> String {
        let count = || {
            let (start, _) = self.row(row)?;
            let mut before = BufReader::new(File::open(&self.path).ok()?).take(start as u64);
            let mut line = 1_usize;
            while before.skip_until(b'\n').ok()? > 0 {
                line = line.saturating_add(1);
            }
            Some(line)
        };
        count().map_or_else(
            || format!("row {}", row.saturating_add(1)),
            |line| format!("line {line}"),
        )
    }

    fn cell(&self, row: usize, column: usize) -> String {
        let record = self.row(row).map(|(_, record)| record);
        let cell = record.as_ref().and_then(|record| record.get(column));
        cell.map_or_else(String::new, |cell| abbreviate(&String::from_utf8_lossy(cell)))
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::io::Write as _;

    use super::super::table::parse;
    use super::*;

    fn file(text: &str) -> tempfile::NamedTempFile {
        let file = tempfile::Builder::new().suffix(".csv").tempfile().unwrap();
        std::fs::write(file.path(), text).unwrap();
        file
    }

    /// Six columns at 100 Hz, one of which contains words; times start again after `trial` rows.
    fn table_text(rows: usize, trial: usize) -> String {
        let mut text = String::from("# units: e deg\nt,e,word,u,x,n\n");
        for row in 0..rows {
            let (t, x) = ((row % trial) as f64 / 100.0, row as f64);
            let e = if row % 1000 == 7 {
                String::new()
            } else {
                (0.37 * x).sin().to_string()
            };
            writeln!(text, "{t:.2},{e},go,{:.5},{:e},{}", (0.11 * x).cos(), x / 7.0, row).unwrap();
        }
        text
    }

    fn options_for(columns: &[&str], to_s: Option<f64>) -> ReadOptions {
        ReadOptions {
            columns: Some(columns.iter().map(|name| (*name).to_owned()).collect()),
            span_s: (None, to_s),
            ..ReadOptions::default()
        }
    }

    #[test]
    fn long_reader_matches_the_whole_text_reader() {
        let text = table_text(60_000, 60_000);
        let file = file(&text);
        let options = options_for(&["n"], None);
        let found = read_long_table(file.path(), "run.csv", &options, 0).unwrap().unwrap();
        let whole = parse(text.as_bytes(), "run.csv").unwrap();
        assert_eq!((found.names(), found.rows), (vec!["t", "e", "u", "n"], 60_000));
        for (at, in_whole) in [0, 1, 3, 5].into_iter().enumerate() {
            let (a, b) = (&found.columns[at], &whole.columns[in_whole]);
            assert_eq!((a.precision, &a.unit, &a.texts), (b.precision, &b.unit, &b.texts));
            assert!(
                a.values
                    .iter()
                    .zip(&b.values)
                    .all(|(a, b)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()))
            );
            for row in [0, 7, 1023, 1024, 40_000, 59_999] {
                assert_eq!(found.source.location(row), whole.source.location(row));
                assert_eq!(found.source.cell(row, at), whole.source.cell(row, in_whole));
            }
        }
        // The whole text is read if the column of words is requested, or if the word is quoted.
        assert!(
            read_long_table(file.path(), "run.csv", &ReadOptions::default(), 0)
                .unwrap()
                .is_none()
        );
        let missing = options_for(&["z"], None);
        assert!(read_long_table(file.path(), "run.csv", &missing, 0).unwrap().is_none());
        let last = text.rfind(",go,").unwrap();
        let quoted = format!("{},\"go\",{}", &text[..last], &text[last + 4..]);
        let found = read_long_table(self::file(&quoted).path(), "run.csv", &options, 0).unwrap();
        assert!(found.is_none());
    }

    /// A recorder may still write to a file that is being read.
    #[test]
    fn a_file_may_grow_while_it_is_read() {
        let written = table_text(40_000, 40_000);
        let file = file(&written);
        let mut growing = LongText {
            file: File::open(file.path()).unwrap(),
            position: 0,
            buffer: Vec::new(),
            lines: 0,
            length: 1000,
            next: FIRST_BLOCK_BYTES,
        };
        growing.advance(&mut LineLimit::default(), "run.csv").unwrap();
        assert!(growing.lines > growing.length);
        assert_eq!(growing.probe_column(0, b',').unwrap().len(), PROBE_COUNT as usize);
    }

    /// A recorder that was stopped by a full disk or a power cut may leave any number of zero bytes.
    #[test]
    fn endless_line_is_an_error() {
        let rows = "1,2\n".repeat(100_000);
        let file = file(&format!("t,e\n{rows}"));
        let mut whole = File::options().write(true).open(file.path()).unwrap();
        whole.set_len(1 << 30).unwrap();
        whole.seek(SeekFrom::End(-1)).unwrap();
        whole.write_all(b"\n").unwrap();
        let error = read_long_table(file.path(), "run.csv", &ReadOptions::default(), 0)
            .err()
            .unwrap();
        let words = "run.csv: no line ends within 32 MB after byte 400004";
        assert!(error.to_string().starts_with(words), "{error}");
    }

    /// The size of a sparse file may suggest more rows than any memory can hold.
    #[cfg(target_os = "linux")]
    #[test]
    fn sparse_file_is_not_read_block_by_block() {
        let rows = "1,2\n".repeat(100_000);
        let file = file(&format!("t,e\n{rows}x,\"y\"\n"));
        let mut whole = File::options().write(true).open(file.path()).unwrap();
        // If the file system does not support files of this length, there is nothing to test.
        let end = whole.set_len(1 << 43).and_then(|()| whole.seek(SeekFrom::End(-1)));
        if end.and_then(|_| whole.write_all(b"\n")).is_ok() {
            let found = read_long_table(file.path(), "run.csv", &ReadOptions::default(), 0);
            assert!(found.unwrap().is_none());
        }
    }

    #[test]
    fn reading_stops_after_the_span_unless_time_restarts() {
        let rows = |text: &str, options: &ReadOptions| {
            let table = read_long_table(file(text).path(), "run.csv", options, 0)
                .unwrap()
                .unwrap();
            (
                table.rows,
                table.columns[0].values.iter().filter(|t| **t < 10.0).count(),
            )
        };
        let (first, in_span) = rows(&table_text(200_000, 200_000), &options_for(&[], Some(10.0)));
        assert!((1000..60_000).contains(&first), "{first}");
        assert_eq!(in_span, 1000);
        assert_eq!(rows(&table_text(200_000, 200_000), &options_for(&[], None)).0, 200_000);
        // In trials of 1000 s, each trial contains the requested span, so the whole file is read.
        assert_eq!(
            rows(&table_text(200_000, 100_000), &options_for(&[], Some(10.0))),
            (200_000, 2000)
        );
        // The span also ends the reading if samples are counted, or if the time is in another unit.
        let counted = ReadOptions {
            sampling_hz: Some(100.0),
            ..options_for(&[], Some(10.0))
        };
        assert!(rows(&table_text(200_000, 200_000), &counted).0 < 60_000);
        let ms = table_text(200_000, 200_000).replacen("\nt,", "\ntime_ms,", 1);
        let whole = rows(&ms, &options_for(&[], Some(10.0)));
        assert_eq!(whole.0, 200_000, "2000 ms are not 10 s");
        assert!(rows(&ms, &options_for(&[], Some(0.01))).0 < 60_000);
    }
}
