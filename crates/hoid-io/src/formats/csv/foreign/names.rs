//! Assignment of the words of a header to the cells below it.

use super::lines::{Separator, is_number, unquoted};

/// Names of the columns of a table, and the cells of a line that have no name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ColumnNames<'a> {
    pub(super) names: Vec<&'a str>,
    pub(super) extra: ExtraCells,
}

/// Difference between the cells of the header and the cells of the rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ExtraCells {
    None,
    /// Each row ends with a separator that the header lacks.
    SeparatorInRows,
    /// The rows start with their numbers, which have no name, as R writes them.
    RowNumbers,
    /// The header ends with a name, which is empty or denotes comments, for which the rows have no cell.
    NameInHeader,
}

/// Signs before a header that is a comment in MATLAB, Fortran, C or a shell; they do not belong to the first name.
const COMMENT_SIGNS: [char; 6] = ['%', '#', '!', '*', '/', ';'];

/// Returns a header without comment signs before its first name. A sign directly before a name, as in `%time`, may
/// belong to it, unless blanks separate the names.
pub(super) fn without_comment_signs(header: &str, mark: Separator) -> &str {
    let inside = header.trim_start().trim_start_matches(COMMENT_SIGNS);
    match mark {
        Separator::Char(_) if !inside.starts_with(' ') => header,
        _ => inside.trim_start_matches(' '),
    }
}

/// Returns the names that `header` gives to the cells of `rows`, which are the first rows and have equally many cells;
/// `None` if the assignment is not certain.
pub(super) fn names_of<'a>(header: &'a str, mark: Separator, rows: &[Vec<&str>]) -> Option<ColumnNames<'a>> {
    let header = without_comment_signs(header, mark);
    let count = rows.first()?.len();
    let words = mark.cells(header);
    let named = |names: Vec<&'a str>, extra: ExtraCells| {
        let is_name = |name: &&str| !is_number(name);
        let any = names.iter().any(|name| !unquoted(name).is_empty());
        (any && names.iter().all(is_name)).then_some(ColumnNames { names, extra })
    };
    if words.len() == count {
        return named(words, ExtraCells::None);
    }
    if mark == Separator::Blanks
        && let Some(names) = split_into_names(header, count)
    {
        return named(names, ExtraCells::None);
    }
    if words.len().saturating_add(1) == count {
        let ends_empty = |row: &Vec<&str>| row.last().is_some_and(|cell| cell.trim().is_empty());
        if mark != Separator::Blanks && rows.iter().all(ends_empty) {
            return named(words, ExtraCells::SeparatorInRows);
        }
        return is_row_number_column(rows)
            .then(|| named(words, ExtraCells::RowNumbers))
            .flatten();
    }
    let (last, names) = words.split_last()?;
    let is_idle = matches!(unquoted(last).to_lowercase().as_str(), "" | "comment" | "comments");
    (mark != Separator::Blanks && names.len() == count && is_idle)
        .then(|| named(names.to_vec(), ExtraCells::NameInHeader))
        .flatten()
}

/// True if the first cells of the rows are consecutive whole numbers from 0 or 1.
fn is_row_number_column(rows: &[Vec<&str>]) -> bool {
    let numbers = rows.iter().map(|row| unquoted(row.first()?).parse::<usize>().ok());
    let from = |first: usize| numbers.clone().eq((first..).map(Some).take(rows.len()));
    rows.len() > 1 && (from(0) || from(1))
}

/// Divides a header whose names may consist of several words, separated by blanks, into `count` names: at tabs or gaps
/// of several blanks, or after brackets, as in `Time (s) Roll error (deg)`; `None` if this gives another number of
/// names.
fn split_into_names(header: &str, count: usize) -> Option<Vec<&str>> {
    if header.contains('"') {
        return None;
    }
    let by_gaps = header.split('\t').flat_map(|part| part.split("  "));
    let by_gaps: Vec<&str> = by_gaps.map(str::trim).filter(|part| !part.is_empty()).collect();
    let mut depth = 0_usize;
    let behind_bracket = |character: char| {
        match character {
            '(' | '[' => depth = depth.saturating_add(1),
            ')' | ']' => {
                depth = depth.saturating_sub(1);
                return depth == 0;
            }
            _ => {}
        }
        false
    };
    let by_brackets = header.split_inclusive(behind_bracket).map(str::trim);
    let by_brackets: Vec<&str> = by_brackets.filter(|part| !part.is_empty()).collect();
    let is_closed = |name: &&str| name.ends_with([')', ']']) && !name.starts_with(['(', '[']);
    // Without any bracket all words would be one name.
    let brackets = by_brackets.first().is_some_and(is_closed) && !by_brackets.iter().any(|n| n.starts_with(['(', '[']));
    [(by_gaps, true), (by_brackets, brackets)]
        .into_iter()
        .find(|(names, possible)| *possible && names.len() == count)
        .map(|(names, _)| names)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names_and_extra(header: &str, mark: Separator, rows: &[&str]) -> Option<(Vec<String>, ExtraCells)> {
        let rows: Vec<Vec<&str>> = rows.iter().map(|row| mark.cells(row)).collect();
        let names = names_of(header, mark, &rows)?;
        Some((names.names.iter().map(|name| (*name).to_owned()).collect(), names.extra))
    }

    #[test]
    fn blank_separated_headers_are_split() {
        let rows = ["0.0 1 2", "0.1 3 4"];
        for (header, names) in [
            ("t e u", ["t", "e", "u"]),
            ("# t e u", ["t", "e", "u"]),
            ("%t e u", ["t", "e", "u"]),
            ("\"t\" \"roll e\" u", ["\"t\"", "\"roll e\"", "u"]),
            (
                "Time (s) Roll error (deg) Stick (-)",
                ["Time (s)", "Roll error (deg)", "Stick (-)"],
            ),
            (
                "Time [s] Error [left hand] Stick cmd",
                ["Time [s]", "Error [left hand]", "Stick cmd"],
            ),
            ("Time   Roll error\tStick  ", ["Time", "Roll error", "Stick"]),
        ] {
            let names = names.map(str::to_owned).to_vec();
            assert_eq!(
                names_and_extra(header, Separator::Blanks, &rows),
                Some((names, ExtraCells::None)),
                "{header}"
            );
        }
        for header in [
            "",
            "t",
            "t e",
            "Time s Roll error Stick",
            "t e u x y",
            "t 1 2",
            "(s) (deg) (V) x",
            "t (s) e u x",
            "\"t e",
        ] {
            assert_eq!(names_and_extra(header, Separator::Blanks, &rows), None, "{header}");
        }
    }

    #[test]
    fn extra_cells_are_matched_to_the_header() {
        let comma = Separator::Char(',');
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let rows = ["0,5,", "1,6,"];
        assert_eq!(
            names_and_extra("t,e", comma, &rows),
            Some((names(&["t", "e"]), ExtraCells::SeparatorInRows))
        );
        for rows in [
            ["0,5.1,7", "1,5.2,7"],
            ["1,5.1,7", "2,5.2,7"],
            ["\"1\",5.1,7", "\"2\",5.2,7"],
        ] {
            assert_eq!(
                names_and_extra("t,e", comma, &rows),
                Some((names(&["t", "e"]), ExtraCells::RowNumbers))
            );
        }
        for rows in [["0,5,7", "0.1,6,7"], ["3,5,7", "4,6,7"], ["0,5,", "0.1,6,7"]] {
            assert_eq!(names_and_extra("t,e", comma, &rows), None, "{rows:?}");
        }
        for header in ["t,e,", "t,e,Comment"] {
            assert_eq!(
                names_and_extra(header, comma, &["0,5", "1,6"]),
                Some((names(&["t", "e"]), ExtraCells::NameInHeader))
            );
        }
        assert_eq!(names_and_extra("t,e,u", comma, &["0,5", "1,6"]), None);
        assert_eq!(
            names_and_extra("%time,e", comma, &["0,5", "1,6"]),
            Some((names(&["%time", "e"]), ExtraCells::None))
        );
        assert_eq!(
            names_and_extra("% t,e", comma, &["0,5", "1,6"]),
            Some((names(&["t", "e"]), ExtraCells::None))
        );
        assert_eq!(names_and_extra("t,e", comma, &[]), None);
        assert_eq!(names_and_extra(",", comma, &["0,5"]), None);
    }
}
