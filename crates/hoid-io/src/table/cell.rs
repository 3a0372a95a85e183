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
const MISSING_WORDS: [&str; 30] = [
    "",
    "na",
    "n/a",
    "n.a.",
    "null",
    "none",
    "nil",
    "missing",
    "<na>",
    "#n/a",
    "#na",
    "#nv",
    "#div/0!",
    "#value!",
    "#wert!",
    "#num!",
    "#zahl!",
    "#ref!",
    "#bezug!",
    "#name?",
    "-",
    "--",
    ".",
    "?",
    "1.#ind",
    "-1.#ind",
    "1.#qnan",
    "-1.#qnan",
    "nan(ind)",
    "-nan(ind)",
];

/// Typographic minus sign, U+2212.
const MINUS: char = '\u{2212}';

impl Cell {
    /// Interprets the text of a cell; an empty cell, NaN and the words in [`MISSING_WORDS`] denote missing values.
    pub(crate) fn parse(text: &str) -> Self {
        let text = text.trim();
        match text.parse::<f64>() {
            Ok(value) if value.is_nan() => Self::Missing,
            Ok(value) => Self::Number(value),
            Err(_) if MISSING_WORDS.iter().any(|word| text.eq_ignore_ascii_case(word)) => Self::Missing,
            // Spreadsheets in some languages write the typographic minus sign, and Fortran writes the exponent D.
            Err(_) if text.contains(MINUS) || is_fortran(text) => {
                match text.replace(MINUS, "-").replace(['d', 'D'], "e").parse::<f64>() {
                    Ok(value) if !value.is_nan() => Self::Number(value),
                    _ => Self::Text,
                }
            }
            Err(_) => Self::Text,
        }
    }
}

/// Remedy for cells for which [`has_decimal_comma`] is true.
pub(crate) const DECIMAL_COMMA_REMEDY: &str =
    "write the numbers with a decimal point instead of a comma, and without thousands separators";

/// True if a text cell would be a number with a decimal point instead of its comma.
pub(crate) fn has_decimal_comma(cell: &str) -> bool {
    cell.contains(',') && matches!(Cell::parse(&cell.replacen(',', ".", 1)), Cell::Number(_))
}

/// Replaces the decimal comma of a number by a point, and removes separators of thousands that cannot be decimal signs;
/// other cells are returned unchanged.
pub(crate) fn with_decimal_point(cell: &str, commas: bool) -> Cow<'_, str> {
    if commas && has_decimal_comma(cell) {
        Cow::Owned(cell.replacen(',', ".", 1))
    } else {
        without_thousands(cell).map_or(Cow::Borrowed(cell), Cow::Owned)
    }
}

/// Signs that separate thousands and never decimals: apostrophes, and blanks of several widths.
const THOUSANDS_SEPARATORS: [char; 6] = ['\'', '\u{2019}', ' ', '\u{a0}', '\u{2009}', '\u{202f}'];

/// Returns a number such as `-1.234,50`, `1,234.50`, `1'234.5` or `1 234,5` with a decimal point and without the signs
/// between its thousands; `None` for any other cell. In `1,234` the comma may be a decimal sign.
fn without_thousands(cell: &str) -> Option<String> {
    let text = cell.trim();
    let number = text.trim_start_matches(['+', '-', MINUS]);
    if number.len() < 5 || !number.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    // The last point or comma is the decimal sign, unless it occurs again.
    let last = number.rfind(['.', ',']);
    let (whole, decimals) = match last {
        Some(at) => (number.get(..at)?, number.get(at..)?.get(1..)?),
        None => (number, ""),
    };
    let mark = whole.chars().find(|c| !c.is_ascii_digit())?;
    let decimal_sign = last.and_then(|at| number.get(at..)?.chars().next());
    // Without decimals, a blank may separate two numbers.
    let is_mark = match mark {
        '.' | ',' => decimal_sign.is_some_and(|sign| sign != mark),
        ' ' => decimal_sign.is_some(),
        mark => THOUSANDS_SEPARATORS.contains(&mark),
    };
    let mut groups = whole.split(mark);
    let first = groups.next()?;
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let in_threes =
        (1..4).contains(&first.len()) && digits(first) && groups.all(|group| group.len() == 3 && digits(group));
    (is_mark && in_threes && digits(decimals)).then(|| {
        let sign = text.strip_suffix(number).unwrap_or_default();
        format!("{sign}{}.{decimals}", whole.replace(mark, ""))
    })
}

/// True for a number such as `1.5D+03`. Without a point and a sign, as in `2D1`, the text may be a label.
fn is_fortran(text: &str) -> bool {
    let Some((number, exponent)) = text.split_once(['d', 'D']) else {
        return false;
    };
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    number.contains('.') && exponent.strip_prefix(['+', '-']).is_some_and(digits)
}

/// True if a cell looks like a date or a clock time, such as `2024-03-01 10:00:00.5` or `10:00:00,5`.
pub(super) fn looks_like_date_or_time(cell: &str) -> bool {
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
    fn cells_are_missing_text_or_numbers() {
        for missing in [
            "", "  ", "NaN", "nan", "NA", "n/a", "NULL", "-NaN", "None", "<NA>", "#N/A", "-", "-1.#IND", "#DIV/0!",
            "n.a.",
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
        assert_eq!(Cell::parse("-1.5D+03"), Cell::Number(-1500.0));
        for text in ["1.5D", "D3", "1.D2D+3", "d", "1.5d+", ".D", "2D1", "1.5D3", ".D+1"] {
            assert_eq!(Cell::parse(text), Cell::Text, "{text:?}");
        }
    }

    #[test]
    fn thousands_separators_are_removed() {
        for (cell, number) in [
            ("4.000,25", "4000.25"),
            ("-1.234.567,5", "-1234567.5"),
            ("4,000.25", "4000.25"),
            ("+1,234,567.", "+1234567."),
            ("4'000.25", "4000.25"),
            ("4\u{202f}000,25", "4000.25"),
            (" 1\u{a0}234\u{a0}567 ", "1234567."),
            ("1 234,5", "1234.5"),
            ("\u{2212}4.000,5", "\u{2212}4000.5"),
        ] {
            for commas in [true, false] {
                assert_eq!(with_decimal_point(cell, commas), number, "{cell}");
            }
            assert!(matches!(Cell::parse(number), Cell::Number(_)), "{number}");
        }
        for cell in [
            "4,000",
            "4.000",
            "1,234,567",
            "40,00.5",
            "1.2345,6",
            "1,23.4",
            "1.234,5,6",
            "1.234.5",
            "12 34",
            "1 234",
            "1234 567,5",
            "1.234,5e3",
            "",
            "'",
            "10:11:12,5",
            "05.03.2024",
            "1 é34",
            "1.234,é",
        ] {
            assert_eq!(with_decimal_point(cell, false), cell);
        }
    }

    #[test]
    fn decimal_commas_and_clock_times_are_recognised() {
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
            assert!(looks_like_date_or_time(moment), "{moment}");
        }
        for other in ["abc", "s", "1.5.", "-1", "1-2", "a:b:c", ""] {
            assert!(!looks_like_date_or_time(other), "{other}");
        }
    }
}
