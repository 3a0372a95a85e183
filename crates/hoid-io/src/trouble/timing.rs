//! The even grid behind a recorded time, and how the time differs from it.
//!
//! Row i stands at `t_i = t_0 + k_i Ts + jitter`, with whole k that grow by one from row to row, and by more where rows are missing. The
//! k are found by a phase that follows the times, `k_i - k_{i-1} = round((t_i - g) / Ts)` with `g` pulled a small share of the way to each
//! time: jitter of nearly half a sample is then no gap. A row taken too far is given back when the next seems to stand. Ts is the
//! slope of least squares, found twice.
//!
//! The jitter is the deviation from straight lines over parts of 256 rows without a gap, so that a slow drift is none.

use super::{Signals, Trouble, TroubleKind, at, counted, short};
use crate::{preparation::decimal, table::Precision};

/// Deviation from the grid that is no jitter, sample times; that of `sampling`.
const JITTER: f64 = 1e-3;
/// Rows of a part, and the fewest that make one.
const PART: usize = 256;
const LEAST_PART: usize = 5;
/// A gap of so many rows is a pause, behind which the grid begins anew.
const PAUSE: f64 = 10.0;
/// Rows within which a step that was taken too far is set right.
const NEAR: usize = 4;
/// Times that say where a grid begins.
const BEGIN: usize = 8;
/// Relative deviation of a clock from a given rate that is told; crystals are within 1e-4.
const OFF: f64 = 2e-4;
/// The same from a usual rate that nobody gave, and the farthest that still looks like it.
const OFF_USUAL: (f64, f64) = (5e-4, 1e-2);
/// Usual rates of recorders, Hz.
const USUAL_HZ: [f64; 42] = [
    1.0, 2.0, 4.0, 5.0, 8.0, 10.0, 12.5, 15.0, 16.0, 20.0, 24.0, 25.0, 29.97, 30.0, 32.0, 40.0, 50.0, 59.94, 60.0,
    64.0, 75.0, 80.0, 90.0, 100.0, 119.88, 120.0, 125.0, 128.0, 144.0, 150.0, 200.0, 240.0, 250.0, 256.0, 300.0, 400.0,
    500.0, 512.0, 600.0, 1000.0, 1024.0, 2000.0,
];

/// Where the rows stand on an even grid.
pub(crate) struct Grid {
    /// Rows whose time is later than that of all before.
    pub(crate) rows: Vec<usize>,
    /// Steps of the grid from each of them to the one before; 1 where no row is missing.
    pub(crate) steps: Vec<f64>,
    /// Sample time, s; NaN where fewer than two rows advance.
    pub(crate) sample_time_s: f64,
    /// Rows whose time stands still.
    pub(super) standing: Vec<usize>,
    /// Rows whose time lies before that of an earlier row.
    pub(super) back: Vec<usize>,
}

impl Grid {
    pub(crate) fn of(t: &[f64]) -> Self {
        let (mut rows, mut standing, mut back) = (Vec::new(), Vec::new(), Vec::new());
        let mut last = f64::NEG_INFINITY;
        for (row, t) in t.iter().enumerate().filter(|(_, t)| t.is_finite()) {
            if *t > last {
                rows.push(row);
                last = *t;
            } else if *t == last {
                standing.push(row);
            } else {
                back.push(row);
            }
        }
        let times: Vec<f64> = rows.iter().map(|row| t[*row]).collect();
        // The median of single steps is exact without jitter; that of sixteen at once sees through it, where few rows are missing.
        let median = |length: usize| {
            let mut spans: Vec<f64> = times
                .windows(length + 1)
                .map(|w| (w[length] - w[0]) / length as f64)
                .collect();
            let middle = spans.len() / 2;
            (!spans.is_empty()).then(|| *spans.select_nth_unstable_by(middle, f64::total_cmp).1)
        };
        let mut sample_time_s = f64::NAN;
        if let Some(single) = median(1) {
            sample_time_s = median(16)
                .filter(|many| (many / single - 1.0).abs() < 0.03)
                .unwrap_or(single);
        }
        let mut steps = vec![1.0; rows.len()];
        if sample_time_s.is_finite() {
            for pull in [0.1, 0.02] {
                follow(&times, sample_time_s, pull, &mut steps);
                let slope = slope(&times, &steps);
                if slope.is_finite() && slope > 0.0 {
                    sample_time_s = slope;
                }
            }
        }
        Self {
            rows,
            steps,
            sample_time_s,
            standing,
            back,
        }
    }

    /// Gaps: position of the row before among the rows that advance, and rows missing.
    pub(crate) fn gaps(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        (1..self.steps.len())
            .filter(|i| self.steps[*i] > 1.5)
            .map(|i| (i - 1, self.steps[i] - 1.0))
    }

    /// Deviation from lines over parts without a gap: RMS, and the largest with its row; none where no part is long enough.
    pub(crate) fn jitter(&self, t: &[f64]) -> Option<(f64, f64, usize)> {
        let (mut squares, mut freedom) = (0.0, 0);
        let mut worst = (0.0, 0);
        let mut start = 0;
        while start < self.rows.len() {
            let mut end = start + 1;
            while end < self.rows.len() && end - start < PART && self.steps[end] < 1.5 {
                end += 1;
            }
            if end - start >= LEAST_PART {
                let times: Vec<f64> = self.rows[start..end]
                    .iter()
                    .map(|row| t[*row] - t[self.rows[start]])
                    .collect();
                let n = times.len() as f64;
                let slope = slope(&times, &vec![1.0; times.len()]);
                let mean = times.iter().sum::<f64>() / n;
                for (i, time) in times.iter().enumerate() {
                    let off = (time - mean - slope * (i as f64 - 0.5 * (n - 1.0))).abs();
                    squares += off * off;
                    if off > worst.0 {
                        worst = (off, self.rows[start + i]);
                    }
                }
                freedom += times.len() - 2;
            }
            start = end;
        }
        (freedom > 0).then(|| ((squares / freedom as f64).sqrt(), worst.0, worst.1))
    }
}

/// Steps of the grid from row to row, one of each time.
fn follow(times: &[f64], ts: f64, pull: f64, steps: &mut [f64]) {
    steps.fill(1.0);
    let mut owed: Option<usize> = None;
    // Where a grid begins, the first times together say where it lies: one alone is off by its jitter.
    let begin = |i: usize| {
        let ahead = times[i..]
            .iter()
            .take(BEGIN)
            .enumerate()
            .map(|(j, t)| t - j as f64 * ts);
        let near: Vec<f64> = ahead.filter(|t| (t - times[i]).abs() < 1.5 * ts).collect();
        near.iter().sum::<f64>() / near.len() as f64
    };
    let (mut phase, mut known) = (begin(0), BEGIN as f64);
    for i in 1..times.len() {
        let mut step = ((times[i] - phase) / ts).round();
        if step >= PAUSE {
            let anew = begin(i);
            step = ((anew - phase) / ts).round();
            (phase, known) = (anew, BEGIN as f64);
        } else {
            phase += step * ts;
            phase += f64::max(pull, 1.0 / (known + 1.0)) * (times[i] - phase);
        }
        known += 1.0;
        steps[i] = step.max(1.0);
        // What seems to stand gives back what an early time took, or is owed what the next one takes.
        if step < 1.0 {
            match (i.saturating_sub(NEAR)..i).rev().find(|j| steps[*j] > 1.5) {
                Some(taken) => steps[taken] -= 1.0,
                None => owed = Some(i),
            }
        } else if step > 1.5 && owed.take_if(|at| i - *at <= NEAR).is_some() {
            steps[i] -= 1.0;
        }
    }
}

/// Slope of least squares of the times over the grid.
fn slope(times: &[f64], steps: &[f64]) -> f64 {
    // Counted anew for each sum: a record of hours has no room for its indices.
    let indexed = || {
        let mut index = 0.0;
        times.iter().zip(steps).enumerate().map(move |(i, (time, step))| {
            if i > 0 {
                index += step;
            }
            (index, *time)
        })
    };
    let n = times.len() as f64;
    // Scaled by n before they are summed, so that nothing overflows that has a meaning.
    let x = indexed().map(|(index, _)| index / n).sum::<f64>();
    let y = times.iter().map(|t| t / n).sum::<f64>();
    let covariance: f64 = indexed().map(|(index, time)| (index - x) * (time - y)).sum();
    covariance / indexed().map(|(index, _)| (index - x) * (index - x)).sum::<f64>()
}

/// How far rounding may move a time: one unit of the last printed digit, or of single precision.
fn rounding(t: &[f64], precision: Precision) -> f64 {
    let largest = t
        .iter()
        .copied()
        .filter(|t| t.is_finite())
        .fold(0.0, |m: f64, t| m.max(t.abs()));
    let single = t.iter().all(|t| !t.is_finite() || f64::from(*t as f32) == *t);
    let ulp = if single { largest * f64::from(f32::EPSILON) } else { 0.0 };
    precision.unit(largest).max(ulp)
}

pub(super) fn find(signals: &Signals<'_>, grid: &Grid, found: &mut Vec<Trouble>) {
    let Some(time) = signals.time else { return };
    let (t, ts) = (time.values, grid.sample_time_s);
    if !(ts > 0.0 && ts.is_finite()) {
        return;
    }
    let rows = signals.rows();
    gaps(signals, grid, found);
    let unit = rounding(t, signals.precision).min(ts);
    let jitter = grid.jitter(t);
    if let Some((rms, worst, row)) = jitter.filter(|(_, worst, _)| *worst > (JITTER * ts).max(unit * (1.0 + 1e-6))) {
        let place = signals.place(&(row..row + 1));
        found.push(Trouble {
            kind: TroubleKind::Jitter,
            channel: String::new(),
            rows,
            share: 1.0,
            size: rms,
            unit: "s".to_owned(),
            text: format!(
                "the times jitter by {} s RMS around an even grid of {} s ({} % of a sample), at most by {} s at {}",
                short(rms),
                short(ts),
                short(100.0 * rms / ts),
                short(worst),
                at(&place)
            ),
            places: vec![place],
        });
    }
    let rms = jitter.map_or(0.0, |(rms, ..)| rms).max(unit / 12_f64.sqrt());
    rate(signals, grid, rms, unit, found);
    drift(signals, grid, rms, unit, found);
    second_clocks(signals, grid, found);
}

fn gaps(signals: &Signals<'_>, grid: &Grid, found: &mut Vec<Trouble>) {
    let places: Vec<super::Place> = grid
        .gaps()
        .map(|(i, missing)| super::Place {
            row: signals.before + grid.rows[i] + 1,
            rows: missing as usize,
            from_s: signals.at_s(grid.rows[i]),
            to_s: signals.at_s(grid.rows[i + 1]),
        })
        .collect();
    let Some(first) = places.first() else { return };
    let missing = places.iter().fold(0_usize, |sum, place| sum.saturating_add(place.rows));
    let longest = places
        .iter()
        .filter_map(|place| Some(place.to_s? - place.from_s?))
        .fold(0.0, f64::max);
    found.push(Trouble {
        kind: TroubleKind::Gap,
        channel: String::new(),
        rows: missing,
        share: missing as f64 / (missing as f64 + signals.rows() as f64),
        size: longest,
        unit: "s".to_owned(),
        text: format!(
            "{} missing in {}, the first behind {}; the longest step is {} s",
            counted(missing, "row"),
            counted(places.len(), "place"),
            at(first),
            short(longest)
        ),
        places,
    });
}

/// The rate against the one that was given, or the usual one that it nearly is.
fn rate(signals: &Signals<'_>, grid: &Grid, rms: f64, unit: f64, found: &mut Vec<Trouble>) {
    let (ts, n) = (grid.sample_time_s, grid.rows.len() as f64);
    // Standard error of a slope, and what rounding of the ends can do.
    let uncertain = 5.0 * (rms * 12_f64.sqrt() / n.powf(1.5)).max(unit / n / 5.0) / ts;
    let hz = 1.0 / ts;
    let usual = || {
        USUAL_HZ
            .into_iter()
            .min_by(|a, b| (a / hz).ln().abs().total_cmp(&(b / hz).ln().abs()))
            .filter(|usual| {
                let off = (hz / usual - 1.0).abs();
                off > OFF_USUAL.0 && off < OFF_USUAL.1
            })
    };
    let (expected, given) = match signals.nominal_hz {
        Some(given) => (given, true),
        None => match usual() {
            Some(usual) => (usual, false),
            None => return,
        },
    };
    let off = hz / expected - 1.0;
    if !(off.abs() > OFF.max(uncertain) && off.is_finite()) {
        return;
    }
    let way = if off > 0.0 { "slow" } else { "fast" };
    let what = if given { "where" } else { "which would be" };
    found.push(Trouble {
        kind: TroubleKind::Clock,
        channel: String::new(),
        rows: signals.rows(),
        share: 1.0,
        size: off,
        unit: "1".to_owned(),
        text: format!(
            "t gives {hz:.4} Hz {what} {} Hz {}: the clock of t runs {way} by {} %{}",
            short(expected),
            if given { "were expected" } else { "is usual" },
            short(100.0 * off.abs()),
            if given {
                ""
            } else {
                ", if that is not the rate of the recorder"
            }
        ),
        places: Vec::new(),
    });
}

/// The rate of the first third against that of the last.
fn drift(signals: &Signals<'_>, grid: &Grid, rms: f64, unit: f64, found: &mut Vec<Trouble>) {
    let Some(time) = signals.time else { return };
    let third = grid.rows.len() / 3;
    if third < 100 {
        return;
    }
    let of = |from: usize| {
        let times: Vec<f64> = grid.rows[from..from + third]
            .iter()
            .map(|row| time.values[*row])
            .collect();
        slope(&times, &grid.steps[from..from + third])
    };
    let (first, last) = (of(0), of(grid.rows.len() - third));
    let change = last / first - 1.0;
    let n = third as f64;
    let uncertain = 8.0 * (rms * 12_f64.sqrt() / n.powf(1.5)).max(unit / n / 4.0) / grid.sample_time_s;
    if change.is_nan() || change.abs() <= OFF.max(uncertain) {
        return;
    }
    found.push(Trouble {
        kind: TroubleKind::Drift,
        channel: String::new(),
        rows: signals.rows(),
        share: 1.0,
        size: change,
        unit: "1".to_owned(),
        text: format!(
            "the sample time changes along the record: {} s in its first third, {} s in its last ({} %)",
            decimal(first),
            decimal(last),
            short(100.0 * change)
        ),
        places: Vec::new(),
    });
}

/// Other columns that count time, in s, ms, us or ns.
fn second_clocks(signals: &Signals<'_>, grid: &Grid, found: &mut Vec<Trouble>) {
    let Some(time) = signals.time else { return };
    for clock in &signals.clocks {
        let pairs: Vec<(f64, f64)> = grid
            .rows
            .iter()
            .filter_map(|row| Some((time.values[*row], *clock.values.get(*row)?)))
            .filter(|(_, c)| c.is_finite())
            .collect();
        let (&[first, .., last], true) = (pairs.as_slice(), pairs.windows(2).all(|p| p[1].1 >= p[0].1)) else {
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
        // The ends stand for the rate as far as a row of jitter allows.
        let uncertain = 2.0 / pairs.len() as f64;
        if off.abs() <= OFF.max(uncertain) {
            continue;
        }
        found.push(Trouble {
            kind: TroubleKind::Clock,
            channel: clock.name.to_owned(),
            rows: signals.rows(),
            share: 1.0,
            size: off,
            unit: "1".to_owned(),
            text: format!(
                "{} goes {} % {} than t: one of the two clocks is wrong",
                clock.name,
                short(100.0 * off.abs()),
                if off > 0.0 { "faster" } else { "slower" }
            ),
            places: Vec::new(),
        });
    }
}
