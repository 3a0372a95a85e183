//! Text tables with three horizontal rules, as in print, limited to the width of the screen.
//!
//! On a narrow screen, cells are wrapped between words, never within a word or between a number and its error. If a
//! table is still too wide, each row becomes a list; a time series becomes a transposed table with as many times as
//! fit.

use std::fmt;

use comfy_table::{CellAlignment, ColumnConstraint, ContentArrangement, LineStyle, Table, TableStyle, Width};

use crate::output;

/// Three horizontal rules, as in print.
const TABLE_STYLE: TableStyle = {
    let rule = LineStyle::none().fill('─').junction('─');
    TableStyle::new()
        .top_border(rule)
        .header_separator(rule)
        .bottom_border(rule)
};
/// Number of blanks on both sides of a cell together.
const PADDING: usize = 2;
/// Number of additional blanks between two columns.
const COLUMN_GAP: usize = 1;
/// A blank at which a line is not wrapped.
const NO_BREAK_SPACE: &str = "\u{a0}";

/// Rows under a header: the first column is left-aligned, the others are right-aligned.
pub struct Rows {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
    /// True if each row belongs to one time of a series.
    is_time_series: bool,
}

impl Rows {
    pub fn with_header(header: &[&str]) -> Self {
        Self {
            header: header.iter().map(|&name| name.to_owned()).collect(),
            rows: Vec::new(),
            is_time_series: false,
        }
    }

    /// Marks the rows as a time series. If space is short, some rows, but not the last, may be omitted.
    pub fn into_time_series(self) -> Self {
        Self {
            is_time_series: true,
            ..self
        }
    }

    pub fn add_row<T: Into<String>>(&mut self, cells: impl IntoIterator<Item = T>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    /// Returns the table for a screen of the given width; the width is unlimited if it is `None`.
    fn for_width(&self, width: Option<usize>) -> String {
        let whole = self.draw(None);
        let Some(width) = width else { return whole };
        if whole.lines().all(|line| line.chars().count() <= width) {
            return whole;
        }
        let least = self.min_widths();
        let blanks = least.len() * PADDING + least.len().saturating_sub(1) * COLUMN_GAP;
        match least.iter().sum::<usize>() + blanks <= width {
            true => self.draw(Some((width, &least))),
            false => self.transposed(width).unwrap_or_else(|| self.as_lists()),
        }
    }

    /// Returns a time series transposed for a narrow screen, with its times as headings; `None` if not even the last
    /// time fits.
    fn transposed(&self, width: usize) -> Option<String> {
        let last = self.rows.len().checked_sub(1).filter(|_| self.is_time_series)?;
        (1..=self.rows.len()).rev().find_map(|count| {
            let picked: Vec<usize> = match count {
                1 => vec![last],
                _ => (0..count).map(|i| last * i / (count - 1)).collect(),
            };
            let cell = |row: &usize, k: usize| self.rows[*row].get(k).cloned().unwrap_or_default();
            let line = |k: usize| -> Vec<String> {
                let values = picked.iter().map(|row| cell(row, k));
                std::iter::once(self.header[k].clone()).chain(values).collect()
            };
            let turned = Self {
                header: line(0),
                rows: (1..self.header.len()).map(line).collect(),
                is_time_series: false,
            };
            let drawn = turned.draw(None);
            drawn.lines().all(|l| l.chars().count() <= width).then_some(drawn)
        })
    }

    fn draw(&self, on: Option<(usize, &[usize])>) -> String {
        let mut table = Table::new();
        table.load_style(TABLE_STYLE);
        table.set_header(&self.header);
        let cell = |text: &String| match on {
            Some(_) => join_error(text),
            None => text.clone(),
        };
        for row in &self.rows {
            table.add_row(row.iter().map(cell));
        }
        if let Some((width, least)) = on {
            table.set_content_arrangement(ContentArrangement::Dynamic);
            table.set_width(u16::try_from(width).unwrap_or(u16::MAX));
            for (column, least) in table.column_iter_mut().zip(least) {
                let least = u16::try_from(least + PADDING).unwrap_or(u16::MAX);
                column.set_constraint(ColumnConstraint::LowerBoundary(Width::Fixed(least)));
            }
        }
        for column in table.column_iter_mut().skip(1) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        table.to_string()
    }

    /// Returns the length of the longest word in each column.
    fn min_widths(&self) -> Vec<usize> {
        let longest = |text: &String| join_error(text).split(' ').map(|word| word.chars().count()).max();
        let of = |k: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(k));
            cells.chain(self.header.get(k)).filter_map(longest).max().unwrap_or(0)
        };
        (0..self.header.len()).map(of).collect()
    }

    /// Returns each row as a list: its first cell, followed by the other cells with their headings.
    fn as_lists(&self) -> String {
        let name = self.header.iter().map(|name| name.chars().count()).max().unwrap_or(0);
        let mut lines = Vec::new();
        for row in &self.rows {
            for (k, (heading, cell)) in self.header.iter().zip(row).enumerate() {
                if k == 0 {
                    lines.push(cell.clone());
                } else if !cell.is_empty() {
                    lines.push(format!("  {heading:name$}  {cell}"));
                }
            }
        }
        lines.join("\n")
    }
}

impl fmt::Display for Rows {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.for_width(output::width()))
    }
}

/// Joins a number and its error into one word, so that they are not separated.
fn join_error(text: &str) -> String {
    text.replace(" ± ", &format!("{NO_BREAK_SPACE}±{NO_BREAK_SPACE}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows() -> Rows {
        let mut rows = Rows::with_header(&["person", "phase margin (deg)", "remark"]);
        rows.add_row(["anna", "13.5 ± 1.9", "at the end of its range"]);
        rows.add_row(["bert", "7 ± 19", ""]);
        rows
    }

    #[test]
    fn narrow_time_table_is_transposed_and_keeps_its_end() {
        let names = [
            "K_e",
            "T_L (s)",
            "K_e_dot (s)",
            "omega_nm (rad/s)",
            "zeta_nm",
            "tau_e (s)",
        ];
        let mut course = Rows::with_header(&[&["t in s"], names.as_slice()].concat()).into_time_series();
        for t in 1..9 {
            let values = names.iter().map(|_| "0.0914 ± 0.0062".to_owned());
            course.add_row(std::iter::once(format!("{t}.00")).chain(values));
        }
        let times = |width| {
            let drawn = course.for_width(Some(width));
            assert_eq!(drawn.lines().count(), 10, "{drawn}");
            assert!(drawn.lines().all(|l| l.chars().count() <= width), "{drawn}");
            drawn
                .lines()
                .nth(1)
                .unwrap_or_default()
                .split_whitespace()
                .skip(3)
                .map(str::to_owned)
                .collect::<Vec<_>>()
        };
        assert_eq!(times(80), ["1.00", "4.00", "8.00"]);
        assert_eq!(times(60), ["1.00", "8.00"]);
        assert_eq!(times(40), ["8.00"]);
        assert!(course.for_width(Some(30)).starts_with("1.00"));
    }

    #[test]
    fn narrow_table_is_wrapped_or_becomes_a_list() {
        let whole = rows().for_width(None);
        assert!(
            whole
                .lines()
                .any(|l| l.contains("phase margin (deg)") && l.contains("remark"))
        );
        assert_eq!(rows().for_width(Some(110)), whole);
        let narrow = rows().for_width(Some(38));
        assert!(narrow.lines().all(|l| l.chars().count() <= 38), "{narrow}");
        for kept in ["anna", "13.5\u{a0}±\u{a0}1.9", "margin", "(deg)", "range"] {
            assert!(narrow.contains(kept), "{kept}\n{narrow}");
        }
        // At no width is a line longer than the screen.
        for width in 20..110 {
            let page = rows().for_width(Some(width));
            let is_table = page.contains('─');
            assert!(
                !is_table || page.lines().all(|l| l.chars().count() <= width),
                "{width}\n{page}"
            );
        }
        let list = rows().for_width(Some(20));
        assert!(list.starts_with("anna\n  phase margin (deg)  13.5 ± 1.9\n"), "{list}");
        assert!(list.ends_with("bert\n  phase margin (deg)  7 ± 19"), "{list}");
    }
}
