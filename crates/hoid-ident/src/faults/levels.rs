//! Jumps of a channel: wraps, steps, and stretches in other units.
//!
//! A change from one sample to the next is *large* if it exceeds [`LARGE_CHANGE`] times the 99 % quantile of all
//! changes.
//!
//! **Wrap.** A channel with the modulus M leaves its range at one end and re-enters at the other: the size of every
//! large change equals M to within twice that quantile. M is 360, 2 pi, 180, pi, 65536, 65535 or 4096, or the common
//! size of four or more changes. In the last case, large changes less than
//! [`MAX_BRIDGED_S`](super::limits::MAX_BRIDGED_S) apart are a spike; for a known modulus they are a turn and its
//! reversal, and unwrapping repairs the channel in either case.
//!
//! **Step.** The medians of the spans of [`SPAN_S`] before and after a large change differ by more than [`MIN_STEP`]
//! times the larger robust deviation within the two spans, and by more than four fifths of the change: the person has
//! not compensated for the change, as they would for a step in the target.
//!
//! **Scale.** In one second the deviation from the level exceeds the median of this deviation over all seconds by the
//! factor [`UNIT_FACTOR`]. For a stick with a [rest](super::stick_rest) only the samples away from the rest count. No
//! person increases a signal by this factor from one second to the next. The edges of the stretch are its outermost
//! samples beyond [`OUTLIER_LIMIT`] deviations of the remaining samples.

use std::{f64::consts::PI, ops::Range};

use super::{
    robust::{level_and_deviation, median, quantile},
    stick_rest::StickRest,
};

const LARGE_CHANGE: f64 = 6.0;
/// Length of the spans before and after a step (in s).
const SPAN_S: f64 = 5.0;
/// Minimum size of a step, relative to the larger deviation in the two spans.
const MIN_STEP: f64 = 6.0;
/// A second is in another unit if its deviation exceeds the typical deviation by more than this factor.
const UNIT_FACTOR: f64 = 100.0;
/// A sample belongs to a stretch in another unit if it exceeds this number of deviations of the remaining samples.
const OUTLIER_LIMIT: f64 = 15.0;
const WRAP_MODULI: [f64; 7] = [360.0, 2.0 * PI, 180.0, PI, 65_536.0, 65_535.0, 4096.0];
/// Number of large changes of the same size from which this size is taken as an unknown modulus.
const MIN_AGREEING_CHANGES: usize = 4;

/// A channel that wraps around.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Wrap {
    pub modulus: f64,
    /// Samples from the first to the last wrap.
    pub samples: Range<usize>,
    pub unwrapped: Vec<f64>,
}

fn typical_change(values: &[f64]) -> f64 {
    quantile(
        &mut values.windows(2).map(|w| (w[1] - w[0]).abs()).collect::<Vec<_>>(),
        0.99,
    )
}

/// Returns the modulus, the range of samples with wraps and the unwrapped channel; `None` if the channel does not wrap.
pub(super) fn find_wrap(values: &[f64], sample_time_s: f64) -> Option<Wrap> {
    let typical = typical_change(values);
    if values.len() < 100 || typical <= 0.0 {
        return None;
    }
    let jumps: Vec<(usize, f64)> = values
        .windows(2)
        .enumerate()
        .map(|(t, w)| (t + 1, w[1] - w[0]))
        .filter(|(_, change)| change.abs() > LARGE_CHANGE * typical)
        .collect();
    if jumps.is_empty() || 20 * jumps.len() > values.len() {
        return None;
    }
    let near = |modulus: f64| {
        jumps
            .iter()
            .all(|(_, change)| (change.abs() - modulus).abs() <= 2.0 * typical)
    };
    let known = WRAP_MODULI.iter().copied().find(|m| near(*m));
    let own = || {
        let size = median(&jumps.iter().map(|(_, c)| c.abs()).collect::<Vec<_>>());
        let apart = jumps.windows(2).map(|w| (w[1].0 - w[0].0) as f64 * sample_time_s);
        let spike = apart.fold(f64::INFINITY, f64::min) <= super::limits::MAX_BRIDGED_S;
        (jumps.len() >= MIN_AGREEING_CHANGES && near(size) && !spike).then_some(size)
    };
    let modulus = known.or_else(own)?;
    let mut turns = 0.0;
    let mut unwrapped = values.to_vec();
    let mut next = jumps.iter().peekable();
    for (t, v) in unwrapped.iter_mut().enumerate() {
        if let Some((_, change)) = next.next_if(|(at, _)| *at == t) {
            turns -= change.signum();
        }
        *v += turns * modulus;
    }
    let (first, last) = (jumps[0].0, jumps[jumps.len() - 1].0);
    Some(Wrap {
        modulus,
        samples: first..last + 1,
        unwrapped,
    })
}

/// Returns the steps in the level: for each, its first sample, its size, and the magnitude of its size in units of the
/// larger robust deviation of the two adjacent spans.
pub(super) fn steps(values: &[f64], sample_time_s: f64) -> Vec<(usize, f64, f64)> {
    let span = (SPAN_S / sample_time_s) as usize;
    let typical = typical_change(values);
    let n = values.len();
    if span < 10 || n < 2 * span || typical <= 0.0 {
        return Vec::new();
    }
    let mut found: Vec<(usize, f64, f64)> = Vec::new();
    for t in span..n - span {
        let change = values[t] - values[t - 1];
        if change.abs() <= LARGE_CHANGE * typical || found.last().is_some_and(|(last, ..)| t - last < span) {
            continue;
        }
        let (before, one) = level_and_deviation(&values[t - span..t]);
        let (after, other) = level_and_deviation(&values[t..t + span]);
        let (shift, noise) = (after - before, one.max(other));
        if shift * change > 0.0 && shift.abs() > MIN_STEP * noise && shift.abs() > 0.8 * change.abs() {
            found.push((t, shift, shift.abs() / noise.max(f64::MIN_POSITIVE)));
        }
    }
    found
}

/// Returns the stretches in which a channel is larger by orders of magnitude, each with the ratio to the typical size
/// of the channel.
pub(super) fn scale_changes(values: &[f64], sample_time_s: f64) -> Vec<(Range<usize>, f64)> {
    let block = ((1.0 / sample_time_s) as usize).max(10);
    let n = values.len();
    if n < 5 * block {
        return Vec::new();
    }
    let rest = StickRest::of(values).map(|rest| rest.value);
    let level = rest.unwrap_or_else(|| median(values));
    let size = |part: &[f64]| {
        let moved = part.iter().filter(|v| rest != Some(**v));
        median(&moved.map(|v| (v - level).abs()).collect::<Vec<_>>())
    };
    let sizes: Vec<f64> = values.chunks(block).map(size).collect();
    let moved: Vec<f64> = sizes
        .iter()
        .copied()
        .filter(|size| rest.is_none() || *size > 0.0)
        .collect();
    let typical = median(&moved);
    if typical <= 0.0 {
        return Vec::new();
    }
    let mut all: Vec<(Range<usize>, f64)> = Vec::new();
    for (k, size) in sizes.iter().enumerate() {
        if *size <= UNIT_FACTOR * typical {
            continue;
        }
        let rows = k * block..((k + 1) * block).min(n);
        match all.last_mut() {
            Some((last, factor)) if last.end == rows.start => {
                last.end = rows.end;
                *factor = factor.max(size / typical);
            }
            _ => all.push((rows, size / typical)),
        }
    }
    let inside = |t: usize| all.iter().any(|(rows, _)| rows.contains(&t));
    let rest: Vec<f64> = (0..n).filter(|t| !inside(*t)).map(|t| values[t]).collect();
    let limit = OUTLIER_LIMIT * level_and_deviation(&rest).1;
    let outside = |t: usize| (values[t] - level).abs() > limit;
    // A single sample of a stretch in another unit may be small, but not ten in a row.
    let last_outside = |mut rows: Box<dyn Iterator<Item = usize>>| {
        let (mut last, mut calm) = (None, 0);
        while calm < 10 {
            let Some(t) = rows.next() else { break };
            if outside(t) {
                (last, calm) = (Some(t), 0);
            } else {
                calm += 1;
            }
        }
        last
    };
    for (rows, _) in &mut all {
        let first = (rows.start..rows.end).find(|t| outside(*t)).unwrap_or(rows.start);
        let end = (rows.start..rows.end)
            .rev()
            .find(|t| outside(*t))
            .map_or(rows.end, |t| t + 1);
        rows.start = last_outside(Box::new((0..first).rev())).unwrap_or(first);
        rows.end = last_outside(Box::new(end..n)).map_or(end, |t| t + 1);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::{super::test_signals::autoregressive_signal, *};

    fn channel(seed: u64) -> Vec<f64> {
        autoregressive_signal(6000, seed)
    }

    #[test]
    fn dead_zone_is_not_reported_as_a_change_of_scale() {
        let zone = |v: &f64| v - v.clamp(-4.0, 4.0);
        let u: Vec<f64> = channel(4).iter().map(zone).collect();
        let at_rest = u.iter().filter(|v| **v == 0.0).count();
        assert!(at_rest > 3500, "{at_rest}");
        assert_eq!(scale_changes(&u, 0.01), []);
        let mut other = u;
        other[2000..2600].iter_mut().for_each(|v| *v *= 1000.0);
        assert_eq!(scale_changes(&other, 0.01).len(), 1);
    }

    #[test]
    fn clean_channel_has_no_wraps_steps_or_scale_changes() {
        for seed in 1..8 {
            let x = channel(seed);
            assert!(find_wrap(&x, 0.01).is_none() && steps(&x, 0.01).is_empty() && scale_changes(&x, 0.01).is_empty());
        }
        assert!(
            find_wrap(&[1.0; 300], 0.01).is_none()
                && steps(&[], 0.01).is_empty()
                && scale_changes(&[0.0; 999], 0.01).is_empty()
        );
    }

    #[test]
    fn wrapped_angle_is_unwrapped() {
        let x: Vec<f64> = channel(4).iter().map(|v| 5.0 * v + 132.0).collect();
        let wrapped: Vec<f64> = x.iter().map(|v| (v + 180.0).rem_euclid(360.0) - 180.0).collect();
        let found = find_wrap(&wrapped, 0.01).unwrap();
        assert_eq!(found.modulus, 360.0);
        let offset = found.unwrapped[0] - x[0];
        assert!(
            found
                .unwrapped
                .iter()
                .zip(&x)
                .all(|(u, x)| (u - x - offset).abs() < 1e-9)
        );
        let mut spiky = x;
        spiky[3000] += 250.0;
        spiky[900] -= 230.0;
        assert!(find_wrap(&spiky, 0.01).is_none());
    }

    #[test]
    fn permanent_step_is_found_and_pulse_is_not() {
        let mut x = channel(3);
        x[3000..].iter_mut().for_each(|v| *v += 80.0);
        let found = steps(&x, 0.01);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].0 == 3000 && (found[0].1 - 80.0).abs() < 8.0, "{found:?}");
        let mut x = channel(3);
        x[3000..3050].iter_mut().for_each(|v| *v += 80.0);
        assert!(steps(&x, 0.01).is_empty());
    }

    #[test]
    fn temporary_scale_change_is_found() {
        let mut x = channel(6);
        x[2030..4777].iter_mut().for_each(|v| *v *= 1e6);
        let found = scale_changes(&x, 0.01);
        assert_eq!(found.len(), 1, "{found:?}");
        let (rows, factor) = &found[0];
        assert!(
            rows.start.abs_diff(2030) < 5 && rows.end.abs_diff(4777) < 5,
            "{found:?}"
        );
        assert!((1e5..1e7).contains(factor));
    }
}
