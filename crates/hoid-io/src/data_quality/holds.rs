//! Duplicated rows, and stalls: all channels hold their values while the time continues.
//!
//! One channel may hold because the hand rests, and two in coarse steps may do so together. A stall
//! is judged by the channel whose natural holds are shortest: all channels hold for longer than
//! `min_c L_c`. For a quantised channel L is ten times the length that nine of ten of its holds do
//! not exceed; for one in full precision it is twice the longest hold while another channel moves,
//! which is 0 unless the channel is printed with few decimals: then each hold of all channels is
//! reported, unless one of them is quantised and the hold is of one row. A single channel must be
//! in full precision to be judged.

use std::ops::Range;

use super::grid::Grid;
use super::issue::{QualityIssue, QualityIssueKind, RowSpan, at};
use super::signals::{Signal, Signals};
use super::values::Levels;
use crate::wording::{counted, short};

/// Rows whose time does not advance: duplicates of the row before, and the others.
pub(super) fn standing(signals: &Signals<'_>, grid: &Grid, found: &mut Vec<QualityIssue>) {
    let same = |row: &usize| {
        *row > 0
            && signals
                .columns
                .iter()
                .all(|signal| signal.values[*row] == signal.values[row - 1] || signal.values[*row].is_nan())
    };
    let (repeated, others): (Vec<usize>, Vec<usize>) = grid.standing.iter().copied().partition(same);
    // Of the rows after a time that was set back, only the first is earlier than the row before.
    let falls = |row: &usize| {
        signals
            .time
            .is_none_or(|time| *row == 0 || time.values[*row] <= time.values[row - 1])
    };
    let mut others: Vec<usize> = others
        .into_iter()
        .chain(grid.back.iter().copied().filter(falls))
        .collect();
    others.sort_unstable();
    for (kind, rows) in [
        (QualityIssueKind::Repeated, repeated),
        (QualityIssueKind::Unordered, others),
    ] {
        let places: Vec<RowSpan> = rows.iter().map(|row| signals.place(&(*row..row + 1))).collect();
        let Some(first) = places.first() else { continue };
        let what = if kind == QualityIssueKind::Repeated {
            "duplicated, time included"
        } else {
            "not later than the row before, but with other values"
        };
        found.push(QualityIssue {
            kind,
            channel: String::new(),
            rows: rows.len(),
            share: rows.len() as f64 / signals.rows() as f64,
            size: rows.len() as f64,
            unit: "rows".to_owned(),
            text: format!(
                "{} {} {what}, the first is {}",
                counted(rows.len(), "row"),
                if rows.len() == 1 { "is" } else { "are" },
                at(first)
            ),
            places,
        });
    }
}

/// All runs of true.
fn runs(holds: impl Iterator<Item = bool>) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (row, hold) in holds.enumerate() {
        if hold {
            match runs.last_mut() {
                Some(run) if run.end == row => run.end = row + 1,
                _ => runs.push(row..row + 1),
            }
        }
    }
    runs
}

pub(super) fn stalls(signals: &Signals<'_>, levels: &[Levels], grid: Option<&Grid>, found: &mut Vec<QualityIssue>) {
    let rows = signals.rows();
    let moves = |(signal, _): &(&Signal<'_>, &Levels)| {
        let mut finite = signal.values.iter().filter(|v| v.is_finite());
        let first = finite.next();
        finite.any(|v| Some(v) != first)
    };
    let moving: Vec<(&Signal<'_>, &Levels)> = signals.columns.iter().zip(levels).filter(moves).collect();
    if moving.is_empty() || rows < 3 {
        return;
    }
    // Whether each row holds the values of the row before; duplicated rows are reported separately.
    let advances = |row: usize| grid.is_none_or(|grid| grid.standing.binary_search(&row).is_err());
    let holds: Vec<Vec<bool>> = moving
        .iter()
        .map(|(signal, _)| {
            (0..rows)
                .map(|row| row > 0 && advances(row) && signal.values[row] == signal.values[row - 1])
                .collect()
        })
        .collect();
    let all: Vec<bool> = (0..rows).map(|row| holds.iter().all(|held| held[row])).collect();
    let limit = if let [(_, levels)] = moving.as_slice() {
        if levels.is_coarse() {
            return;
        }
        0
    } else {
        let natural = |((_, levels), held): (&(&Signal<'_>, &Levels), &Vec<bool>)| {
            if levels.is_coarse() {
                let mut lengths: Vec<usize> = runs(held.iter().copied()).iter().map(Range::len).collect();
                lengths.sort_unstable();
                lengths.get(lengths.len() * 9 / 10).map_or(0, |length| 10 * length)
            } else {
                let alone = runs((0..rows).map(|row| held[row] && !all[row]));
                2 * alone.iter().map(Range::len).max().unwrap_or(0)
            }
        };
        // A channel printed with few digits, which holds at a peak, may by chance do so together with a quantised
        // channel, which holds often.
        let by_chance = usize::from(moving.iter().any(|(_, levels)| levels.is_coarse()));
        moving.iter().zip(&holds).map(natural).min().unwrap_or(0).max(by_chance)
    };
    let stalled: Vec<Range<usize>> = runs(all.into_iter())
        .into_iter()
        .filter(|run| run.len() > limit)
        .collect();
    let places: Vec<RowSpan> = stalled.iter().map(|run| signals.place(run)).collect();
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
            "all channels hold their values in {} ({} %), in {}; the longest is {} from {}",
            counted(total, "row"),
            short(100.0 * total as f64 / rows as f64),
            counted(places.len(), "place"),
            match longest.from_s {
                Some(_) => format!("{} s", short(size)),
                None => counted(longest.rows, "row"),
            },
            at(longest)
        ),
        places,
    });
}
