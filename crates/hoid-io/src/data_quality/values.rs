//! Saturation, quantisation, constants and missing values of one channel.
//!
//! A channel is quantised if at most half of its finite values are distinct (of a long channel, see [`EXAMINED_ROWS`])
//! and the distinct values lie on a grid within `1e-3 q`, where q is the smallest step between two of them. The
//! smallest and the largest value need not be on the grid: they may be the end stops of a stick.
//!
//! A channel is saturated at a limit if it stays there longer than is possible at a peak. In full precision no two
//! consecutive values are equal by chance, so three successive rows at the extreme value count as saturation. In a
//! quantised channel a peak stays longest at its top level: a parabola whose top is at the far edge of the last step
//! stays there 3 times as long as, on average, at each of the next three levels. Saturation of a quantised channel is
//! reported if the number of rows at the extreme is at least 6 times this average, with one stay of at least 5 rows and
//! at least two stays of 3 or more rows.

use std::ops::Range;

use super::issue::{QualityIssue, QualityIssueKind, RowSpan, at};
use super::signals::{Signal, Signals, runs};
use crate::time::sampling::steps;
use hoid_model::numbers::count_with_noun;

use crate::wording::format_short;

/// Smallest reported quantisation step, relative to the standard deviation; its quantisation noise has 1e-5 of the
/// power of the signal.
const MIN_QUANTUM_RATIO: f64 = 1e-2;
/// Number of consecutive rows at the extreme that count as saturation, for channels in full precision and for quantised
/// channels.
const MIN_SATURATED_ROWS: (usize, usize) = (3, 5);
/// Smallest ratio, in a saturated quantised channel, of the number of rows at the limit to the average number at each
/// of the next three levels.
const MIN_PEAK_RATIO: usize = 6;

/// Number of rows at the start of a long channel (hours of recording) that are examined first. If more than half of
/// their values are distinct, the channel counts as full precision, because sorting all values would take longer than
/// reading them.
const EXAMINED_ROWS: usize = 1 << 20;

/// A saturation limit of a channel.
pub(crate) struct SaturationLimit {
    /// The value at the limit.
    pub(crate) value: f64,
    pub(crate) is_upper: bool,
    /// Row ranges in which the channel stays at the limit.
    pub(crate) row_ranges: Vec<Range<usize>>,
}

impl SaturationLimit {
    /// Returns the number of rows at the limit.
    pub(crate) fn row_count(&self) -> usize {
        self.row_ranges.iter().map(Range::len).sum()
    }
}

/// Distinct finite values of a channel; values that differ only by rounding count as one.
pub(crate) struct Levels {
    count: usize,
    /// Number of rows of the channel, and number of rows with a finite value.
    rows: usize,
    finite: usize,
    /// Levels in increasing order: all levels of a quantised channel, otherwise the levels at both ends.
    values: Vec<f64>,
}

impl Levels {
    /// Number of levels kept at each end of a channel in full precision.
    const LEVELS_PER_END: usize = 4;

    pub(crate) fn of(values: &[f64]) -> Self {
        Self::from_first_values(values, EXAMINED_ROWS)
    }

    /// Determines the levels; if most of the first `most` values are distinct, all values count as distinct.
    fn from_first_values(values: &[f64], most: usize) -> Self {
        let rows = values.len();
        let finite = values.iter().filter(|v| v.is_finite()).count();
        if let Some((start, [_, ..])) = values.split_at_checked(most) {
            let first = distinct_values(start);
            if first.len() > most / 2 && first.len() > 2 * Self::LEVELS_PER_END {
                return Self {
                    count: rows,
                    rows,
                    finite,
                    values: end_levels(values, &first),
                };
            }
        }
        let mut levels = distinct_values(values);
        let count = levels.len();
        if count > rows / 2 {
            keep_only_ends(&mut levels);
            levels.shrink_to_fit();
        }
        Self {
            count,
            rows,
            finite,
            values: levels,
        }
    }

    /// True if there are at most half as many levels as rows.
    pub(super) fn is_quantised(&self) -> bool {
        self.count <= self.rows / 2
    }

    /// Returns the step of the grid on which all values lie, except possibly the smallest and the largest, and the
    /// number of levels; `None` if there is no such grid.
    pub(crate) fn quantum(&self) -> Option<(f64, usize)> {
        if self.count < 2 || self.count > self.finite / 2 {
            return None;
        }
        let inner = match self.values.as_slice() {
            [_, inner @ .., _] if self.count > 4 => inner,
            all => all,
        };
        let first = inner.first()?;
        let step = steps(inner).fold(f64::INFINITY, f64::min);
        let off = |level: &f64| {
            let steps = (level - first) / step;
            (steps - steps.round()).abs()
        };
        (step > 0.0 && step.is_finite() && inner.iter().all(|level| off(level) < 1e-3)).then_some((step, self.count))
    }
}

/// Returns the distinct finite values in increasing order.
fn distinct_values(values: &[f64]) -> Vec<f64> {
    let mut levels: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    levels.sort_unstable_by(f64::total_cmp);
    levels.dedup();
    if let [first, .., last] = levels.as_slice() {
        let least = 1e-12 * (last - first);
        let mut kept: Option<f64> = None;
        levels.retain(|level| {
            let keep = kept.is_none_or(|kept| level - kept > least);
            if keep {
                kept = Some(*level);
            }
            keep
        });
    }
    levels
}

/// Returns the levels at both ends of all values. Only values at or beyond the end levels of `first`, the distinct
/// values of the first rows, are sorted.
fn end_levels(values: &[f64], first: &[f64]) -> Vec<f64> {
    let (lower, upper) = (
        first.get(Levels::LEVELS_PER_END - 1),
        first.iter().nth_back(Levels::LEVELS_PER_END - 1),
    );
    let is_outer = |v: &f64| lower.is_some_and(|lower| v <= lower) || upper.is_some_and(|upper| v >= upper);
    let outer: Vec<f64> = values.iter().copied().filter(is_outer).collect();
    // Relative to a later value of another order of magnitude, the end levels of `first` may count as a single level.
    let mut levels = distinct_values(&outer);
    keep_only_ends(&mut levels);
    levels
}

/// Removes all levels but those at both ends.
fn keep_only_ends(levels: &mut Vec<f64>) {
    let upper = levels.len().saturating_sub(Levels::LEVELS_PER_END);
    if upper > Levels::LEVELS_PER_END {
        levels.drain(Levels::LEVELS_PER_END..upper);
    }
}

/// Returns the saturation limits of a channel, the lower one first.
pub(crate) fn saturation_limits(values: &[f64], levels: &Levels) -> Vec<SaturationLimit> {
    if levels.count < 4 {
        // A switch or a constant signal has fewer than four levels and stays at its extremes by nature.
        return Vec::new();
    }
    let (coarse, levels) = (levels.is_quantised(), &levels.values);
    let count = |level: f64| values.iter().filter(|v| **v == level).count();
    let rail = |is_upper: bool| {
        let (extreme, next) = match (levels.as_slice(), is_upper) {
            ([.., a, b, c, extreme], true) | ([extreme, a, b, c, ..], false) => (*extreme, [*a, *b, *c]),
            _ => return None,
        };
        let stays = runs(values.iter().map(|v| *v == extreme));
        let rows: usize = stays.iter().map(Range::len).sum();
        let next_count: usize = next.into_iter().map(count).sum();
        // A stay at the start or end of the record does not count: the signal may have settled there.
        let inner = || {
            stays
                .iter()
                .filter(|stay| stay.start > 0 && stay.end < values.len())
                .map(Range::len)
        };
        let longest = inner().max().unwrap_or(0);
        let stayed = inner().filter(|length| *length >= MIN_SATURATED_ROWS.0).count();
        let is_rail = if coarse {
            longest >= MIN_SATURATED_ROWS.1
                && rows.saturating_mul(3) >= MIN_PEAK_RATIO.saturating_mul(next_count)
                && stayed > 1
        } else {
            longest >= MIN_SATURATED_ROWS.0
        };
        is_rail.then_some(SaturationLimit {
            value: extreme,
            is_upper,
            row_ranges: stays,
        })
    };
    [rail(false), rail(true)].into_iter().flatten().collect()
}

pub(super) fn check_values(signals: &Signals<'_>, signal: Signal<'_>, levels: &Levels, found: &mut Vec<QualityIssue>) {
    let values = signal.values;
    let n = values.len();
    let name = signal.name;
    let mut tell = |kind, rows: usize, size: f64, unit: &str, places, text| {
        found.push(QualityIssue {
            kind,
            channel: name.to_owned(),
            rows,
            share: rows as f64 / n as f64,
            size,
            unit: unit.to_owned(),
            row_spans: places,
            text,
        });
    };
    check_missing(signals, signal, &mut tell);
    let finite = || values.iter().filter(|v| v.is_finite());
    let Some(first) = finite().next() else { return };
    if finite().all(|v| v == first) {
        if n > 1 {
            let text = format!("{name} is constant: {}", format_short(*first));
            tell(
                QualityIssueKind::Constant,
                n,
                0.0,
                "",
                vec![signals.row_span(&(0..n))],
                text,
            );
        }
        return;
    }
    for rail in saturation_limits(values, levels) {
        let places: Vec<RowSpan> = rail.row_ranges.iter().map(|stay| signals.row_span(stay)).collect();
        let seconds = |place: &RowSpan| place.to_s.zip(place.from_s).map_or(0.0, |(to, from)| to - from);
        let longest = places.iter().map(seconds).fold(0.0, f64::max);
        let text = format!(
            "{name} stays at its {} value, {}, in {} ({} %), in {}; the first is {}",
            if rail.is_upper { "largest" } else { "smallest" },
            format_short(rail.value),
            count_with_noun(rail.row_count(), "row"),
            format_short(100.0 * rail.row_count() as f64 / n as f64),
            count_with_noun(places.len(), "place"),
            places.first().map(at).unwrap_or_default()
        );
        tell(
            QualityIssueKind::Saturated,
            rail.row_count(),
            longest,
            "s",
            places,
            text,
        );
    }
    let count = levels.finite as f64;
    let mean = finite().map(|v| v / count).sum::<f64>();
    let deviation = finite().map(|v| (v - mean).powi(2) / count).sum::<f64>().sqrt();
    if let Some((step, count)) = levels
        .quantum()
        .filter(|(step, _)| *step >= MIN_QUANTUM_RATIO * deviation)
    {
        let text = format!(
            "{name} is quantised: {count} levels in steps of {} ({} % of its standard deviation)",
            format_short(step),
            format_short(100.0 * step / deviation)
        );
        tell(QualityIssueKind::Quantised, n, step, "", Vec::new(), text);
    }
}

fn check_missing(
    signals: &Signals<'_>,
    signal: Signal<'_>,
    tell: &mut impl FnMut(QualityIssueKind, usize, f64, &str, Vec<RowSpan>, String),
) {
    let gone = runs(signal.values.iter().map(|v| !v.is_finite()));
    let places: Vec<RowSpan> = gone.iter().map(|run| signals.row_span(run)).collect();
    let Some(first) = places.first() else { return };
    let rows: usize = gone.iter().map(Range::len).sum();
    let text = format!(
        "{} has no finite value in {} ({} %); the first is {}",
        signal.name,
        count_with_noun(rows, "row"),
        format_short(100.0 * rows as f64 / signal.values.len() as f64),
        at(first)
    );
    tell(QualityIssueKind::Missing, rows, rows as f64, "rows", places, text);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An outlier of another order of magnitude after the first rows: relative to it, the lowest levels count as a
    /// single level.
    #[test]
    fn outlier_in_a_long_channel_is_not_saturation() {
        for outlier in [1e30, -1e30, 1e308] {
            let mut values: Vec<f64> = (0..200).map(|k| (0.37 * f64::from(k)).sin()).collect();
            (values[150], values[151]) = (outlier, -0.5 * outlier);
            let quick = Levels::from_first_values(&values, 64);
            assert!(quick.values.len() < 4 && saturation_limits(&values, &quick).is_empty());
        }
    }

    #[test]
    fn first_rows_decide_whether_a_channel_is_quantised() {
        let wave = |k: usize| (0.37 * k as f64).sin() + 0.3 * (1.01 * k as f64).cos();
        let mut values: Vec<f64> = (0..4000).map(wave).collect();
        values[3000..3005].fill(2.0);
        values[3500] = f64::NAN;
        for most in [64, 1000, 3999] {
            let (quick, all) = (Levels::from_first_values(&values, most), Levels::of(&values));
            assert_eq!((&quick.values, quick.finite), (&all.values, 3999));
            assert!(!quick.is_quantised() && quick.quantum().is_none());
            let found = saturation_limits(&values, &quick);
            assert_eq!((found.len(), found[0].value, found[0].row_ranges.len()), (1, 2.0, 1));
            assert_eq!(found[0].row_ranges[0], 3000..3005);
        }
        // All rows of the quantised channel are examined, because its largest level occurs in one of the last rows.
        let mut coarse: Vec<f64> = values.iter().map(|v| (10.0 * v).round() / 10.0).collect();
        coarse[3990] = 7.0;
        let found = Levels::from_first_values(&coarse, 64);
        assert!(found.is_quantised() && found.values.last() == Some(&7.0));
    }
}
