//! Columns of numbers as they stand in a file, before anything is chosen, checked or repaired.
//!
//! Each format fills a [`Table`]; everything behind it (choice of columns, sampling, repair) is the
//! same for all formats. A value that is missing or no number is NaN here; the file is asked again
//! what stood there only when an error has to say so, which keeps a million rows cheap.

use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;

use crate::IoError;
use crate::wording::{named, shown};

/// What stands in a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Cell {
    /// A number, finite or infinite.
    Number(f64),
    /// Nothing, or a word for nothing.
    Missing,
    /// Something else.
    Text,
}

/// How programs write that there is no value: R, pandas, databases, spreadsheets, statistics packages, the C library of
/// Windows.
const MISSING: [&str; 16] = [
    "", "na", "n/a", "null", "none", "<na>", "#n/a", "#na", "-", "--", ".", "?", "1.#ind", "-1.#ind", "1.#qnan",
    "-1.#qnan",
];

impl Cell {
    /// What the text of a cell means: empty, NaN and the words of [`MISSING`] are missing values.
    pub(crate) fn parse(text: &str) -> Self {
        let text = text.trim();
        match text.parse::<f64>() {
            Ok(value) if value.is_nan() => Self::Missing,
            Ok(value) => Self::Number(value),
            Err(_) if MISSING.iter().any(|word| text.eq_ignore_ascii_case(word)) => Self::Missing,
            Err(_) => Self::Text,
        }
    }
}

/// Most decimals of rounded times that are looked for: a µs.
const MOST_DECIMALS: i32 = 6;

/// How exactly a column of decimal numbers is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Precision {
    /// Most decimals of any value; `None` when the values were not printed.
    decimals: Option<i32>,
    /// Most significant digits of any value.
    significant: i32,
}

impl Precision {
    /// That of binary numbers in single precision, seven digits.
    pub(crate) fn single() -> Self {
        Self {
            decimals: Some(45),
            significant: 7,
        }
    }

    /// That of times in a file of binary numbers. A recorder that rounds what it saves, as to tenths of
    /// a ms, leaves times that are all whole multiples of its last digit, and is known by that. The rest
    /// of a rounded number is below two units of its last binary digit; as many digits as are looked
    /// for here leave no such rest by chance.
    pub(crate) fn of_times(values: &[f64], single: bool) -> Self {
        if single {
            return Self::single();
        }
        let is_multiple = |value: f64, decimals: i32| {
            let scaled = value * 10_f64.powi(decimals);
            (scaled - scaled.round()).abs() <= 2.0 * f64::EPSILON * scaled.abs()
        };
        let finite = || values.iter().copied().filter(|value| value.is_finite());
        Self {
            decimals: (0..=MOST_DECIMALS).find(|decimals| finite().all(|value| is_multiple(value, *decimals))),
            significant: 0,
        }
    }

    /// Takes one more printed number into account.
    pub(crate) fn add(&mut self, text: &str) {
        let (mantissa, exponent) = match text.trim().split_once(['e', 'E']) {
            Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().unwrap_or(0).clamp(-400, 400)),
            None => (text.trim(), 0),
        };
        let digits = |part: &str| part.bytes().filter(u8::is_ascii_digit).count() as i32;
        let behind = mantissa.split_once('.').map_or(0, |(_, behind)| digits(behind));
        let leading_zeros = mantissa
            .bytes()
            .take_while(|b| !(b'1'..=b'9').contains(b))
            .filter(u8::is_ascii_digit)
            .count() as i32;
        self.decimals = Some(self.decimals.unwrap_or(i32::MIN).max(behind - exponent));
        self.significant = self.significant.max(digits(mantissa) - leading_zeros);
    }

    /// Takes one more number with so many decimals into account.
    pub(crate) fn add_decimals(&mut self, decimals: usize) {
        self.decimals = Some(self.decimals.unwrap_or(0).max(decimals as i32));
    }

    /// That of the same numbers times a power of ten.
    pub(crate) fn shifted(self, power: i32) -> Self {
        Self {
            decimals: self.decimals.map(|decimals| decimals - power),
            ..self
        }
    }

    /// One unit of the last printed digit of a value of this size. Fixed decimals give the same
    /// unit everywhere; with a fixed number of significant digits the unit grows with the value.
    pub(crate) fn unit(self, value: f64) -> f64 {
        let Some(decimals) = self.decimals else { return 0.0 };
        let fixed = 10_f64.powi(-decimals);
        let magnitude = value.abs().log10().floor();
        if self.significant == 0 || !magnitude.is_finite() {
            return fixed;
        }
        fixed.max(10_f64.powi(magnitude as i32 + 1 - self.significant))
    }
}

/// One column.
#[derive(Debug, Default)]
pub(crate) struct Column {
    /// Name; empty when the header has none.
    pub(crate) name: String,
    /// Unit; empty when unknown.
    pub(crate) unit: String,
    /// One value a row, NaN where there is no number.
    pub(crate) values: Vec<f64>,
    /// Rows that hold text, in increasing order.
    pub(crate) texts: Vec<usize>,
    /// Whether the values are moments of a clock, in s from the first.
    pub(crate) moments: bool,
    /// How exactly the values are printed; only kept for the time.
    pub(crate) precision: Precision,
}

/// Where the rows came from, for messages.
pub(crate) trait Source {
    /// Name of the file.
    fn file(&self) -> &str;
    /// "line 12" or "row 12".
    fn place(&self, row: usize) -> String;
    /// What stands in a cell, cut to a readable length.
    fn cell(&self, row: usize, column: usize) -> String;
    /// Whether the file ends in the middle of this row, as far as can be seen.
    fn is_open(&self, _row: usize) -> bool {
        false
    }
}

/// The columns of a file.
pub(crate) struct Table<'a> {
    pub(crate) columns: Vec<Column>,
    pub(crate) rows: usize,
    /// Sample time that the file states beside its columns, s.
    pub(crate) sample_time_s: Option<f64>,
    pub(crate) source: Box<dyn Source + 'a>,
    pub(crate) notes: Vec<String>,
}

impl Table<'_> {
    /// Names of all columns in order.
    pub(crate) fn names(&self) -> Vec<&str> {
        self.columns.iter().map(|c| c.name.as_str()).collect()
    }

    /// Whether no column has a number in a row, as in one of units.
    pub(crate) fn has_no_number_in(&self, row: usize) -> bool {
        let has_none = |column: &Column| column.values.get(row).is_none_or(|value| value.is_nan());
        self.columns.iter().all(has_none)
    }

    /// Why the value at `row` of a column, which is not finite, cannot be used. `rows` are the rows
    /// in use.
    pub(crate) fn bad_value(&self, column: usize, row: usize, rows: Range<usize>) -> IoError {
        let Column {
            name, values, texts, ..
        } = &self.columns[column];
        let file = self.source.file().to_owned();
        let place = self.source.place(row);
        let found = self.source.cell(row, column);
        let is_last_cell = column + 1 == self.columns.len();
        let column = named(name);
        // At the end of a file that is cut a sign or a point is the beginning of a number.
        let begun = is_last_cell && self.source.is_open(row) && matches!(found.as_str(), "-" | ".");
        if begun || texts.binary_search(&row).is_ok() {
            let remedy = if has_decimal_comma(&found) {
                DECIMAL_COMMA
            } else if is_moment(&found) {
                "a date or time of a clock among numbers: write the whole column in one way, or give --fs HZ where the samples are even"
            } else if row == 0 && self.rows > 1 && self.has_no_number_in(row) {
                UNITS_ROW
            } else if is_last_cell && self.source.is_open(row) {
                "the file is cut there, in the middle of its last line: copy or record it again, or remove that line"
            } else {
                "correct the cell, empty it and bridge it with --fill, or choose another column"
            };
            return IoError::NotANumber {
                file,
                place,
                column,
                found,
                remedy,
            };
        }
        if values[row].is_infinite() {
            return IoError::Infinite {
                file,
                place,
                column,
                found,
            };
        }
        let count = rows
            .clone()
            .filter(|row| values[*row].is_nan() && texts.binary_search(row).is_err())
            .count();
        IoError::Missing {
            file,
            place,
            column,
            found: if found.is_empty() { String::from("empty") } else { found },
            count,
            rows: rows.len(),
        }
    }
}

/// The remedy for a first row without numbers.
pub(crate) const UNITS_ROW: &str =
    "no column has a number there: where that line names the units, remove it and say them with --unit e=deg,u=deg";

/// The remedy for [`has_decimal_comma`].
pub(crate) const DECIMAL_COMMA: &str = "write the numbers with a decimal point instead of a comma";

/// Whether a cell that is text would be a number with a point in the place of its comma.
pub(crate) fn has_decimal_comma(cell: &str) -> bool {
    cell.contains(',') && matches!(Cell::parse(&cell.replacen(',', ".", 1)), Cell::Number(_))
}

/// A number as it is written with a decimal point; any other cell as it is.
pub(crate) fn with_decimal_point(cell: &str, commas: bool) -> Cow<'_, str> {
    if commas && has_decimal_comma(cell) {
        Cow::Owned(cell.replacen(',', ".", 1))
    } else {
        Cow::Borrowed(cell)
    }
}

/// Whether a cell looks like a date or the time of a clock: `2024-03-01 10:00:00.5`, `10:00:00,5`.
fn is_moment(cell: &str) -> bool {
    let parts = |marks: &[char]| {
        cell.split(marks)
            .filter(|part| part.starts_with(|c: char| c.is_ascii_digit()))
            .count()
    };
    cell.starts_with(|c: char| c.is_ascii_digit()) && (parts(&[':']) > 1 || parts(&['-', '/', '.']) > 2)
}

/// Checks that the names differ, and notes the columns without one.
pub(crate) fn check_names(names: &[String], file: &str, notes: &mut Vec<String>) -> Result<(), IoError> {
    check_number(names.len(), file)?;
    let mut known: HashMap<&str, usize> = HashMap::new();
    for (second, name) in names.iter().enumerate() {
        if name.is_empty() {
            notes.push(format!("column {} has no name and is left out", second + 1));
        } else if let Some(first) = known.insert(name, second) {
            return Err(IoError::DuplicateColumn {
                file: file.to_owned(),
                name: shown(name),
                first: first + 1,
                second: second + 1,
            });
        }
    }
    Ok(())
}

/// Most columns of a table: a recording has some tens.
const MOST_COLUMNS: usize = 10_000;

/// Checks the number of columns, before anything is made of them.
pub(crate) fn check_number(columns: usize, file: &str) -> Result<(), IoError> {
    if columns <= MOST_COLUMNS {
        return Ok(());
    }
    Err(IoError::TooManyColumns {
        file: file.to_owned(),
        found: columns,
        most: MOST_COLUMNS,
    })
}

/// Takes the units from the comments above a table, and gives the sample time that they state.
pub(crate) fn asides<'a>(comments: impl Iterator<Item = &'a str>, columns: &mut [Column]) -> Option<f64> {
    let mut sample_time_s = None;
    for line in comments {
        let line = line.trim_start_matches('#').trim();
        if let Some(units) = line.strip_prefix("units:") {
            // Of more parts than columns the rest names nothing.
            for part in units.split(',').take(columns.len()).map(str::trim) {
                // A name or a unit may hold blanks: the column that fits with the longest name is
                // the one.
                let unit_of = |column: &Column| {
                    let unit = part.strip_prefix(column.name.as_str())?;
                    unit.starts_with(char::is_whitespace).then(|| unit.trim().to_owned())
                };
                let best = columns
                    .iter_mut()
                    .filter(|c| !c.name.is_empty() && unit_of(c).is_some());
                if let Some(column) = best.max_by_key(|c| c.name.len()) {
                    column.unit = unit_of(column).unwrap_or_default();
                }
            }
        } else if let Some(stated) = line.strip_prefix("sample_time:") {
            let value = stated.trim().trim_end_matches('s').trim().parse().ok();
            sample_time_s = value.filter(|ts: &f64| ts.is_finite() && *ts > 0.0);
        }
    }
    sample_time_s
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
        for text in ["1,5", "abc", "1 2", "--1", "0x10", "1_000", "-.", "nothing"] {
            assert_eq!(Cell::parse(text), Cell::Text, "{text:?}");
        }
        assert_eq!(Cell::parse(" -1.5e-3 "), Cell::Number(-1.5e-3));
        assert_eq!(Cell::parse("+.5"), Cell::Number(0.5));
        assert_eq!(Cell::parse("1e999"), Cell::Number(f64::INFINITY));
    }

    fn precision(texts: &[&str]) -> Precision {
        let mut precision = Precision::default();
        texts.iter().for_each(|text| precision.add(text));
        precision
    }

    #[test]
    fn unit_of_the_last_digit() {
        let fixed = precision(&["0.0000", "0.0167", "45.0167"]);
        for t in [0.0, 0.0167, 45.0] {
            assert!((fixed.unit(t) - 1e-4).abs() < 1e-18, "{t}");
        }
        // Five significant digits, as some programs print: at 100 s the last digit is 0.01.
        let significant = precision(&["0", "0.016667", "1.0167", "100.02"]);
        assert!((significant.unit(100.02) - 1e-2).abs() < 1e-15);
        assert!((significant.unit(0.016667) - 1e-6).abs() < 1e-18);
        assert!((precision(&["1.67e-02", "1.00e-01"]).unit(0.0167) - 1e-4).abs() < 1e-18);
        assert_eq!(precision(&["0", "1", "120"]).unit(3.0), 1.0);
        assert!(precision(&["0.30000000000000004"]).unit(0.3) < 1e-15);
        assert_eq!(Precision::default().unit(3.0), 0.0);
        // Nothing that can stand in a file gives anything but a number of s.
        assert!(precision(&["1e-99999999999", ".", "-", "e"]).unit(1e300) >= 0.0);
    }

    #[test]
    fn times_that_were_rounded_are_known_as_such() {
        let times = |rate_hz: f64| (0..5000).map(move |k| f64::from(k) / rate_hz);
        let rounded: Vec<f64> = times(60.0).map(|t| (t * 1e4).round() / 1e4).collect();
        assert!((Precision::of_times(&rounded, false).unit(45.0) - 1e-4).abs() < 1e-18);
        let hundredths: Vec<f64> = (0..5000).map(|k| f64::from(k) * 0.01).collect();
        assert!((Precision::of_times(&hundredths, false).unit(45.0) - 1e-2).abs() < 1e-16);
        let exact: Vec<f64> = times(60.0).collect();
        assert_eq!(Precision::of_times(&exact, false).unit(45.0), 0.0);
        assert_eq!(Precision::of_times(&exact, true), Precision::single());
        // A t with NaN is judged elsewhere.
        assert_eq!(Precision::of_times(&[f64::NAN, 0.5], false).unit(1.0), 0.1);
    }

    #[test]
    fn decimal_commas_and_moments() {
        assert_eq!(with_decimal_point("-1,5e-3", true), "-1.5e-3");
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

    #[test]
    fn long_and_strange_cells_are_shown_short() {
        let shown = shown(&"\u{1b}[31mé".repeat(1000));
        assert!(shown.chars().count() < 200 && !shown.contains('\u{1b}'), "{shown}");
    }
}
