//! Positions of the header and the first row of a table, and the separator of its cells.
//!
//! The first rows are the first [`MIN_ROWS`] lines with equal numbers of cells, more than half of which are numbers or
//! clock times. The header is the line of words above them, or a comment directly above them; a line further up with
//! equally many words takes precedence if it has the requested columns, or else names of the error and the control, or
//! of a time. The header must name the cells unambiguously ([`super::names`]).

use std::borrow::Cow;

use super::lines::{
    Separator, is_missing, is_number, is_row, is_value, joined_lines, non_blank_lines, split_line_end, unquoted,
};
use super::names::{ColumnNames, ExtraCells, names_of, without_comment_signs};
use super::units;
use crate::formats::csv::text::is_comment_or_blank;
use crate::record::ReadOptions;
use crate::table::{ColumnExpression, find_control_column, find_error_column};
use crate::time::is_time;
use crate::wording::abbreviate;

/// Number of lines with equally many numbers that are required at the start of a table, unless it has fewer lines.
const MIN_ROWS: usize = 3;

/// Comments that hoid itself writes above a table, and that are not headers.
const OWN_COMMENTS: [&str; 3] = ["units:", "roles:", "sample_time:"];

/// Structure of the start of a table. Lines are counted from 0.
#[derive(Debug, Clone)]
pub(super) struct Layout<'a> {
    pub(super) separator: Separator,
    pub(super) names: ColumnNames<'a>,
    /// Line of the header, which may be a comment.
    header: usize,
    is_comment: bool,
    /// Line of the units, and the comment that states them.
    units: Option<(usize, String)>,
    /// Line of the first row.
    row: usize,
    /// Lines above the header that are neither blank nor comments.
    lines_above: Vec<usize>,
}

/// A header that does not name the cells below it with certainty.
#[derive(Debug, PartialEq, Eq)]
pub(in crate::formats::csv) struct Mismatch {
    /// Line of the header, counted from 1.
    pub(in crate::formats::csv) line: usize,
    /// Number of words of the header; 0 if the first line holds numbers.
    pub(in crate::formats::csv) header_words: usize,
    pub(in crate::formats::csv) cells: usize,
    /// Text of the first row, shortened.
    pub(in crate::formats::csv) first_row: String,
}

/// Returns the position in `filled` of the first row and the cells of the first rows, from position `from` on.
fn first_rows<'a>(filled: &[(usize, &'a str)], from: usize, mark: Separator) -> Option<(usize, Vec<Vec<&'a str>>)> {
    (from..filled.len()).find_map(|at| {
        let lines = filled.iter().skip(at).take(MIN_ROWS);
        let rows: Vec<Vec<&str>> = lines.map(|(_, line)| mark.cells(line)).collect();
        let count = rows.first()?.len();
        let are_rows = rows.iter().all(|row| row.len() == count && is_row(row));
        are_rows.then_some((at, rows))
    })
}

/// Returns the names in a header whose separator differs from the separator of the rows.
fn names_with_other_separator<'a>(header: &'a str, rows: &[Vec<&str>]) -> Option<ColumnNames<'a>> {
    let marks = Separator::ALL.iter().filter(|mark| **mark != Separator::Blanks);
    let mut names = marks.filter_map(|mark| names_of(header, *mark, rows));
    names.find(|names| names.extra == ExtraCells::None)
}

impl<'a> Layout<'a> {
    /// Finds the structure of the text; `None` if no header is certain.
    pub(super) fn of(text: &'a str, options: &ReadOptions) -> Option<Self> {
        let filled = non_blank_lines(text);
        let found = Separator::ALL
            .iter()
            .filter_map(|mark| Self::with_separator(text, &filled, *mark, options));
        // The layout whose table starts first is used. If several separators find the same first row, one that gives
        // only numeric cells is preferred.
        found
            .min_by_key(|(layout, are_values)| (layout.row, !*are_values))
            .map(|(layout, _)| layout)
    }

    /// Finds the structure for a given separator; the second value is true if the first rows contain only values.
    fn with_separator(
        text: &'a str,
        filled: &[(usize, &'a str)],
        mark: Separator,
        options: &ReadOptions,
    ) -> Option<(Self, bool)> {
        let mut from = 0;
        while let Some((at, rows)) = first_rows(filled, from, mark) {
            let row = filled.get(at)?.0;
            let values = |cell: &&str| is_value(cell) || is_missing(cell);
            let are_values = rows.iter().flatten().all(values);
            let (before, _) = filled.split_at_checked(at)?;
            let found = Self::with_header_before(before, mark, &rows, row, options)
                .or_else(|| Self::with_commented_header(text, before, mark, &rows, row));
            // A line of numbers above the header is a sample, which must not be omitted.
            let is_sample = |(at, line): &(usize, &str)| {
                let cells = mark.cells(line);
                found.as_ref().is_some_and(|layout| layout.lines_above.contains(at))
                    && cells.len() > 1
                    && cells.iter().all(|cell| is_value(cell))
            };
            if before.iter().any(is_sample) {
                return None;
            }
            if let Some(layout) = found {
                return Some((layout, are_values));
            }
            from = at.saturating_add(1);
        }
        None
    }

    /// Returns the structure with a header among the lines `before` the first row.
    fn with_header_before(
        before: &[(usize, &'a str)],
        mark: Separator,
        rows: &[Vec<&str>],
        row: usize,
        options: &ReadOptions,
    ) -> Option<Self> {
        let ((at, line), lines_above) = before.split_last()?;
        let of_units = || -> Option<Self> {
            let ((header, names_line), lines_above) = lines_above.split_last()?;
            let names = names_of(names_line, mark, rows)?;
            let mut cells = mark.cells(without_comment_signs(line, mark));
            if names.extra == ExtraCells::NameInHeader {
                cells.truncate(names.names.len());
            }
            let comment = units::units_comment(&names.names, &cells)?;
            Some(Self {
                separator: mark,
                names,
                header: *header,
                is_comment: false,
                units: Some((*at, comment)),
                row,
                lines_above: lines_above.iter().map(|(at, _)| *at).collect(),
            })
        };
        if let Some(layout) = of_units() {
            return Some(layout);
        }
        let names = names_of(line, mark, rows).or_else(|| names_with_other_separator(line, rows))?;
        let named = Self {
            separator: mark,
            header: *at,
            is_comment: false,
            units: None,
            row,
            lines_above: lines_above.iter().map(|(at, _)| *at).collect(),
            names,
        };
        let filled = |names: &[&str]| names.iter().filter(|name| !unquoted(name).is_empty()).count();
        let rank = |names: &[&str]| {
            let names: Vec<&str> = names.iter().map(|name| unquoted(name)).collect();
            let is_among = |signal: &ColumnExpression| signal.is_among(&names);
            let has_signals = options.input.iter().chain([&options.output]).all(is_among);
            let has_common_names = find_error_column(&names).and(find_control_column(&names)).is_some();
            (has_signals, has_common_names, names.iter().any(|name| is_time(name)))
        };
        // A line further up may be the header; the line found then contains its units, or is damaged.
        let rival = |number: usize| {
            let (at, line) = lines_above.get(number)?;
            let names = names_of(line, mark, rows)?;
            let same = names.extra == named.names.extra && filled(&names.names) >= filled(&named.names.names);
            let is_better = rank(&names.names) > rank(&named.names.names);
            let is_header = mark != Separator::Blanks && !names.names.iter().any(|name| is_value(name));
            (is_header && same && is_better).then(|| Self {
                header: *at,
                names,
                lines_above: lines_above.iter().take(number).map(|(at, _)| *at).collect(),
                ..named.clone()
            })
        };
        let rival = (0..lines_above.len()).rev().find_map(rival);
        Some(rival.unwrap_or(named))
    }

    /// Returns the structure with a header in the comment directly above the first row, as NumPy writes it.
    fn with_commented_header(
        text: &'a str,
        before: &[(usize, &'a str)],
        mark: Separator,
        rows: &[Vec<&str>],
        row: usize,
    ) -> Option<Self> {
        let lines = text.lines().enumerate().take(row);
        let (header, line) = lines.filter(|(_, line)| !line.trim().is_empty()).last()?;
        let words = line.strip_prefix('#')?.trim_start_matches('#').trim();
        if OWN_COMMENTS.iter().any(|own| words.starts_with(own)) {
            return None;
        }
        let own = names_of(words, mark, rows).or_else(|| names_with_other_separator(words, rows));
        let names = own.or_else(|| names_of(words, Separator::Blanks, rows))?;
        Some(Self {
            separator: mark,
            names,
            header,
            is_comment: true,
            units: None,
            row,
            lines_above: before.iter().map(|(at, _)| *at).collect(),
        })
    }

    /// Returns the text as plain CSV with a header in one line above the rows, and notes about what was changed; `None`
    /// if the text is already plain.
    pub(super) fn to_plain_csv(&self, text: &str) -> Option<(String, Vec<String>)> {
        let mut notes = Vec::new();
        if self.units.is_some() {
            notes.push(String::from("the line below the header is taken as the units"));
        }
        if self.separator == Separator::Blanks {
            notes.push(String::from("the columns are separated by blanks"));
        }
        if !self.lines_above.is_empty() {
            notes.push(format!(
                "lines above the header are left out: {}",
                self.lines_above.len()
            ));
        }
        if self.is_comment {
            notes.push(String::from("the comment above the first row is taken as the header"));
        }
        if self.names.extra == ExtraCells::RowNumbers {
            notes.push(String::from("the rows start with row numbers, which are left out"));
        }
        let header = self.header();
        let found = joined_lines(text).find(|(at, _)| *at == self.header);
        let found = found.map(|(_, line)| line.trim_end());
        let as_found = found == Some(header.trim_end());
        let repeated = self.repeated_header_note(text, found.unwrap_or_default());
        notes.extend(repeated);
        // Blank lines of separators above the header would be read as a header without names.
        let is_blank = |line: &str| !line.is_empty() && line.trim().is_empty();
        let padding = format!("{} \"", self.separator());
        let mut start = text.lines().take(self.row.saturating_add(MIN_ROWS));
        let is_odd = |line: &str| is_blank(line) || line.contains(&padding);
        if notes.is_empty() && self.names.extra == ExtraCells::None && as_found && !start.any(is_odd) {
            return None;
        }
        let commented = |line: &str| format!("#{}", line.replace('\n', "\n#"));
        let line = |(at, line): (usize, &str)| -> String {
            let (line, end) = split_line_end(line);
            let is_repeated = |line: &str| !self.is_comment && Some(line.trim_end()) == found;
            let line: Cow<'_, str> = match &self.units {
                Some((with_header_before, comment)) if at == self.header && at < *with_header_before => {
                    Cow::Owned(format!("# {comment}"))
                }
                Some((with_header_before, _)) if at == *with_header_before => Cow::Borrowed(&*header),
                None if at == self.header => Cow::Borrowed(&*header),
                _ if self.lines_above.contains(&at) => Cow::Owned(commented(line)),
                _ if at < self.row && is_blank(line) => Cow::Borrowed(""),
                _ if at < self.row || is_comment_or_blank(line) => Cow::Borrowed(line),
                _ if is_repeated(line) => Cow::Owned(commented(line)),
                _ => self.row_of(line),
            };
            line.into_owned() + end
        };
        Some((joined_lines(text).map(line).collect(), notes))
    }

    /// Returns a note if the header is repeated between the rows, as in recordings that were appended to each other.
    fn repeated_header_note(&self, text: &str, header: &str) -> Option<String> {
        if self.is_comment || header.is_empty() {
            return None;
        }
        let lines = text.match_indices(header).skip(1);
        let is_line = |(at, found): &(usize, &str)| {
            let before = text.get(..*at).is_some_and(|before| before.ends_with('\n'));
            let rest = text.get(at.saturating_add(found.len())..).unwrap_or_default();
            before && (rest.trim_start_matches([' ', '\t', '\r']).starts_with('\n') || rest.trim().is_empty())
        };
        let count = lines.filter(is_line).count();
        (count > 0).then(|| format!("repeated lines of the header are left out: {count}"))
    }

    /// Returns the separator in the rewritten text.
    fn separator(&self) -> char {
        match self.separator {
            Separator::Char(mark) => mark,
            Separator::Blanks => '\t',
        }
    }

    /// Returns the header of the rewritten text.
    fn header(&self) -> String {
        let separator = self.separator();
        // Some programs put names into single quotation marks.
        let inside = |name: &&str| Some(name.trim().strip_prefix('\'')?.strip_suffix('\'')?.to_owned());
        let single: Option<Vec<String>> = self.names.names.iter().map(inside).collect();
        let name = |name: &str| match name.contains(separator) && !name.contains('"') {
            true => format!("\"{name}\""),
            false => self.without_padding(name),
        };
        let names: Vec<String> = match single {
            Some(names) => names.iter().map(|inside| name(inside)).collect(),
            None => self.names.names.iter().map(|found| name(found)).collect(),
        };
        let names = names.join(&separator.to_string());
        match self.names.extra {
            ExtraCells::RowNumbers => format!("{separator}{names}"),
            _ => names,
        }
    }

    /// Returns a row of the rewritten text.
    fn row_of<'b>(&self, line: &'b str) -> Cow<'b, str> {
        let line = match self.separator {
            Separator::Blanks => return Cow::Owned(self.separator.cells(line).join("\t")),
            Separator::Char(_) => line,
        };
        let line = match self.names.extra {
            ExtraCells::SeparatorInRows => line.strip_suffix(self.separator()).unwrap_or(line),
            _ => line,
        };
        let padding = format!("{} \"", self.separator());
        match line.contains(&padding) {
            true => {
                let cells = self
                    .separator
                    .cells(line)
                    .into_iter()
                    .map(|cell| self.without_padding(cell));
                Cow::Owned(cells.collect::<Vec<_>>().join(&self.separator().to_string()))
            }
            false => Cow::Borrowed(line),
        }
    }

    /// Returns a cell without blanks before its quotation mark; otherwise the mark would be part of the text.
    fn without_padding(&self, cell: &str) -> String {
        let inside = cell.trim();
        if inside.starts_with('"') { inside } else { cell }.to_owned()
    }
}

/// Returns the header and the cells of a table whose names are not certain; `None` for other text. If the separator is
/// certain and the header is the first line, each row is compared with the header later.
pub(in crate::formats::csv) fn mismatch(text: &str) -> Option<Mismatch> {
    let filled = non_blank_lines(text);
    let found = Separator::ALL.iter().filter_map(|mark| {
        let (at, rows) = first_rows(&filled, 0, *mark)?;
        let are_values = rows.iter().flatten().all(|cell| is_value(cell) || is_missing(cell));
        Some((*mark, at, rows, are_values))
    });
    let (mark, at, rows, are_values) = found.min_by_key(|(_, at, _, are_values)| (*at, !*are_values))?;
    let (row, _) = filled.get(at)?;
    let numbers: Vec<&str> = rows.first()?.iter().map(|cell| unquoted(cell)).collect();
    let header = at.checked_sub(1).and_then(|lines_above| filled.get(lines_above));
    let (line, header) = header.copied().unwrap_or((*row, ""));
    let words = mark.cells(header);
    let words = if header.is_empty() { 0 } else { words.len() };
    let cells = rows.first().map_or(0, Vec::len);
    let is_named = at > 0 && mark.cells(header).iter().any(|word| is_number(word));
    let is_uncertain = match (at, mark) {
        (0, _) => are_values,
        (_, Separator::Blanks) => words != cells && !header.contains([',', ';', '\t']),
        (1, _) => false,
        _ => words != cells,
    };
    (is_uncertain && !is_named).then(|| Mismatch {
        line: line.saturating_add(1),
        header_words: words,
        cells,
        first_row: abbreviate(&numbers.join(", ")),
    })
}
