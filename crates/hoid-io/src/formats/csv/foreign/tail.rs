//! Lines of words below a table, such as `End of recording` or `Mean,0.1,0.2`.

use super::super::text::{is_comment_or_blank, unterminated_line};
use super::lines::{Separator, is_missing, is_open, is_value, unquoted};
use crate::wording::abbreviate;

/// Largest number of lines of words below a table.
const MAX_LINES_BELOW: usize = 60;
/// Number of rows above the words with which their first cells are compared.
const COMPARED_ROWS: usize = 3;

/// Returns the position at which words below a table start, and a note; `None` if the table ends with a row.
///
/// A line belongs to the words if its first cell is text while the first cells of the rows above are numbers or clock
/// times. A last line without a line end may be truncated, and is not omitted.
pub(super) fn text_below(text: &str, mark: Separator) -> Option<(usize, String)> {
    let mut end = text.len();
    let mut found: Vec<&str> = Vec::new();
    let starts_with_value = |line: &str| mark.cells(line).first().is_some_and(|cell| is_value(cell));
    let starts_with_text = |line: &str| {
        let cells = mark.cells(line);
        let first = cells.first().copied().unwrap_or_default();
        !is_value(first) && !is_missing(first) && unquoted(first).chars().any(char::is_alphabetic)
    };
    let mut lines = text.split_inclusive('\n').rev().peekable();
    while let Some(line) = lines.next_if(|line| is_comment_or_blank(line) || starts_with_text(line)) {
        end = end.saturating_sub(line.len());
        if !is_comment_or_blank(line) {
            found.push(line);
        }
        if found.len() > MAX_LINES_BELOW {
            return None;
        }
    }
    let rows: Vec<&str> = lines
        .filter(|line| !is_comment_or_blank(line))
        .take(COMPARED_ROWS)
        .collect();
    let first = found.last()?;
    let is_cut = unterminated_line(text).is_some() && found.len() == 1 && mark.cells(first).len() > 1;
    // The text of a cell of the last row.
    let is_cell = rows.first().is_some_and(|row| is_open(row));
    (rows.len() == COMPARED_ROWS && rows.iter().all(|row| starts_with_value(row)) && !is_cut && !is_cell).then(|| {
        let note = format!(
            "lines of text below the table are left out: {}; the first is \"{}\"",
            found.len(),
            abbreviate(first)
        );
        (end, note)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_below_a_table_are_found() {
        let rows = "t,e\n0,1\n1,2\n2,3\n";
        for words in [
            "Mean,2\n",
            "End of recording\n",
            "\n\nMean,2\nMax,3\n\n",
            "End",
            "# aside\nMean,2\n",
        ] {
            let text = format!("{rows}{words}");
            let (at, note) = text_below(&text, Separator::Char(',')).unwrap();
            assert_eq!(text[..at].trim_end(), rows.trim_end(), "{words:?}");
            let first = words.lines().find(|line| !line.is_empty() && !line.starts_with('#'));
            assert!(note.contains(first.unwrap()), "{note}");
        }
    }

    #[test]
    fn table_rows_are_not_treated_as_words() {
        for text in [
            "",
            "t,e\n",
            "t,e\n0,1\n",
            "t,e\nMean,2\n",
            "t,e\n0,1\n1,2\n2,3\n",
            "t,e\n0,1\n1,2\n2,3\n,4\n",
            "t,e\n0,1\n1,2\n2,3\n-,4\n",
            "t,e\n0,1\n1,2\n2,3\nNaN,4\n",
            "word,e\na,1\nb,2\nc,3\nd,4\n",
            "t,e\n0,1\n1,2\n2,3\nx,4",
            "t,note\n0,1\n1,2\n2,3\n3,\"two\nlines\"\n",
        ] {
            assert_eq!(text_below(text, Separator::Char(',')), None, "{text:?}");
        }
        let many = format!("t,e\n0,1\n1,2\n2,3\n{}", "word\n".repeat(MAX_LINES_BELOW + 1));
        assert_eq!(text_below(&many, Separator::Char(',')), None);
    }
}
