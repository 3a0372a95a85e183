//! The time compared with its evenly spaced grid: jitter, missing rows, a clock with a wrong or drifting rate.

use super::grid::{Grid, slope};
use super::issue::{QualityIssue, QualityIssueKind, RowSpan, at};
use super::signals::{Signals, row_range};
use crate::table::Precision;
use hoid_model::numbers::count_with_noun;

use crate::wording::{format_decimal, format_short};

/// Deviation from the grid, in sample times, above which jitter is reported; the module `time::sampling` has the same
/// limit.
const JITTER_LIMIT: f64 = 1e-3;
/// Relative deviation of a clock from a given rate above which the deviation is reported; crystals are accurate to
/// 1e-4.
const MAX_RATE_DEVIATION: f64 = 2e-4;
/// Limits of the relative deviation from the nearest common rate, if no rate was given: a deviation between them is
/// reported as a clock error, while a larger one means another rate.
const COMMON_RATE_DEVIATION_LIMITS: (f64, f64) = (5e-4, 1e-2);
/// Common sampling rates of recorders, Hz.
const COMMON_RATES_HZ: [f64; 42] = [
    1.0, 2.0, 4.0, 5.0, 8.0, 10.0, 12.5, 15.0, 16.0, 20.0, 24.0, 25.0, 29.97, 30.0, 32.0, 40.0, 50.0, 59.94, 60.0,
    64.0, 75.0, 80.0, 90.0, 100.0, 119.88, 120.0, 125.0, 128.0, 144.0, 150.0, 200.0, 240.0, 250.0, 256.0, 300.0, 400.0,
    500.0, 512.0, 600.0, 1000.0, 1024.0, 2000.0,
];

/// Returns the largest rounding error of a time: one unit of the last printed digit; if all times are single-precision
/// numbers, at least the resolution of single precision.
fn rounding_error(t: &[f64], precision: Precision) -> f64 {
    let largest = t
        .iter()
        .copied()
        .filter(|t| t.is_finite())
        .fold(0.0, |m: f64, t| m.max(t.abs()));
    let single = t.iter().all(|t| !t.is_finite() || f64::from(*t as f32) == *t);
    let ulp = if single { largest * f64::from(f32::EPSILON) } else { 0.0 };
    precision.unit(largest).max(ulp)
}

pub(super) fn check_timing(signals: &Signals<'_>, grid: &Grid, found: &mut Vec<QualityIssue>) {
    let Some(time) = signals.time else { return };
    let (t, ts) = (time.values, grid.sample_time_s);
    if !(ts > 0.0 && ts.is_finite()) {
        return;
    }
    let rows = signals.row_count();
    check_gaps(signals, grid, found);
    let unit = rounding_error(t, signals.precision).min(ts);
    let jitter = grid.jitter(t);
    if let Some((rms, worst, row)) =
        jitter.filter(|(_, worst, _)| *worst > (JITTER_LIMIT * ts).max(unit * (1.0 + 1e-6)))
    {
        let index = signals.row_span(&row_range(row));
        found.push(QualityIssue {
            kind: QualityIssueKind::Jitter,
            channel: String::new(),
            rows,
            share: 1.0,
            size: rms,
            unit: "s".to_owned(),
            text: format!(
                "t has a jitter of {} s RMS about an even grid of {} s ({} % of the sample time); the largest deviation is {} s at {}",
                format_short(rms),
                format_short(ts),
                format_short(100.0 * rms / ts),
                format_short(worst),
                at(&index)
            ),
            row_spans: vec![index],
        });
    }
    let rms = jitter.map_or(0.0, |(rms, ..)| rms).max(unit / 12_f64.sqrt());
    check_rate(signals, grid, rms, unit, found);
    check_drift(signals, grid, rms, unit, found);
    check_second_clocks(signals, grid, found);
}

fn check_gaps(signals: &Signals<'_>, grid: &Grid, found: &mut Vec<QualityIssue>) {
    let places: Vec<RowSpan> = grid
        .gaps()
        .map(|(before, after, missing)| RowSpan {
            rows: missing as usize,
            from_s: signals.time_s(before),
            to_s: signals.time_s(after),
            ..signals.row_span(&row_range(before))
        })
        .collect();
    let Some(first) = places.first() else { return };
    let missing = places.iter().fold(0_usize, |sum, index| sum.saturating_add(index.rows));
    let longest = places
        .iter()
        .filter_map(|index| Some(index.to_s? - index.from_s?))
        .fold(0.0, f64::max);
    found.push(QualityIssue {
        kind: QualityIssueKind::Gap,
        channel: String::new(),
        rows: missing,
        share: missing as f64 / (missing as f64 + signals.row_count() as f64),
        size: longest,
        unit: "s".to_owned(),
        text: format!(
            "{} missing in {}, the first after {}; the longest step is {} s",
            count_with_noun(missing, "row"),
            count_with_noun(places.len(), "place"),
            at(first),
            format_short(longest)
        ),
        row_spans: places,
    });
}

/// Compares the sampling rate with the given rate or, if no rate is given, with the nearest common rate.
fn check_rate(signals: &Signals<'_>, grid: &Grid, rms: f64, unit: f64, found: &mut Vec<QualityIssue>) {
    let (ts, n) = (grid.sample_time_s, grid.rows.len() as f64);
    // Uncertainty of the slope from jitter, and from rounding of the first and the last time.
    let uncertain = 5.0 * (rms * 12_f64.sqrt() / n.powf(1.5)).max(unit / n / 5.0) / ts;
    let hz = 1.0 / ts;
    let typical = || {
        COMMON_RATES_HZ
            .into_iter()
            .min_by(|a, b| (a / hz).ln().abs().total_cmp(&(b / hz).ln().abs()))
            .filter(|typical| {
                let off = (hz / typical - 1.0).abs();
                off > COMMON_RATE_DEVIATION_LIMITS.0 && off < COMMON_RATE_DEVIATION_LIMITS.1
            })
    };
    let (expected, given) = match signals.nominal_hz {
        Some(given) => (given, true),
        None => match typical() {
            Some(typical) => (typical, false),
            None => return,
        },
    };
    let off = hz / expected - 1.0;
    if !(off.abs() > MAX_RATE_DEVIATION.max(uncertain) && off.is_finite()) {
        return;
    }
    let way = if off > 0.0 { "slow" } else { "fast" };
    let (what, unless) = if given {
        ("expected", String::new())
    } else {
        (
            "close to the common rate of",
            format!(", unless the recorder does run at {hz:.4} Hz"),
        )
    };
    found.push(QualityIssue {
        kind: QualityIssueKind::Clock,
        channel: String::new(),
        rows: signals.row_count(),
        share: 1.0,
        size: off,
        unit: "1".to_owned(),
        text: format!(
            "t gives {hz:.4} Hz, {what} {} Hz: the clock of t runs {way} by {} %{unless}",
            format_short(expected),
            format_short(100.0 * off.abs())
        ),
        row_spans: Vec::new(),
    });
}

/// Compares the sample time in the last third of the record with that in the first third.
fn check_drift(signals: &Signals<'_>, grid: &Grid, rms: f64, unit: f64, found: &mut Vec<QualityIssue>) {
    let Some(time) = signals.time else { return };
    let third = grid.rows.len() / 3;
    if third < 100 {
        return;
    }
    let of = |from: usize| {
        let times = grid.rows.iter().skip(from).take(third);
        let times: Vec<f64> = times.filter_map(|row| time.values.get(*row).copied()).collect();
        slope(&times, grid.steps.get(from..).unwrap_or_default())
    };
    let (first, last) = (of(0), of(grid.rows.len().saturating_sub(third)));
    let change = last / first - 1.0;
    let n = third as f64;
    let uncertain = 8.0 * (rms * 12_f64.sqrt() / n.powf(1.5)).max(unit / n / 4.0) / grid.sample_time_s;
    if change.is_nan() || change.abs() <= MAX_RATE_DEVIATION.max(uncertain) {
        return;
    }
    found.push(QualityIssue {
        kind: QualityIssueKind::Drift,
        channel: String::new(),
        rows: signals.row_count(),
        share: 1.0,
        size: change,
        unit: "1".to_owned(),
        text: format!(
            "the sample time changes over the record: {} s in the first third, {} s in the last third ({} %)",
            format_decimal(first),
            format_decimal(last),
            format_short(100.0 * change)
        ),
        row_spans: Vec::new(),
    });
}

/// Compares the rates of the other time columns, which are in s, ms, us or ns, with the rate of the time.
fn check_second_clocks(signals: &Signals<'_>, grid: &Grid, found: &mut Vec<QualityIssue>) {
    let Some(time) = signals.time else { return };
    for clock in &signals.clocks {
        let pairs: Vec<(f64, f64)> = grid
            .rows
            .iter()
            .filter_map(|row| Some((*time.values.get(*row)?, *clock.values.get(*row)?)))
            .filter(|(_, c)| c.is_finite())
            .collect();
        let (&[first, .., last], true) = (pairs.as_slice(), pairs.is_sorted_by(|a, b| b.1 >= a.1)) else {
            continue;
        };
        let ratio = (last.1 - first.1) / (last.0 - first.0);
        let Some(off) = [1.0, 1e3, 1e6, 1e9]
            .into_iter()
            .map(|unit| ratio / unit - 1.0)
            .find(|off| off.abs() < 0.1)
        else {
            continue;
        };
        // The first and last times determine the ratio of the rates up to a jitter of one row at each end.
        let uncertain = 2.0 / pairs.len() as f64;
        if off.abs() <= MAX_RATE_DEVIATION.max(uncertain) {
            continue;
        }
        found.push(QualityIssue {
            kind: QualityIssueKind::Clock,
            channel: clock.name.to_owned(),
            rows: signals.row_count(),
            share: 1.0,
            size: off,
            unit: "1".to_owned(),
            text: format!(
                "{} runs {} % {} than t: one of the two clocks is wrong",
                clock.name,
                format_short(100.0 * off.abs()),
                if off > 0.0 { "faster" } else { "slower" }
            ),
            row_spans: Vec::new(),
        });
    }
}
