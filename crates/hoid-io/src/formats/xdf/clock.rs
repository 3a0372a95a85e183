//! Conversion of the time stamps of a stream to the clock of the recorder, and removal of jitter, by the method of
//! pyxdf (Kothe et al., "The Lab Streaming Layer for synchronized multimodal recording", 2024; pyxdf 1.17).
//!
//! The offset `o_k` to the recorder's clock was measured at times `c_k`. A line `o = b_0 + b_1 c` is fitted with
//! Huber's loss by the alternating direction method of multipliers (Boyd et al., 2011, section 6.1.1), in units of 1e-4
//! s; measurements over a busy network then have little weight. Then each time stamp t is replaced by
//! `t + b_0 + b_1 t`. If the clock was reset, each part between resets has its own line. Finally, in a stream with a
//! nominal rate, the time stamps between two breaks are replaced by their least-squares line over the sample index.
//!
//! Unlike in pyxdf, lost samples also count as a break: a step of more than [`LOST_SAMPLE_LIMIT`] nominal sample times
//! `T` after which the time stamps remain late. The lateness is the difference between the medians of `t_k - k T`
//! before the step and after it, where as many samples after the step are skipped as would have been lost. Samples that
//! arrive late and catch up count as jitter. Without this rule a loss of one second would be spread over the recording
//! and appear as a lower rate without a gap.

use std::ops::Range;

use super::chunks::Stream;
use crate::time::sampling::{pairs, steps};
use crate::wording::abbreviate;

/// Unit of the offsets in the fit, s; the loss is linear for deviations above one unit.
const UNIT_S: f64 = 1e-4;
const MAX_ITERATIONS: usize = 1000;
/// Limits for a reset of the clock (multiple of the median absolute deviation, and s). The time between two offset
/// measurements must differ from its median by more than both limits, and the offset step by more than
/// [`RESET_VALUE_LIMITS`].
const RESET_TIME_LIMITS: (f64, f64) = (5.0, 5.0);
const RESET_VALUE_LIMITS: (f64, f64) = (10.0, 1.0);
/// A break is a step longer than this time in s and longer than [`MIN_BREAK_SAMPLES`] nominal sample times.
const MIN_BREAK_S: f64 = 1.0;
const MIN_BREAK_SAMPLES: f64 = 500.0;

/// Step, and subsequent lateness, above which samples count as lost, in nominal sample times.
const LOST_SAMPLE_LIMIT: f64 = 4.0;
/// Number of samples on each side of a step from whose medians the lateness is computed.
const SAMPLES_PER_SIDE: usize = 25;
/// Relative deviation of the sampling rate from the nominal rate above which the deviation is reported.
const MAX_RATE_DEVIATION: f64 = 0.02;

/// Returns the times of the samples in s.
pub(super) fn sample_times(stream: &Stream, notes: &mut Vec<String>) -> Vec<f64> {
    let mut times = stream.stamps.clone();
    if times.is_empty() {
        return times;
    }
    let parts = synchronise(&mut times, &stream.offsets);
    let name = abbreviate(&stream.header.name);
    let resets = match parts {
        0 => String::from(
            "no clock offsets were recorded: the time stamps are taken as times on the clock of the recorder",
        ),
        1 => format!("clock aligned by a line fitted to {} offsets", stream.offsets.len()),
        parts => format!(
            "clock aligned by {parts} lines fitted to {} offsets, because the clock was reset",
            stream.offsets.len()
        ),
    };
    let nominal_hz = stream.header.nominal_hz;
    if nominal_hz <= 0.0 || stream.header.may_drop_samples {
        notes.push(format!(
            "stream {name}: {resets}; its time stamps are kept, because they are not evenly spaced"
        ));
        return times;
    }
    let longest = MIN_BREAK_S.max(MIN_BREAK_SAMPLES * stream.nominal_step_s());
    let (parts, effective_hz) = dejitter(&mut times, longest, stream.nominal_step_s());
    if let Some(hz) = effective_hz.filter(|hz| (hz / nominal_hz - 1.0).abs() > MAX_RATE_DEVIATION) {
        notes.push(format!(
            "stream {name}: the time stamps give {hz:.4} Hz, but the stated rate is {nominal_hz} Hz: samples are lost at \
             regular intervals, or the stated rate is wrong"
        ));
    }
    let found = effective_hz.map_or_else(String::new, |hz| format!(", {hz:.4} Hz found"));
    let breaks = if parts > 1 {
        format!(" in {parts} parts")
    } else {
        String::new()
    };
    notes.push(format!(
        "stream {name}: {resets}; {nominal_hz} Hz stated{found}; jitter removed by fitting a line to the time stamps{breaks}"
    ));
    times
}

/// Converts time stamps to the clock of the recorder; returns the number of fitted lines.
fn synchronise(times: &mut [f64], offsets: &[(f64, f64)]) -> usize {
    let parts = ranges_between_resets(offsets);
    let mut rest = times;
    for part in &parts {
        let of_part = offsets.get(part.clone()).unwrap_or_default();
        let (b0, b1) = fit_line(of_part);
        // A part ends before the first time stamp that is closer to the offsets of the next part.
        let end = match (of_part.last(), offsets.get(part.end)) {
            (Some((end, _)), Some((next, _))) => rest.iter().position(|t| (t - end).abs() >= (t - next).abs()),
            _ => None,
        };
        let (now, later) = rest.split_at_mut(end.unwrap_or(rest.len()));
        now.iter_mut().for_each(|t| *t += b0 + b1 * *t);
        rest = later;
    }
    parts.len()
}

/// Returns the range of the offsets of each part between resets of the clock.
fn ranges_between_resets(offsets: &[(f64, f64)]) -> Vec<Range<usize>> {
    if offsets.is_empty() {
        return Vec::new();
    }
    let (times, values): (Vec<f64>, Vec<f64>) = offsets.iter().copied().unzip();
    let [times, values] = [times, values].map(|of| steps(&of).collect::<Vec<f64>>());
    let glitches = outlier_flags(&times, RESET_TIME_LIMITS)
        .into_iter()
        .zip(outlier_flags(&values, RESET_VALUE_LIMITS));
    let each = (1..).zip(times.iter().zip(glitches));
    let breaks = each.filter(|(_, (step, (time, value)))| **step < 0.0 || *time && *value);
    split_at_breaks(breaks.map(|(at, _)| at), offsets.len())
}

/// True for each step that differs from the median by more than `deviations` median absolute deviations and by more
/// than `least`.
fn outlier_flags(steps: &[f64], (deviations, least): (f64, f64)) -> Vec<bool> {
    let middle = median(steps);
    let off: Vec<f64> = steps.iter().map(|step| (step - middle).abs()).collect();
    let typical = median(&off) + f64::EPSILON;
    off.iter()
        .map(|off| off / typical > deviations && *off > least)
        .collect()
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let (lower, upper) = sorted.split_at(sorted.len() / 2);
    match (lower.last(), upper.first()) {
        (Some(below), Some(middle)) if lower.len() == upper.len() => f64::midpoint(*below, *middle),
        (_, Some(middle)) => *middle,
        (_, None) => f64::NAN,
    }
}

/// Divides `count` items into parts; each break is the index of the first item of the next part.
fn split_at_breaks(breaks: impl Iterator<Item = usize>, count: usize) -> Vec<Range<usize>> {
    let mut first = 0;
    let ends = breaks.chain([count]);
    ends.map(|end| std::mem::replace(&mut first, end)..end).collect()
}

/// Fits the line `b_0 + b_1 c` to offsets with Huber's loss; returns zeros if the offsets do not determine a line.
fn fit_line(offsets: &[(f64, f64)]) -> (f64, f64) {
    if let [(_, offset)] = offsets {
        return (*offset, 0.0);
    }
    let start = offsets.iter().map(|o| o.0).fold(f64::INFINITY, f64::min) / UNIT_S;
    let c: Vec<f64> = offsets.iter().map(|o| o.0 / UNIT_S - start).collect();
    let y: Vec<f64> = offsets.iter().map(|o| o.1 / UNIT_S).collect();
    let n = c.len() as f64;
    let (sum, squares) = (c.iter().sum::<f64>(), c.iter().map(|c| c * c).sum::<f64>());
    let determinant = n * squares - sum * sum;
    if !(determinant > 0.0 && determinant.is_finite()) {
        return (0.0, 0.0);
    }
    let (mut z, mut w) = (vec![0.0; c.len()], vec![0.0; c.len()]);
    let mut x = (0.0, 0.0);
    for _ in 0..MAX_ITERATIONS {
        let (mut right, mut right_c) = (0.0, 0.0);
        for (((c, y), z), w) in c.iter().zip(&y).zip(&z).zip(&w) {
            let target = y + z - w;
            right += target;
            right_c += c * target;
        }
        x = (
            (squares * right - sum * right_c) / determinant,
            (n * right_c - sum * right) / determinant,
        );
        for (((c, y), z), w) in c.iter().zip(&y).zip(&mut z).zip(&mut w) {
            let d = x.0 + x.1 * c - y + *w;
            let shrunk = if d == 0.0 { 1.0 } else { (1.0 - 2.0 / d.abs()).max(0.0) };
            *z = 0.5 * d + 0.5 * shrunk * d;
            *w = d - *z;
        }
    }
    (UNIT_S * (x.0 - x.1 * start), x.1)
}

/// True if samples were lost before the k-th sample: after a long step the time stamps remain late.
fn samples_were_lost(times: &[f64], k: usize, nominal_s: f64) -> bool {
    let Some([before, now]) = times.get(k.saturating_sub(1)..=k) else {
        return false;
    };
    let late_s = now - before - nominal_s;
    if nominal_s.is_nan() || nominal_s <= 0.0 || late_s.is_nan() || late_s <= LOST_SAMPLE_LIMIT * nominal_s {
        return false;
    }
    let lateness = |rows: Range<usize>| {
        let of = rows.filter_map(|j| Some(times.get(j)? - (j as f64 - k as f64) * nominal_s));
        median(&of.collect::<Vec<f64>>())
    };
    // Samples that would have arrived late together are skipped after the step.
    let come = k.saturating_add((late_s / nominal_s).ceil() as usize);
    let from = come.min(times.len().saturating_sub(SAMPLES_PER_SIDE)).max(k);
    let shift_s =
        lateness(from..from.saturating_add(SAMPLES_PER_SIDE)) - lateness(k.saturating_sub(SAMPLES_PER_SIDE)..k);
    shift_s > LOST_SAMPLE_LIMIT * nominal_s && shift_s > 0.5 * late_s
}

/// Replaces the time stamps between two breaks by their least-squares line; returns the number of parts and the mean
/// rate in Hz.
fn dejitter(times: &mut [f64], longest_s: f64, nominal_s: f64) -> (usize, Option<f64>) {
    let breaks = (1..)
        .zip(pairs(times))
        .filter(|(k, (before, t))| (t - before).abs() > longest_s || samples_were_lost(times, *k, nominal_s));
    let parts = split_at_breaks(breaks.map(|(k, _)| k), times.len());
    let (mut steps, mut duration_s) = (0.0, 0.0);
    for part in &parts {
        let part = times.get_mut(part.clone()).unwrap_or_default();
        // Indices relative to the middle keep the numbers small and the sums uncorrelated.
        let middle = (part.len() as f64 - 1.0) / 2.0;
        let mean = part.iter().sum::<f64>() / part.len() as f64;
        let (mut products, mut squares) = (0.0, 0.0);
        for (k, t) in part.iter().enumerate() {
            let k = k as f64 - middle;
            products += k * (t - mean);
            squares += k * k;
        }
        let slope = if squares > 0.0 { products / squares } else { 0.0 };
        for (k, t) in part.iter_mut().enumerate() {
            *t = mean + slope * (k as f64 - middle);
        }
        if let [first, .., last] = &*part {
            steps += part.len() as f64 - 1.0;
            duration_s += last - first;
        }
    }
    (parts.len(), (duration_s > 0.0).then(|| steps / duration_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clock_fit_is_robust_to_an_outlier() {
        let mut offsets: Vec<(f64, f64)> = (0..40)
            .map(|k| (1e5 + 5.0 * f64::from(k), 3.0 - 1e-4 * 5.0 * f64::from(k)))
            .collect();
        let (b0, b1) = fit_line(&offsets);
        // Offsets near 1e5 s have a rounding error of 1e-11 s.
        assert!(
            (b0 + b1 * 1e5 - 3.0).abs() < 1e-9 && (b1 + 1e-4).abs() < 1e-11,
            "{b0} {b1}"
        );
        // An outlier of 0.5 s shifts the line by less than a ten-thousandth of the outlier.
        offsets[7].1 += 0.5;
        let (b0, b1) = fit_line(&offsets);
        assert!(
            (b0 + b1 * 1e5 - 3.0).abs() < 5e-5 && (b1 + 1e-4).abs() < 1e-6,
            "{b0} {b1}"
        );
        assert_eq!(fit_line(&[(1.0, 2.0)]), (2.0, 0.0));
        assert_eq!(fit_line(&[(1.0, 2.0), (1.0, 3.0)]), (0.0, 0.0));
        assert_eq!(fit_line(&[(f64::NAN, 2.0), (1.0, f64::INFINITY)]), (0.0, 0.0));
    }

    #[test]
    fn clock_resets_are_found() {
        let mut offsets: Vec<(f64, f64)> = (0..10).map(|k| (5.0 * f64::from(k), 1.0)).collect();
        offsets.extend((0..10).map(|k| (5.0 * f64::from(k), 100.0)));
        assert_eq!(ranges_between_resets(&offsets), [0..10, 10..20]);
        let mut times: Vec<f64> = (0..50).map(f64::from).chain((0..50).map(f64::from)).collect();
        assert_eq!(synchronise(&mut times, &offsets[..10]), 1);
        assert_eq!((times[0], times[49]), (1.0, 50.0));
        assert_eq!(synchronise(&mut times, &[]), 0);
    }

    #[test]
    fn breaks_are_kept_and_jitter_is_removed() {
        let mut times: Vec<f64> = (0..100)
            .map(|k| 0.01 * f64::from(k) + if k >= 60 { 3.0 } else { 0.0 } + 1e-4 * f64::from(k % 2))
            .collect();
        let (parts, hz) = dejitter(&mut times, 1.0, 0.01);
        assert_eq!(parts, 2);
        assert!((hz.unwrap() - 100.0).abs() < 0.1);
        // Alternating jitter of 1e-4 s tilts a line over 40 samples by less than 1e-6 s per sample.
        assert!(
            times
                .windows(2)
                .enumerate()
                .all(|(k, pair)| k == 59 || (pair[1] - pair[0] - 0.01).abs() < 1e-6)
        );
        assert_eq!(dejitter(&mut [5.0], 1.0, 0.0), (1, None));
    }

    #[test]
    fn lost_samples_are_a_break_but_late_samples_are_not() {
        // 12 s at 100 Hz with network jitter, of which 0.2 to 4 s are lost.
        for lost in [20_u32, 100, 200, 400] {
            let mut times: Vec<f64> = (0..1200)
                .filter(|k| !(500..500 + lost).contains(k))
                .map(|k| 0.01 * f64::from(k) + 0.002 * (f64::from(k) * 1.7).sin())
                .collect();
            let (parts, hz) = dejitter(&mut times, 5.0, 0.01);
            assert_eq!(parts, 2, "{lost}");
            assert!((hz.unwrap() - 100.0).abs() < 0.1, "{lost}: {hz:?}");
            assert!(
                (times[500] - times[499] - 0.01 * f64::from(lost + 1)).abs() < 2e-3,
                "{lost}"
            );
        }
        // Half a second of samples that arrive together, stamped on arrival, is not a loss.
        let mut times: Vec<f64> = (0..1200)
            .map(|k| {
                if (500..550).contains(&k) {
                    5.5 + 1e-5 * f64::from(k)
                } else {
                    0.01 * f64::from(k)
                }
            })
            .collect();
        assert_eq!(dejitter(&mut times, 5.0, 0.01).0, 1);
    }
}
