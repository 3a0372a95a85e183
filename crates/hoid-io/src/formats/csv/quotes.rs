//! Quotation marks that open a cell and are not closed: all lines down to the next quotation mark, or to the end of the
//! file, would be read as the text of one cell.

use super::foreign::{Separator, is_row};
use super::text::{location, reader};
use crate::IoError;

/// Number of lines in one cell that may look like rows of the table.
const MAX_ROWS_IN_CELL: usize = 1;

/// Checks that no cell of a record contains rows of the table; the record has the bytes from `start` to `end`.
///
/// # Errors
/// [`IoError::OpenQuote`] if a quotation mark is not closed before the end of the text, or closed only after rows.
pub(super) fn check_quotes(
    bytes: &[u8],
    (start, end): (usize, usize),
    record: &csv::ByteRecord,
    separator: u8,
    file: &str,
) -> Result<(), IoError> {
    let is_end = |byte: &u8| matches!(byte, b'\n' | b'\r');
    let is_last = end >= bytes.len();
    if !is_last && !record.as_slice().iter().any(is_end) {
        return Ok(());
    }
    let text = bytes.get(start..end).unwrap_or_default();
    let mark = Separator::Char(char::from(separator));
    let is_row_inside = |line: &[u8]| {
        let line = String::from_utf8_lossy(line);
        let cells = mark.cells(&line);
        cells.len() == record.len() && is_row(&cells)
    };
    let rows = |cell: &[u8]| cell.split(is_end).skip(1).filter(|line| is_row_inside(line)).count();
    let closes_late = record.iter().position(|cell| rows(cell) > MAX_ROWS_IN_CELL);
    let is_open = is_last && text.contains(&b'"') && is_open(text, record, separator);
    let Some(cell) = closes_late.or_else(|| is_open.then(|| record.len().saturating_sub(1))) else {
        return Ok(());
    };
    // Cells before this one may have line ends, too.
    let ends = |cell: &[u8]| cell.iter().filter(|byte| **byte == b'\n').count();
    let lines = text.split_inclusive(|byte| *byte == b'\n').map(<[u8]>::len);
    let before: usize = lines.take(record.iter().take(cell).map(ends).sum()).sum();
    let closing = text.trim_ascii_end().len();
    Err(IoError::OpenQuote {
        file: file.to_owned(),
        location: location(bytes, start.saturating_add(before)),
        end: match is_open {
            true => String::from("is never closed"),
            false => format!("is closed only in {}", location(bytes, start.saturating_add(closing))),
        },
    })
}

/// True if a line after the text of a record would belong to the record.
fn is_open(text: &[u8], record: &csv::ByteRecord, separator: u8) -> bool {
    let longer = [text, b"\nx\n"].concat();
    let mut first = csv::ByteRecord::new();
    let is_read = reader(&longer, separator).read_byte_record(&mut first);
    !matches!(is_read, Ok(true)) || first != *record
}

#[cfg(test)]
mod tests {
    use super::super::columns;
    use super::super::table::parse;

    fn text(line_7: &str, line_20: &str) -> String {
        let mut text = String::from("t,e,u,note\n");
        for line in 2..40 {
            let note = match line {
                7 => line_7,
                20 => line_20,
                _ => "x",
            };
            text.push_str(&format!("{}.5,1,2,{note}\n", line - 2));
        }
        text
    }

    #[test]
    fn open_quotation_marks_are_errors() {
        let never = "run.csv, line 7: a quotation mark opens a cell in this line and is never closed";
        let late = "run.csv, line 7: a quotation mark opens a cell in this line and is closed only in line 20";
        for (text, expected) in [
            (text("\"open", "x"), never),
            (text("\"open, \"\"so\"\"", "x"), never),
            (text("\"open", "\"open"), late),
            (text("\"open", "stop\""), late),
            (
                text("\"two\nlines\"", "x").replace("\n37.5,1,2,x\n", "\n37.5,1,2,\"x\n"),
                &never.replace('7', "40"),
            ),
            (text("\"open", "x").replace('\n', "\r\n"), never),
            (text("x", "x").replace("\n5.5,1,2,", "\n\"5.5,1,2,"), never),
            (
                text("\"two\nlines\",\"open", "x")
                    .replace("note", "note,m")
                    .replace(",x\n", ",x,\n"),
                &never.replace('7', "8"),
            ),
            (text("x", "x").replace("note", "\"note"), &never.replace('7', "1")),
        ] {
            for found in [
                parse(text.as_bytes(), "run.csv").map(drop).unwrap_err(),
                columns::read(text.as_bytes(), "run.csv").map(drop).unwrap_err(),
            ] {
                assert!(found.to_string().starts_with(expected), "{found}\n{text}");
            }
        }
    }

    #[test]
    fn closed_quotation_marks_are_read() {
        for note in [
            "\"two\nlines\"",
            "\"a row\n1,2,3,4\"",
            "\"\"",
            "5\" stick",
            "\"a \"\"b\"\"\"",
            "\"\n\n\n\"",
        ] {
            for text in [
                text(note, "x"),
                text(note, note),
                text(note, "x").replace(",x\n", ",\"x\"\n"),
            ] {
                for text in [&text, text.trim_end()] {
                    let table = parse(text.as_bytes(), "run.csv").unwrap();
                    let last = table.columns[0].values.last().copied();
                    assert_eq!((table.rows, last), (38, Some(37.5)), "{text}");
                }
            }
        }
    }
}
