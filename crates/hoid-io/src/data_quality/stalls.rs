//! Duplicated rows, and stalls: all channels hold their values while the time advances.
//!
//! A single channel may hold its value because the hand rests, and two coarsely quantised channels may hold at the same
//! time. The channel whose natural holds are shortest therefore decides: in a stall all channels hold for longer than
//! `min_c L_c`. For a quantised channel L is ten times the 90th percentile of the lengths of its holds. For a channel
//! in full precision L is twice its longest hold while another channel moves; this is 0 unless the channel is printed
//! with few decimals. If the minimum is 0, every hold of all channels is reported; if one of the channels is quantised,
//! holds of a single row are not reported. If only one channel moves, it is searched for stalls only if it is in full
//! precision.

use std::ops::Range;

use super::grid::Grid;
use super::issue::{QualityIssue, QualityIssueKind, RowSpan, at};
use super::signals::{Signal, Signals, row_range, runs};
use super::values::Levels;
use hoid_model::numbers::count_with_noun;

use crate::wording::format_short;

/// Finds the rows whose time does not advance: rows that equal an earlier row with the same time, and rows with other
/// values.
pub(super) fn check_non_advancing_rows(signals: &Signals<'_>, grid: &Grid, found: &mut Vec<QualityIssue>) {
    let t = |row: usize| signals.time_s(row).unwrap_or(f64::NAN);
    let same = |row: &usize| {
        let with_this_time = grid.rows.get(grid.rows.partition_point(|before| t(*before) < t(*row)));
        let earlier = row.checked_sub(1).into_iter().chain(with_this_time.copied());
        earlier.filter(|before| t(*before) == t(*row)).any(|before| {
            let repeats = |signal: &Signal<'_>| {
                let [before, value] = [before, *row].map(|row| signal.values.get(row).copied().unwrap_or(f64::NAN));
                value == before || value.is_nan()
            };
            signals.columns.iter().all(repeats)
        })
    };
    let mut late: Vec<usize> = [grid.repeated_times.as_slice(), &grid.backward_times].concat();
    late.sort_unstable();
    let (repeated, others): (Vec<usize>, Vec<usize>) = late.into_iter().partition(same);
    // After the time was set back, many rows are earlier than the latest time; only those that are not later than the
    // row before are reported.
    let falls = |row: &usize| {
        let step = signals.time.and_then(|time| time.values_around_step(*row));
        step.is_none_or(|(before, time)| time <= before)
    };
    let others: Vec<usize> = others.into_iter().filter(falls).collect();
    for (kind, rows) in [
        (QualityIssueKind::Repeated, repeated),
        (QualityIssueKind::Unordered, others),
    ] {
        let places: Vec<RowSpan> = rows.iter().map(|row| signals.row_span(&row_range(*row))).collect();
        let Some(first) = places.first() else { continue };
        let what = if kind == QualityIssueKind::Repeated {
            "duplicated, including the time"
        } else {
            "not later than the previous row, although their values differ"
        };
        found.push(QualityIssue {
            kind,
            channel: String::new(),
            rows: rows.len(),
            share: rows.len() as f64 / signals.row_count() as f64,
            size: rows.len() as f64,
            unit: "rows".to_owned(),
            text: format!(
                "{} {} {what}; the first is {}",
                count_with_noun(rows.len(), "row"),
                if rows.len() == 1 { "is" } else { "are" },
                at(first)
            ),
            row_spans: places,
        });
    }
}

pub(super) fn check_stalls(
    signals: &Signals<'_>,
    levels: &[Levels],
    grid: Option<&Grid>,
    found: &mut Vec<QualityIssue>,
) {
    let rows = signals.row_count();
    let moves = |(signal, _): &(&Signal<'_>, &Levels)| {
        let mut finite = signal.values.iter().filter(|v| v.is_finite());
        let first = finite.next();
        finite.any(|v| Some(v) != first)
    };
    let moving: Vec<(&Signal<'_>, &Levels)> = signals.columns.iter().zip(levels).filter(moves).collect();
    if moving.is_empty() || rows < 3 {
        return;
    }
    // Duplicated rows do not count as held values, because they are reported separately.
    let advances = |row: usize| grid.is_none_or(|grid| grid.repeated_times.binary_search(&row).is_err());
    let holds: Vec<Vec<bool>> = moving
        .iter()
        .map(|(signal, _)| (0..rows).map(|row| advances(row) && signal.repeats(row)).collect())
        .collect();
    let mut all = vec![true; rows];
    for held in &holds {
        all.iter_mut().zip(held).for_each(|(all, held)| *all &= held);
    }
    let limit = if let [(_, levels)] = moving.as_slice() {
        if levels.is_quantised() {
            return;
        }
        0
    } else {
        let natural = |((_, levels), held): (&(&Signal<'_>, &Levels), &Vec<bool>)| {
            if levels.is_quantised() {
                let mut lengths: Vec<usize> = runs(held.iter().copied()).iter().map(Range::len).collect();
                lengths.sort_unstable();
                let ninth = lengths.len().saturating_mul(9) / 10;
                lengths.get(ninth).map_or(0, |length| length.saturating_mul(10))
            } else {
                let alone = runs(held.iter().zip(&all).map(|(held, all)| *held && !all));
                alone
                    .iter()
                    .map(Range::len)
                    .max()
                    .map_or(0, |longest| longest.saturating_mul(2))
            }
        };
        // A channel printed with few digits holds its value at a peak. A quantised channel, which holds often, may by
        // chance hold in the same row.
        let by_chance = usize::from(moving.iter().any(|(_, levels)| levels.is_quantised()));
        moving.iter().zip(&holds).map(natural).min().unwrap_or(0).max(by_chance)
    };
    let stalled: Vec<Range<usize>> = runs(all.into_iter())
        .into_iter()
        .filter(|run| run.len() > limit)
        .collect();
    let places: Vec<RowSpan> = stalled.iter().map(|run| signals.row_span(run)).collect();
    let seconds = |place: &RowSpan| place.to_s.zip(place.from_s).map_or(0.0, |(to, from)| to - from);
    let Some(longest) = places.iter().max_by(|a, b| {
        (a.rows, seconds(a))
            .partial_cmp(&(b.rows, seconds(b)))
            .unwrap_or(std::cmp::Ordering::Equal)
    }) else {
        return;
    };
    let total: usize = stalled.iter().map(Range::len).sum();
    let size = seconds(longest);
    found.push(QualityIssue {
        kind: QualityIssueKind::Stalled,
        channel: String::new(),
        rows: total,
        share: total as f64 / rows as f64,
        size,
        unit: "s".to_owned(),
        text: format!(
            "all channels hold their values in {} ({} %), in {}; the longest hold lasts {} from {}",
            count_with_noun(total, "row"),
            format_short(100.0 * total as f64 / rows as f64),
            count_with_noun(places.len(), "place"),
            match longest.from_s {
                Some(_) => format!("{} s", format_short(size)),
                None => count_with_noun(longest.rows, "row"),
            },
            at(longest)
        ),
        row_spans: places,
    });
}
