//! Tables whose cells are separated by vertical bars, such as `t | e | u`, also with bars at both ends of each line and
//! a rule `|---|---|` below the header, as in Markdown.

use std::borrow::Cow;

use super::super::text::is_comment_or_blank;
use super::lines::{SEARCHED_LINES, is_row};

/// Number of lines with bars that are examined.
const EXAMINED_LINES: usize = 4;

/// Replaces the bars of a table by tabs; the rule below the header becomes a comment. `None` for other text.
pub(super) fn with_tabs(text: &str) -> Option<String> {
    let lines = || {
        text.lines()
            .filter(|line| !is_comment_or_blank(line) && line.contains('|'))
    };
    let first: Vec<&str> = text
        .lines()
        .take(SEARCHED_LINES)
        .filter(|line| line.contains('|') && !is_comment_or_blank(line) && !is_rule(line))
        .take(EXAMINED_LINES)
        .collect();
    let bars = |line: &str| line.matches('|').count();
    let (header, rows) = first.split_first()?;
    let starts = first.iter().all(|line| line.trim_start().starts_with('|'));
    let ends = first.iter().all(|line| line.trim_end().ends_with('|'));
    let inside = |line: &'_ str| -> String {
        let mut inside = line.trim();
        if starts {
            inside = inside.strip_prefix('|').unwrap_or(inside);
        }
        if ends {
            inside = inside.strip_suffix('|').unwrap_or(inside);
        }
        inside.split('|').map(str::trim).collect::<Vec<_>>().join("\t")
    };
    let is_numbers = |row: &str| is_row(&inside(row).split('\t').collect::<Vec<_>>());
    let is_table = !rows.is_empty()
        && rows.iter().all(|row| bars(row) == bars(header))
        && rows.last().is_some_and(|row| is_numbers(row))
        // A tab between bars would separate cells.
        && !lines().any(|line| line.contains('\t'));
    is_table.then(|| {
        let line = |line: &str| -> String {
            let (line, end) = line.strip_suffix('\n').map_or((line, ""), |line| (line, "\n"));
            let line: Cow<'_, str> = match line {
                line if is_comment_or_blank(line) || !line.contains('|') => Cow::Borrowed(line),
                line if is_rule(line) => Cow::Owned(format!("#{}", line.trim_end())),
                line => Cow::Owned(inside(line)),
            };
            line.into_owned() + end
        };
        text.split_inclusive('\n').map(line).collect()
    })
}

/// True if a line consists of dashes, colons and bars, such as `|---|:-:|`.
fn is_rule(line: &str) -> bool {
    line.contains("--")
        && line
            .chars()
            .all(|c| matches!(c, '|' | '-' | ':' | '+') || c.is_whitespace())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_with_bars_are_converted() {
        let found = "t\te, deg\tu\n0\t1\t2\n1\t\t4\n";
        for text in [
            "t|e, deg|u\n0|1|2\n1||4\n",
            " t | e, deg | u |\r\n 0 | 1 | 2 |\r\n 1 |  | 4 |\r\n",
            "|t|e, deg|u|\n|0|1|2|\n|1||4|\n",
        ] {
            assert_eq!(with_tabs(text).as_deref(), Some(found), "{text}");
        }
        let markdown = "Run 3\n\n| t | e |\n|---|:-:|\n| 0 | 1 |\n| 1 | 2 |\n";
        let found = "Run 3\n\nt\te\n#|---|:-:|\n0\t1\n1\t2\n";
        assert_eq!(with_tabs(markdown).as_deref(), Some(found));
        // The last cell may be empty if only the header ends without a bar.
        assert_eq!(with_tabs("t|e|u\n0|1|\n").as_deref(), Some("t\te\tu\n0\t1\t\n"));
    }

    #[test]
    fn other_text_with_bars_is_not_a_table() {
        for text in [
            "",
            "|",
            "a|b\n",
            "a|b\nc|d\n",
            "t,e|f\n0,1\n",
            "t|e\n0|1|2\n",
            "t|e\n0\t5|1\n",
            "|--|\n",
        ] {
            assert_eq!(with_tabs(text), None, "{text:?}");
        }
    }
}
