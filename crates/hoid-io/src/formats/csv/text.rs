//! The text of a CSV file: its encoding, comments, separator, lines and cells.

use std::borrow::Cow;

use crate::IoError;
use crate::table::{Cell, has_decimal_comma};

pub(crate) fn text<'a>(bytes: &'a [u8], file: &str) -> Result<&'a str, IoError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let not_text = |at: usize, found: String| IoError::NotText {
        file: file.to_owned(),
        location: location(bytes, at),
        found,
    };
    if let Some(at) = bytes.iter().position(|b| *b == 0) {
        return Err(not_text(at, String::from("a zero byte")));
    }
    std::str::from_utf8(bytes).map_err(|error| {
        let at = error.valid_up_to();
        not_text(at, format!("the byte 0x{:02X}", bytes.get(at).copied().unwrap_or(0)))
    })
}

/// First characters at which a spreadsheet executes a cell.
const FORMULA_STARTS: [char; 6] = ['=', '+', '-', '@', '\t', '\r'];

/// True if a spreadsheet may execute a cell; numbers and single signs are not executed.
fn is_formula(cell: &str) -> bool {
    cell.starts_with(FORMULA_STARTS) && !["-", "+"].contains(&cell) && !matches!(Cell::parse(cell), Cell::Number(_))
}

/// Returns a cell as it is written to the file: a cell that a spreadsheet would execute is preceded by an apostrophe,
/// which marks it as text and which [`unescape_formula`] removes.
pub(crate) fn escape_formula(cell: &str) -> Cow<'_, str> {
    if is_formula(cell.trim_start_matches('\'')) {
        Cow::Owned(format!("'{cell}"))
    } else {
        Cow::Borrowed(cell)
    }
}

/// Restores the original text from the result of [`escape_formula`].
pub(crate) fn unescape_formula(cell: &str) -> &str {
    match cell.strip_prefix('\'') {
        Some(meant) if is_formula(meant.trim_start_matches('\'')) => meant,
        _ => cell,
    }
}

/// Returns the position of the last line if this line has no line end, otherwise `None`.
pub(crate) fn unterminated_line(text: &str) -> Option<usize> {
    let ends = ['\n', '\r'];
    (!text.ends_with(ends)).then(|| text.trim_end_matches(|c| !ends.contains(&c)).len())
}

pub(crate) fn reader(bytes: &[u8], separator: u8) -> csv::Reader<&[u8]> {
    csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .delimiter(separator)
        .from_reader(bytes)
}

pub(crate) fn is_comment_or_blank(line: &str) -> bool {
    line.trim().is_empty() || line.starts_with('#')
}

/// True if the text can be a unit: a short word that is neither an index nor a number.
pub(super) fn is_unit(text: &str) -> bool {
    (1..=12).contains(&text.chars().count())
        && !text.contains(' ')
        && !text.starts_with(|c: char| c.is_ascii_digit() || c == ':')
}

/// Returns a name, which may contain line ends, as one line.
pub(super) fn single_line(name: &str) -> Cow<'_, str> {
    let words = || {
        name.split(['\n', '\r'])
            .map(str::trim)
            .filter(|words| !words.is_empty())
    };
    match name.contains(['\n', '\r']) {
        true => Cow::Owned(words().collect::<Vec<_>>().join(" ")),
        false => Cow::Borrowed(name),
    }
}

/// Returns the most frequent separator in the header; separators that are equally frequent in the `row` below take
/// precedence, because names such as `e, deg` may contain commas. Returns the comma if the header contains no
/// separator.
pub(crate) fn separator(header: &str, row: Option<&str>) -> u8 {
    let count = |line: &str, separator: u8| {
        let mut quoted = false;
        let is_separator = |byte: &u8| {
            quoted ^= *byte == b'"';
            !quoted && *byte == separator
        };
        line.bytes().filter(is_separator).count()
    };
    let suits = |separator: u8| {
        let found = count(header, separator);
        let in_row = row.is_some_and(|row| count(row, separator) == found);
        (found > 0 && in_row, found)
    };
    // If several separators are equally frequent, the comma precedes the semicolon, and the semicolon the tab.
    let all = [b'\t', b';', b','].into_iter();
    all.max_by_key(|separator| suits(*separator)).unwrap_or(b',')
}

/// True if the numbers of a table have decimal commas: some cell is a number with a comma, and no number has a point
/// (otherwise the comma may separate thousands).
///
/// If commas separate cells, numbers with commas are quoted, `"0,02"`. A comma before three digits may then separate
/// thousands, as in spreadsheets; at least one comma must therefore be followed by a different number of digits.
pub(crate) fn has_decimal_commas(text: &str, separator: u8) -> bool {
    let quoted = separator == b',';
    if quoted
        && !text
            .lines()
            .filter(|line| !is_comment_or_blank(line))
            .nth(1)
            .is_some_and(|row| row.contains('"'))
    {
        return false;
    }
    let mut reader = reader(text.as_bytes(), separator);
    let mut record = csv::ByteRecord::new();
    let mut found = false;
    while matches!(reader.read_byte_record(&mut record), Ok(true)) {
        for cell in record.iter().filter_map(|cell| std::str::from_utf8(cell).ok()) {
            if cell.contains('.') && matches!(Cell::parse(cell), Cell::Number(_)) {
                return false;
            }
            found |= has_decimal_comma(cell) && !(quoted && may_be_thousands(cell));
        }
    }
    found
}

/// True if three digits follow the last comma.
fn may_be_thousands(cell: &str) -> bool {
    cell.trim()
        .rsplit(',')
        .next()
        .is_some_and(|digits| digits.len() == 3 && digits.bytes().all(|b| b.is_ascii_digit()))
}

/// Returns the comment lines above the header without the leading `#`.
pub(crate) fn comments(text: &str) -> impl Iterator<Item = &str> {
    let lines = text.lines().take_while(|line| is_comment_or_blank(line));
    lines.filter_map(|line| line.strip_prefix('#'))
}

/// Returns the position of the first row at or after `at`; comments and blank lines are skipped, as by the reader.
pub(crate) fn row_start(bytes: &[u8], at: usize) -> usize {
    let mut rest = bytes.get(at..).unwrap_or_default();
    loop {
        rest = match rest {
            [b'\n' | b'\r', rest @ ..] => rest,
            [b'#', rest @ ..] => {
                let end = rest.iter().position(|b| *b == b'\n');
                end.and_then(|end| rest.get(end..)).unwrap_or_default()
            }
            _ => return bytes.len().saturating_sub(rest.len()),
        }
    }
}

pub(crate) fn location(bytes: &[u8], at: usize) -> String {
    let before = bytes.get(..at).unwrap_or(bytes);
    // A file without line feeds has carriage returns as line ends.
    let end = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    format!("line {}", before.split(|b| *b == end).count())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formula_cells_are_escaped_and_round_trip() {
        for (cell, written) in [
            ("=1+1", "'=1+1"),
            ("+cmd|' /C calc'!A0", "'+cmd|' /C calc'!A0"),
            ("@SUM(A1)", "'@SUM(A1)"),
            ("-2+3", "'-2+3"),
            ("-x", "'-x"),
            ("\t=1", "'\t=1"),
            ("\r=1", "'\r=1"),
            ("'=1", "''=1"),
        ] {
            assert_eq!(escape_formula(cell), written);
            assert_eq!(unescape_formula(&escape_formula(cell)), cell);
        }
        for cell in [
            "", "-", "+", "-1.5e3", "+0.5", "-inf", "a=b", "'", "'a", "''", "x-y", " =1",
        ] {
            assert_eq!(escape_formula(cell), cell);
            assert_eq!(unescape_formula(cell), cell);
        }
    }

    #[test]
    fn unterminated_last_line_is_located() {
        for (text, at) in [
            ("", Some(0)),
            ("a", Some(0)),
            ("a\nb", Some(2)),
            ("a\rb", Some(2)),
            ("a\r\n", None),
            ("a\n", None),
        ] {
            assert_eq!(unterminated_line(text), at, "{text:?}");
        }
    }
}
