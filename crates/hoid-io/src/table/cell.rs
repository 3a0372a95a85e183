//! Interpretation of the text of a cell: a number with a decimal point or comma, a missing value, or text.

use std::borrow::Cow;

/// Contents of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Cell {
    /// A number, finite or infinite.
    Number(f64),
    /// A missing value: an empty cell, or a word that denotes a missing value.
    Missing,
    /// Any other text.
    Text,
}

/// Words for missing values in R, pandas, databases, spreadsheets, statistics packages and the C library of Windows.
const MISSING: [&str; 16] = [
    "", "na", "n/a", "null", "none", "<na>", "#n/a", "#na", "-", "--", ".", "?", "1.#ind", "-1.#ind", "1.#qnan",
    "-1.#qnan",
];

/// Typographic minus sign, U+2212.
const MINUS: char = '\u{2212}';

impl Cell {
    /// Interprets the text of a cell; an empty cell, NaN and the words in [`MISSING`] denote missing values.
    pub(crate) fn parse(text: &str) -> Self {
        let text = text.trim();
        match text.parse::<f64>() {
            Ok(value) if value.is_nan() => Self::Missing,
            Ok(value) => Self::Number(value),
            Err(_) if MISSING.iter().any(|word| text.eq_ignore_ascii_case(word)) => Self::Missing,
            // Spreadsheets in some languages write the typographic minus sign.
            Err(_) if text.contains(MINUS) => match text.replace(MINUS, "-").parse::<f64>() {
                Ok(value) if !value.is_nan() => Self::Number(value),
                _ => Self::Text,
            },
            Err(_) => Self::Text,
        }
    }
}

/// Remedy for cells for which [`has_decimal_comma`] is true.
pub(crate) const DECIMAL_COMMA: &str = "write the numbers with a decimal point instead of a comma";

/// True if a text cell would be a number with a decimal point instead of its comma.
pub(crate) fn has_decimal_comma(cell: &str) -> bool {
    cell.contains(',') && matches!(Cell::parse(&cell.replacen(',', ".", 1)), Cell::Number(_))
}

/// Replaces the decimal comma of a number by a point; other cells are returned unchanged.
pub(crate) fn with_decimal_point(cell: &str, commas: bool) -> Cow<'_, str> {
    if commas && has_decimal_comma(cell) {
        Cow::Owned(cell.replacen(',', ".", 1))
    } else {
        Cow::Borrowed(cell)
    }
}

/// True if a cell looks like a date or a clock time, such as `2024-03-01 10:00:00.5` or `10:00:00,5`.
pub(crate) fn is_moment(cell: &str) -> bool {
    let parts = |marks: &[char]| {
        cell.split(marks)
            .filter(|part| part.starts_with(|c: char| c.is_ascii_digit()))
            .count()
    };
    cell.starts_with(|c: char| c.is_ascii_digit()) && (parts(&[':']) > 1 || parts(&['-', '/', '.']) > 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells() {
        for missing in [
            "", "  ", "NaN", "nan", "NA", "n/a", "NULL", "-NaN", "None", "<NA>", "#N/A", "-", "-1.#IND",
        ] {
            assert_eq!(Cell::parse(missing), Cell::Missing, "{missing:?}");
        }
        for text in [
            "1,5",
            "abc",
            "1 2",
            "--1",
            "0x10",
            "1_000",
            "-.",
            "nothing",
            "1\u{2212}2",
            "\u{2212}\u{2212}1",
        ] {
            assert_eq!(Cell::parse(text), Cell::Text, "{text:?}");
        }
        assert_eq!(Cell::parse(" -1.5e-3 "), Cell::Number(-1.5e-3));
        assert_eq!(Cell::parse("+.5"), Cell::Number(0.5));
        assert_eq!(Cell::parse("\u{2212}1.5e\u{2212}3"), Cell::Number(-1.5e-3));
        assert_eq!(Cell::parse("1e999"), Cell::Number(f64::INFINITY));
    }

    #[test]
    fn decimal_commas_and_moments() {
        assert_eq!(with_decimal_point("-1,5e-3", true), "-1.5e-3");
        assert_eq!(
            Cell::parse(&with_decimal_point("\u{2212}1,5", true)),
            Cell::Number(-1.5)
        );
        for cell in ["1,5", "a,b", "1,234,567", "1.5"] {
            assert_eq!(with_decimal_point(cell, cell != "1,5"), cell);
        }
        for moment in [
            "2024-03-01 10:00:00.000",
            "2024-03-01T10:00:00Z",
            "10:00:00,5",
            "01.03.2024",
            "3/1/2024",
        ] {
            assert!(is_moment(moment), "{moment}");
        }
        for other in ["abc", "s", "1.5.", "-1", "1-2", "a:b:c", ""] {
            assert!(!is_moment(other), "{other}");
        }
    }
}
