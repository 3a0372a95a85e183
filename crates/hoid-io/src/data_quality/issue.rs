//! A data-quality problem: kind, location, size and remedy.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::wording::format_decimal;

/// Maximum number of locations of a problem written as JSON; further locations are only counted.
const MAX_WRITTEN_PLACES: usize = 100;

/// Kind of a data-quality problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum QualityIssueKind {
    /// Missing or non-finite values.
    Missing,
    /// A time that is constant or runs backwards.
    Unordered,
    /// Rows that equal an earlier row, including the time.
    Repeated,
    /// Missing rows.
    Gap,
    /// Times that deviate from an evenly spaced grid.
    Jitter,
    /// A clock whose rate differs from the rate of another clock, from the given rate or from a common rate.
    Clock,
    /// A clock whose rate changes.
    Drift,
    /// All channels hold their values while the time advances.
    Stalled,
    /// A channel that stays at its limit.
    Saturated,
    /// A channel quantised in coarse steps.
    Quantised,
    /// A channel with a single value.
    Constant,
}

impl QualityIssueKind {
    /// Kinds of problems that are located in part of a record, which can be excluded; a clock error or a constant
    /// channel affects the whole record.
    pub const MASKABLE_KINDS: [Self; 4] = [Self::Missing, Self::Gap, Self::Stalled, Self::Saturated];

    /// Returns the remedy for the problem.
    pub fn remedy(self) -> &'static str {
        match self {
            Self::Missing => {
                "bridge empty cells with --fill, read a column logged at its own times with --sparse COLUMN=hold, \
                 or exclude the rows with --from and --to or --mask missing"
            }
            Self::Unordered => {
                "sort the rows by t if they are out of order, use --trial t if the time restarts with each trial, or \
                 replace t by the sampling frequency with --fs"
            }
            Self::Repeated => "drop them with --drop-repeated",
            Self::Gap => "interpolate with --resample, or exclude the gaps with --mask gap",
            Self::Jitter => {
                "interpolate with --resample, or replace t by the sampling frequency with --fs if only t is wrong"
            }
            Self::Clock => "give the true sampling frequency with --fs if t is wrong",
            Self::Drift => {
                "interpolate with --resample if t is right, or replace t by the sampling frequency with --fs"
            }
            Self::Stalled => "exclude the rows with --mask stalled or --from and --to",
            Self::Saturated => "exclude the rows with --mask saturated; a bias remains (see the page on record files)",
            Self::Quantised => "none needed; quantisation adds noise of variance step^2 / 12",
            Self::Constant => "choose another column",
        }
    }
}

hoid_model::named_choice!(QualityIssueKind, "kind of fault", 11, {
    Missing => "missing",
    Unordered => "unordered",
    Repeated => "repeated",
    Gap => "gap",
    Jitter => "jitter",
    Clock => "clock",
    Drift => "drift",
    Stalled => "stalled",
    Saturated => "saturated",
    Quantised => "quantised",
    Constant => "constant",
});

/// Consecutive rows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RowSpan {
    /// First row, counted from 1 without header and comments; for a gap, the row before the gap.
    pub row: usize,
    /// Number of rows; for a gap, the number of missing rows.
    pub rows: usize,
    /// Time of the first row, s; `None` without a time column.
    pub from_s: Option<f64>,
    /// Time of the row after the last row of the span, s.
    pub to_s: Option<f64>,
}

/// A data-quality problem found in the columns or channels.
#[derive(Debug, Clone, PartialEq)]
pub struct QualityIssue {
    /// Kind of the problem.
    pub kind: QualityIssueKind,
    /// Name of the channel; empty if the problem concerns the time or all channels.
    pub channel: String,
    /// Number of affected rows.
    pub rows: usize,
    /// Affected fraction of the examined rows.
    pub share: f64,
    /// Size in `unit`, depending on the kind: RMS jitter in s; longest duration of a gap, stall or saturation in s;
    /// relative deviation or drift of a clock; quantisation step; otherwise the number of rows.
    pub size: f64,
    /// Unit of the size.
    pub unit: String,
    /// Locations of the problem.
    pub row_spans: Vec<RowSpan>,
    /// Description as a sentence without a full stop.
    pub text: String,
}

impl fmt::Display for QualityIssue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Serialize for QualityIssue {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct SerializedIssue<'a> {
            kind: QualityIssueKind,
            channel: &'a str,
            rows: usize,
            share: f64,
            size: f64,
            unit: &'a str,
            text: &'a str,
            remedy: &'static str,
            place_count: usize,
            places: &'a [RowSpan],
        }
        SerializedIssue {
            kind: self.kind,
            channel: &self.channel,
            rows: self.rows,
            share: self.share,
            size: self.size,
            unit: &self.unit,
            text: &self.text,
            remedy: self.kind.remedy(),
            place_count: self.row_spans.len(),
            places: self.row_spans.get(..MAX_WRITTEN_PLACES).unwrap_or(&self.row_spans),
        }
        .serialize(serializer)
    }
}

/// Formats a location, such as "row 12 (0.11 s)".
pub(super) fn at(place: &RowSpan) -> String {
    match place.from_s {
        Some(s) => format!("row {} ({} s)", place.row, format_decimal(s)),
        None => format!("row {}", place.row),
    }
}
