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
    /// All marks; if several fit a table equally well, the first one is used.
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

/// True if the cells can form a row: more of them are values than other texts.
pub(in crate::formats::csv) fn is_row(cells: &[&str]) -> bool {
    let values = cells.iter().filter(|cell| is_value(cell)).count();
    let missing = cells.iter().filter(|cell| !is_value(cell) && is_missing(cell)).count();
    cells.len() > 1 && values > cells.len().saturating_sub(missing) / 2
}

/// Returns the lines at the start of a text that are neither blank nor comments, with their indices.
pub(super) fn non_blank_lines(text: &str) -> Vec<(usize, &str)> {
    let lines = text.lines().take(SEARCHED_LINES).enumerate();
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
}
