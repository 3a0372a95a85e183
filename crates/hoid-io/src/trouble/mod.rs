//! Sampling trouble, as recorded data have it: found and told with where and how much, never mended unasked.
//!
//! | module | what it finds |
//! |---|---|
//! | `timing` | jitter, missing rows, a time that stands or runs back, a clock that is off or drifts |
//! | `holds` | rows that are there twice, and channels that all hold their values |
//! | `values` | saturation, quantisation, constants, missing values |
//!
//! Each finding is a [`Trouble`]. A person's channel may be smooth, quiet or constant for good reasons: the rules are made so that
//! simulated people without trouble give no finding (tested), and say of what they find what it is and not what it means.

mod holds;
mod timing;
mod values;

use std::fmt;
use std::ops::Range;

use serde::Serialize;

use crate::preparation::decimal;
use crate::table::{Precision, Table};

pub(crate) use timing::Grid;
pub(crate) use values::{Levels, rails};

/// Places of a finding that are written as JSON; all of them are counted.
const PLACES_WRITTEN: usize = 100;

/// What is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum TroubleKind {
    /// Values that are missing or not finite.
    Missing,
    /// Time that stands still or runs back.
    Unordered,
    /// Rows that are there twice, time included.
    Repeated,
    /// Rows that are not there.
    Gap,
    /// Times off an even grid.
    Jitter,
    /// A clock that is off another, or off a usual rate.
    Clock,
    /// A clock whose rate changes.
    Drift,
    /// All channels hold their values while the time goes on.
    Stalled,
    /// A channel that stays at its end.
    Saturated,
    /// A channel in coarse steps.
    Quantised,
    /// A channel with one value.
    Constant,
}

impl TroubleKind {
    /// Its name, as in JSON and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Missing => "missing",
            Self::Unordered => "unordered",
            Self::Repeated => "repeated",
            Self::Gap => "gap",
            Self::Jitter => "jitter",
            Self::Clock => "clock",
            Self::Drift => "drift",
            Self::Stalled => "stalled",
            Self::Saturated => "saturated",
            Self::Quantised => "quantised",
            Self::Constant => "constant",
        }
    }

    /// What can be done about it.
    pub fn remedy(self) -> &'static str {
        match self {
            Self::Missing => "bridge with --fill, or leave out with --from and --to or --mask missing",
            Self::Unordered => "look at how the file was joined, or count the samples with --fs",
            Self::Repeated => "drop them with --drop-repeated",
            Self::Gap => "interpolate with --resample, or leave out with --mask gap",
            Self::Jitter => "interpolate with --resample, or count the samples with --fs if only t is wrong",
            Self::Clock => "give the true sampling frequency with --fs if t is wrong",
            Self::Drift => "interpolate with --resample if t is right, or count the samples with --fs",
            Self::Stalled => "leave out with --mask stalled or --from and --to",
            Self::Saturated => "leave out with --mask saturated; a bias stays, see the page on record files",
            Self::Quantised => "nothing; it adds noise of variance step^2 / 12",
            Self::Constant => "choose another column",
        }
    }
}

/// Rows that follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Place {
    /// The first row, counted from 1 without header and comments; of a gap the row before it.
    pub row: usize,
    /// How many rows; of a gap those that are missing.
    pub rows: usize,
    /// Time of the first row, s; none without a time.
    pub from_s: Option<f64>,
    /// Time of the row behind the last, s.
    pub to_s: Option<f64>,
}

/// One finding.
#[derive(Debug, Clone, PartialEq)]
pub struct Trouble {
    /// What it is.
    pub kind: TroubleKind,
    /// The channel; empty for the time and for all channels.
    pub channel: String,
    /// Rows concerned.
    pub rows: usize,
    /// Their share of the rows looked at.
    pub share: f64,
    /// How much, in `unit`: jitter RMS in s; a gap, a stall or a saturation its longest time in s; a clock and a drift the relative
    /// deviation; the step of what is quantised; else the number of rows.
    pub size: f64,
    /// Unit of the size.
    pub unit: String,
    /// Where.
    pub places: Vec<Place>,
    /// A sentence without a full stop.
    pub text: String,
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Serialize for Trouble {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Written<'a> {
            kind: TroubleKind,
            channel: &'a str,
            rows: usize,
            share: f64,
            size: f64,
            unit: &'a str,
            text: &'a str,
            remedy: &'static str,
            place_count: usize,
            places: &'a [Place],
        }
        Written {
            kind: self.kind,
            channel: &self.channel,
            rows: self.rows,
            share: self.share,
            size: self.size,
            unit: &self.unit,
            text: &self.text,
            remedy: self.kind.remedy(),
            place_count: self.places.len(),
            places: &self.places[..self.places.len().min(PLACES_WRITTEN)],
        }
        .serialize(serializer)
    }
}

/// A column as it is looked at.
#[derive(Clone, Copy)]
pub(crate) struct Signal<'a> {
    pub(crate) name: &'a str,
    pub(crate) values: &'a [f64],
}

/// Columns of one length, and what is known of their time.
#[derive(Default)]
pub(crate) struct Signals<'a> {
    pub(crate) columns: Vec<Signal<'a>>,
    pub(crate) time: Option<Signal<'a>>,
    /// How exactly the time is printed.
    pub(crate) precision: Precision,
    /// Sampling frequency that was given or stated, Hz.
    pub(crate) nominal_hz: Option<f64>,
    /// Other columns that count time.
    pub(crate) clocks: Vec<Signal<'a>>,
    /// Rows before the first one looked at.
    pub(crate) before: usize,
}

impl Signals<'_> {
    /// Number of rows.
    fn rows(&self) -> usize {
        let lengths = self.columns.iter().chain(&self.time).map(|signal| signal.values.len());
        lengths.min().unwrap_or(0)
    }

    /// Time of a row, s.
    fn at_s(&self, row: usize) -> Option<f64> {
        match (&self.time, self.nominal_hz) {
            (Some(time), _) => time.values.get(row).copied().filter(|t| t.is_finite()),
            (None, Some(hz)) => Some(row as f64 / hz).filter(|t| t.is_finite()),
            (None, None) => None,
        }
    }

    fn place(&self, rows: &Range<usize>) -> Place {
        Place {
            row: self.before + rows.start + 1,
            rows: rows.len(),
            from_s: self.at_s(rows.start),
            to_s: self.at_s(rows.end).or_else(|| self.at_s(rows.end.saturating_sub(1))),
        }
    }
}

/// "row 12 (0.11 s)".
fn at(place: &Place) -> String {
    match place.from_s {
        Some(s) => format!("row {} ({} s)", place.row, decimal(s)),
        None => format!("row {}", place.row),
    }
}

/// A number with four significant digits.
fn short(value: f64) -> String {
    let rounded = format!("{value:.3e}").parse::<f64>().unwrap_or(value);
    if rounded != 0.0 && !(1e-3..1e7).contains(&rounded.abs()) {
        format!("{rounded:e}")
    } else {
        format!("{rounded}")
    }
}

/// "1 row", "7 rows".
fn counted(n: usize, what: &str) -> String {
    if n == 1 {
        format!("1 {what}")
    } else {
        format!("{n} {what}s")
    }
}

/// Everything that is wrong with columns that belong together.
pub(crate) fn find(signals: &Signals<'_>) -> Vec<Trouble> {
    let mut found = Vec::new();
    if signals.rows() == 0 {
        return found;
    }
    let grid = signals.time.map(|time| Grid::of(time.values));
    if let Some(grid) = &grid {
        holds::standing(signals, grid, &mut found);
        timing::find(signals, grid, &mut found);
    }
    let levels: Vec<Levels> = signals.columns.iter().map(|signal| Levels::of(signal.values)).collect();
    holds::stalls(signals, &levels, grid.as_ref(), &mut found);
    for (signal, levels) in signals.columns.iter().zip(&levels) {
        values::find(signals, *signal, levels, &mut found);
    }
    found.sort_by(|a, b| (a.kind, &a.channel).cmp(&(b.kind, &b.channel)));
    found
}

/// Whether a name says that a column counts time.
pub(crate) fn names_a_clock(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    ["time", "clock", "stamp"].iter().any(|word| name.contains(word))
}

/// What is wrong with columns of a table.
pub(crate) fn of_table(
    table: &Table<'_>,
    used: &[usize],
    time: Option<usize>,
    nominal_hz: Option<f64>,
    rows: Range<usize>,
) -> Vec<Trouble> {
    let signal = |column: usize| Signal {
        name: &table.columns[column].name,
        values: &table.columns[column].values[rows.clone()],
    };
    let is_clock = |column: &usize| Some(*column) != time && names_a_clock(&table.columns[*column].name);
    find(&Signals {
        columns: used.iter().copied().map(signal).collect(),
        time: time.map(signal),
        precision: time.map(|time| table.columns[time].precision).unwrap_or_default(),
        nominal_hz: nominal_hz.or(table.sample_time_s.map(|ts| 1.0 / ts)),
        clocks: (0..table.columns.len()).filter(is_clock).map(signal).collect(),
        before: rows.start,
    })
}

#[cfg(test)]
mod tests;
