//! Selection of the time column and its unit by the user, such as `clock:ms`.

use std::fmt;
use std::str::FromStr;

use crate::IoError;
use crate::table::ColumnOption;
use crate::wording::{did_you_mean, list_names};

/// Unit of a time column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unit {
    /// Seconds multiplied by a power of ten.
    Power(i32),
    Minutes,
    Hours,
    /// Days, such as the serial dates of spreadsheets and the date numbers of MATLAB.
    Days,
    /// Dates and clock times.
    Iso,
    /// Whole seconds in this column and nanoseconds in another column.
    SecondsAndNanoseconds,
}

impl Unit {
    pub(super) fn of(text: &str) -> Option<Self> {
        Some(match text {
            "s" | "sec" | "secs" | "second" | "seconds" | "sek" | "sekunden" => Self::Power(0),
            "ms" | "msec" | "msecs" | "millis" | "millisecond" | "milliseconds" => Self::Power(-3),
            "us" | "µs" | "μs" | "usec" | "usecs" | "micros" | "microsecond" | "microseconds" => Self::Power(-6),
            "ns" | "nsec" | "nsecs" | "nanos" | "nanosec" | "nanosecond" | "nanoseconds" => Self::Power(-9),
            "min" | "mins" | "minute" | "minutes" | "minuten" => Self::Minutes,
            "h" | "hr" | "hour" | "hours" => Self::Hours,
            "d" | "day" | "days" | "tag" | "tage" => Self::Days,
            "iso" => Self::Iso,
            "sec+nanosec" => Self::SecondsAndNanoseconds,
            _ => return None,
        })
    }

    /// Returns the length of the unit in s, and the power of ten at or above it; `None` for dates and pairs of columns.
    pub(super) fn seconds(self) -> Option<(f64, i32)> {
        Some(match self {
            Self::Power(power) => (10_f64.powi(power), power),
            Self::Minutes => (60.0, 2),
            Self::Hours => (3600.0, 4),
            Self::Days => (86_400.0, 5),
            Self::Iso | Self::SecondsAndNanoseconds => return None,
        })
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Power(-3) => "ms",
            Self::Power(-6) => "us",
            Self::Power(-9) => "ns",
            Self::Power(_) => "s",
            Self::Minutes => "min",
            Self::Hours => "h",
            Self::Days => "days",
            Self::Iso => "iso",
            Self::SecondsAndNanoseconds => "sec+nanosec",
        })
    }
}

/// The time column and its unit: `COLUMN`, `COLUMN:UNIT`, or `SECONDS+NANOSECONDS`.
///
/// ```
/// let time: hoid_io::TimeChoice = "clock:ms".parse()?;
/// assert_eq!(time.to_string(), "clock:ms");
/// # Ok::<(), hoid_io::IoError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TimeChoice {
    pub(super) column: String,
    pub(super) unit: Option<Unit>,
}

impl TimeChoice {
    /// Returns the columns that the choice may name, each possibility in turn: one column, or seconds and nanoseconds.
    pub(crate) fn columns(&self) -> [Vec<&str>; 2] {
        let pair = self.column.split_once('+');
        [
            vec![&self.column],
            pair.map_or_else(Vec::new, |(seconds, nanoseconds)| vec![seconds, nanoseconds]),
        ]
    }

    /// True if the choice names a pair of columns by their common prefix.
    pub(crate) fn is_pair(&self) -> bool {
        self.unit == Some(Unit::SecondsAndNanoseconds)
    }

    /// Returns the error for a choice that is not among the columns of a file.
    pub(crate) fn unknown_error(&self, names: &[&str], file: &str) -> IoError {
        IoError::NoSuchColumn {
            file: file.to_owned(),
            missing: format!("\"{}\"", self.column),
            suggestion: did_you_mean(&[&self.column], names).into_boxed_str(),
            requested: self.to_string(),
            available: list_names(names),
            option: ColumnOption::Time,
        }
    }
}

impl FromStr for TimeChoice {
    type Err = IoError;

    /// # Errors
    /// [`IoError::Expression`] for an unknown unit or a missing column.
    fn from_str(text: &str) -> Result<Self, IoError> {
        let refuse = |expected: &str| IoError::Expression {
            found: text.to_owned(),
            expected: expected.to_owned(),
        };
        let text = text.trim();
        let (column, unit) = match text.rsplit_once(':') {
            Some((column, unit)) => match Unit::of(unit.trim()) {
                Some(unit) => (column.trim(), Some(unit)),
                // A colon in the path of a matrix row or column, such as `ans(1,:)`, does not precede a unit.
                None if unit.starts_with([')', ',', ']']) => (text, None),
                None => {
                    return Err(refuse(
                        "expected the time column, optionally followed by a colon and its unit: s, ms, us, ns, min, h, days, iso or sec+nanosec",
                    ));
                }
            },
            None => (text, None),
        };
        if column.is_empty() {
            return Err(refuse("expected the name of a column, as in clock:ms"));
        }
        Ok(Self {
            column: column.to_owned(),
            unit,
        })
    }
}

impl fmt::Display for TimeChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.unit {
            Some(unit) => write!(f, "{}:{unit}", self.column),
            None => f.write_str(&self.column),
        }
    }
}
