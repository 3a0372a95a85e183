//! Cells of a line before the separator of a table is known.

use super::super::text::is_comment_or_blank;
use crate::table::{Cell, with_decimal_point};
use crate::time::is_clock_time;

/// Number of lines at the start of a file in which the header and the first rows are searched for.
pub(super) const SEARCHED_LINES: usize = 250;

/// Separator of the cells of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::formats::csv) enum Separator {
    Char(char),
    Blanks,
}

impl Separator {
    /// All separators; if several fit a table equally well, the first one is used.
    pub(super) const ALL: [Self; 4] = [Self::Char('\t'), Self::Char(';'), Self::Char(','), Self::Blanks];

    fn is_at(self, character: char) -> bool {
        match self {
            Self::Char(mark) => character == mark,
            Self::Blanks => character.is_whitespace(),
        }
    }

    /// Splits a line into cells; separators within quotation marks do not separate cells.
    pub(in crate::formats::csv) fn cells(self, line: &str) -> Vec<&str> {
        let mut quoted = false;
        let parts = line.split(|character: char| {
            quoted ^= character == '"';
            !quoted && self.is_at(character)
        });
        match self {
            Self::Char(_) => parts.collect(),
            Self::Blanks => parts.filter(|part| !part.is_empty()).collect(),
        }
    }
}

/// Returns a cell without blanks and quotation marks around it.
pub(super) fn unquoted(cell: &str) -> &str {
    cell.trim().trim_matches('"').trim()
}

/// True if a cell is a number with a decimal point or comma.
pub(super) fn is_number(cell: &str) -> bool {
    matches!(Cell::parse(&with_decimal_point(unquoted(cell), true)), Cell::Number(_))
}

/// True if a cell is a number or a clock time.
pub(super) fn is_value(cell: &str) -> bool {
    is_number(cell) || is_clock_time(unquoted(cell))
}

/// True if a cell is empty or a word for a missing value.
pub(super) fn is_missing(cell: &str) -> bool {
    Cell::parse(unquoted(cell)) == Cell::Missing
}

/// True if the cells can form a row: more of them are values than other text.
pub(in crate::formats::csv) fn is_row(cells: &[&str]) -> bool {
    let values = cells.iter().filter(|cell| is_value(cell)).count();
    let missing = cells.iter().filter(|cell| !is_value(cell) && is_missing(cell)).count();
    cells.len() > 1 && values > cells.len().saturating_sub(missing) / 2
}

/// Largest number of lines that one cell with line ends joins.
const MAX_JOINED_LINES: usize = 20;

/// True if the line ends inside a cell in quotation marks, as a cell with a line end does.
pub(super) fn is_open(line: &str) -> bool {
    let mut open = false;
    // The character before, with a blank for a mark that does not close a cell.
    let mut before = ',';
    for character in line.chars() {
        let is_mark = character == '"' && (open || matches!(before, ',' | ';' | '\t' | '"'));
        open ^= is_mark;
        before = if character == '"' && (open || !is_mark) {
            ' '
        } else {
            character
        };
    }
    open
}

/// Returns the lines of the text, each with its line end and the number of its first line in the file. Lines that a
/// cell in quotation marks joins are one line.
pub(in crate::formats::csv) fn joined_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut rest = text;
    let mut number = 0_usize;
    std::iter::from_fn(move || {
        let ends = || {
            rest.split_inclusive('\n').scan(0_usize, |end, line| {
                *end = end.saturating_add(line.len());
                Some(*end)
            })
        };
        let is_joined = |(_, end): &(usize, usize)| rest.get(..*end).is_some_and(|lines| !is_open(lines));
        let first = ends().next()?;
        let is_whole = rest
            .get(..first)
            .is_none_or(|line| is_comment_or_blank(line) || !is_open(line));
        let joined = (1..)
            .zip(ends())
            .take(if is_whole { 0 } else { MAX_JOINED_LINES })
            .find(is_joined);
        let (count, end) = joined.unwrap_or((1, first));
        let (line, after) = rest.split_at_checked(end)?;
        let at = number;
        (rest, number) = (after, number.saturating_add(count));
        Some((at, line))
    })
}

/// Returns a line without its line end, and the line end.
pub(super) fn split_line_end(line: &str) -> (&str, &str) {
    let inside = line
        .strip_suffix('\n')
        .map_or(line, |line| line.strip_suffix('\r').unwrap_or(line));
    line.split_at_checked(inside.len()).unwrap_or((line, ""))
}

/// Returns the lines at the start of the text that are neither blank nor comments, with their indices.
pub(super) fn non_blank_lines(text: &str) -> Vec<(usize, &str)> {
    let lines = joined_lines(text)
        .take(SEARCHED_LINES)
        .map(|(at, line)| (at, split_line_end(line).0));
    lines.filter(|(_, line)| !is_comment_or_blank(line)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_split_into_cells() {
        assert_eq!(Separator::Char(',').cells("a,\"b,c\",,"), ["a", "\"b,c\"", "", ""]);
        assert_eq!(Separator::Blanks.cells("  a \"b c\"\td "), ["a", "\"b c\"", "d"]);
        assert_eq!(Separator::Blanks.cells(""), [""; 0]);
        for row in [
            &["0", "\"1,5\""][..],
            &["10:11:12", "1", "go"],
            &["0", "", "", "1"],
            &["1", "NaN"],
        ] {
            assert!(is_row(row), "{row:?}");
        }
        for other in [&["0"][..], &["Rate", "50"], &["", ""], &["t", "e"], &[]] {
            assert!(!is_row(other), "{other:?}");
        }
    }

    #[test]
    fn cells_with_line_ends_join_lines() {
        let lines = |text: &'static str| joined_lines(text).collect::<Vec<_>>();
        for text in [
            "t,e\n",
            "5\" stick,x\n",
            "a \"b\n",
            "# a,\"b\n",
            "t,\"a \"\"b\"\"\"\n",
            "\n",
            "t,\"e\n",
            "5\"\",x\n",
        ] {
            assert_eq!(lines(text), [(0, text)]);
        }
        let text = "t,\"e\r\n[deg]\"\r\n0,1\n";
        assert_eq!(lines(text), [(0, "t,\"e\r\n[deg]\"\r\n"), (2, "0,1\n")]);
        assert_eq!(lines("t,\"e\n0,1"), [(0, "t,\"e\n"), (1, "0,1")]);
        assert_eq!(lines(""), []);
    }
}
