//! The evenly spaced grid fitted to a recorded time, and the deviation of the time from this grid.
//!
//! Row i is at `t_i = t_0 + k_i Ts + jitter` with integers k_i, which increase by one from row to row, and by more
//! where rows are missing. The increments are `k_i - k_{i-1} = round((t_i - g) / Ts)`, where g is a phase that is
//! corrected at each row by a small fraction of its deviation from the time. Jitter of nearly half a sample is
//! therefore not mistaken for a gap. If a row then appears not to advance, the excess increment of a nearby row is
//! undone. Ts is the least-squares slope, computed twice.
//!
//! Jitter is the deviation of the times from straight lines fitted to parts of up to 256 rows without a gap, so slow
//! drift does not count as jitter.

use std::borrow::Cow;

use crate::time::sampling::median_stride;

/// Maximum and minimum number of rows of a part to which a line is fitted.
const MAX_PART_ROWS: usize = 256;
const MIN_PART_ROWS: usize = 5;
/// A step of at least this many sample times is a pause, after which the grid restarts.
const MIN_PAUSE_STEPS: f64 = 10.0;
/// Maximum distance in rows between an excess step and the row that appears not to advance.
const MAX_ROW_DISTANCE: usize = 4;
/// Number of times from which the phase at the start of a grid is estimated.
const START_PHASE_ROWS: usize = 8;

/// Positions of the rows on an evenly spaced grid.
pub(crate) struct Grid {
    /// Rows whose time is later than the times of all earlier rows.
    pub(crate) rows: Vec<usize>,
    /// Number of grid steps from the previous row in `rows` to each row in `rows`; 1 if no row is missing in between.
    pub(crate) steps: Vec<f64>,
    /// Sample time, s; NaN if fewer than two rows have an advancing time.
    pub(crate) sample_time_s: f64,
    /// Rows whose time equals the latest time of all earlier rows.
    pub(super) repeated_times: Vec<usize>,
    /// Rows whose time is earlier than the latest time of all earlier rows.
    pub(super) backward_times: Vec<usize>,
    /// Indices of steps that are longer by one because a row near the step has a wrong time or is out of order.
    misplaced_steps: Vec<usize>,
}

impl Grid {
    pub(crate) fn of(t: &[f64]) -> Self {
        let (mut rows, mut repeated_times, mut backward_times) = (Vec::new(), Vec::new(), Vec::new());
        let mut last = f64::NEG_INFINITY;
        for (row, t) in t.iter().enumerate().filter(|(_, t)| t.is_finite()) {
            if *t > last {
                rows.push(row);
                last = *t;
            } else if *t == last {
                repeated_times.push(row);
            } else {
                backward_times.push(row);
            }
        }
        // In nearly every recording the time advances in all rows; the times are then not copied.
        let times: Cow<'_, [f64]> = match rows.len() == t.len() {
            true => Cow::Borrowed(t),
            false => rows.iter().filter_map(|row| t.get(*row).copied()).collect(),
        };
        // The median of single steps is exact if there is no jitter; the median over spans of sixteen steps averages
        // out jitter, if few rows are missing.
        let median = |length: usize| {
            let spans = times
                .iter()
                .zip(times.iter().skip(length))
                .step_by(median_stride(times.len()));
            let mut spans: Vec<f64> = spans.map(|(from, to)| (to - from) / length as f64).collect();
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
                track_clock(&times, sample_time_s, pull, &mut steps);
                let slope = slope(&times, &steps);
                if slope.is_finite() && slope > 0.0 {
                    sample_time_s = slope;
                }
                if is_even(&times, &steps, sample_time_s) {
                    // A second pass would give the same grid steps.
                    break;
                }
            }
        }
        let is_long = |at: &usize| steps.get(*at).is_some_and(|step| *step > 1.5);
        let misplaced = |row: &usize| {
            let t = t.get(*row)?;
            let by_time = times.partition_point(|time| time < t);
            let by_place = rows.partition_point(|other| other < row);
            let near = |at: &usize| {
                rows.get(*at)
                    .is_some_and(|other| other.abs_diff(*row) <= MAX_ROW_DISTANCE)
            };
            [by_time, by_place].into_iter().find(|at| is_long(at) && near(at))
        };
        let misplaced = backward_times.iter().filter_map(misplaced).collect();
        Self {
            steps,
            sample_time_s,
            repeated_times,
            backward_times,
            misplaced_steps: misplaced,
            rows,
        }
    }

    /// Returns each gap: the rows before and after it, and the number of missing rows.
    pub(crate) fn gaps(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        let recorded = |at: usize| self.misplaced_steps.iter().filter(|one| **one == at).count() as f64;
        let missing = (0..).zip(&self.steps).map(move |(at, step)| match *step > 1.5 {
            true => step - 1.0 - recorded(at),
            false => 0.0,
        });
        let steps = self.rows.iter().zip(self.rows.iter().zip(missing).skip(1));
        steps
            .filter(|(_, (_, missing))| *missing > 0.5)
            .map(|(before, (after, missing))| (*before, *after, missing))
    }

    /// Returns the deviation of the times from lines fitted to parts without a gap: its RMS value, the largest
    /// deviation and the row of the largest deviation; `None` if no part is long enough.
    #[expect(
        clippy::indexing_slicing,
        clippy::arithmetic_side_effects,
        reason = "`rows` and `steps` are equally long, and `rows` are rows of t"
    )]
    pub(crate) fn jitter(&self, t: &[f64]) -> Option<(f64, f64, usize)> {
        let (mut squares, mut freedom) = (0.0, 0);
        let mut worst = (0.0, 0);
        let mut start = 0;
        while start < self.rows.len() {
            let mut end = start + 1;
            while end < self.rows.len() && end - start < MAX_PART_ROWS && self.steps[end] < 1.5 {
                end += 1;
            }
            if end - start >= MIN_PART_ROWS {
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

/// True if no row is missing and each time is near its grid point.
fn is_even(times: &[f64], steps: &[f64], ts: f64) -> bool {
    let origin = times.first().copied().unwrap_or(f64::NAN);
    let near = |(i, t): (usize, &f64)| (t - origin - i as f64 * ts).abs() < 0.25 * ts;
    steps.iter().all(|step| *step == 1.0) && times.iter().enumerate().all(near)
}

/// Computes the grid step to each time from the time before it.
#[expect(
    clippy::indexing_slicing,
    clippy::arithmetic_side_effects,
    reason = "`times` and `steps` are equally long, and all indices are below their length"
)]
fn track_clock(times: &[f64], ts: f64, pull: f64, steps: &mut [f64]) {
    steps.fill(1.0);
    let mut owed: Option<usize> = None;
    // The phase at the start of a grid is estimated from several times, since a single time deviates by its jitter.
    let origin = |i: usize| {
        let ahead = times[i..]
            .iter()
            .take(START_PHASE_ROWS)
            .enumerate()
            .map(|(j, t)| t - j as f64 * ts);
        let near: Vec<f64> = ahead.filter(|t| (t - times[i]).abs() < 1.5 * ts).collect();
        near.iter().sum::<f64>() / near.len() as f64
    };
    let (mut phase, mut known) = (origin(0), START_PHASE_ROWS as f64);
    for i in 1..times.len() {
        let mut step = ((times[i] - phase) / ts).round();
        if step >= MIN_PAUSE_STEPS {
            let anew = origin(i);
            step = ((anew - phase) / ts).round();
            (phase, known) = (anew, START_PHASE_ROWS as f64);
        } else {
            phase += step * ts;
            phase += f64::max(pull, 1.0 / (known + 1.0)) * (times[i] - phase);
        }
        known += 1.0;
        steps[i] = step.max(1.0);
        // If a row appears not to advance, an excess step just before is undone; otherwise the next excess step is
        // reduced.
        if step < 1.0 {
            match (i.saturating_sub(MAX_ROW_DISTANCE)..i).rev().find(|j| steps[*j] > 1.5) {
                Some(taken) => steps[taken] -= 1.0,
                None => owed = Some(i),
            }
        } else if step > 1.5 && owed.take_if(|at| i - *at <= MAX_ROW_DISTANCE).is_some() {
            steps[i] -= 1.0;
        }
    }
}

/// Returns the least-squares slope of the times against the grid index.
pub(super) fn slope(times: &[f64], steps: &[f64]) -> f64 {
    // The indices are recomputed for each sum: for a record of several hours, storing them would take too much memory.
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
    // Each index is divided by n before summation to avoid overflow.
    let x = indexed().map(|(index, _)| index / n).sum::<f64>();
    let y = times.iter().map(|t| t / n).sum::<f64>();
    let covariance: f64 = indexed().map(|(index, time)| (index - x) * (time - y)).sum();
    covariance / indexed().map(|(index, _)| (index - x) * (index - x)).sum::<f64>()
}
