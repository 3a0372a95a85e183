//! Stretches in which a channel is constant: frozen channels, dropouts and idle stretches.
//!
//! A *hold* is a run of equal values. A channel in full precision has no holds except at its largest or smallest value
//! (a rail, which is treated separately), so [`MIN_EQUAL_SAMPLES`] equal samples already count as frozen. A quantised
//! channel or a resting hand has holds in normal operation. Such a hold is frozen if it lasts at least [`MIN_FROZEN_S`]
//! and [`MIN_RELATIVE_LENGTH`] times the length that nine of ten holds do not exceed, and if the other channel moves by
//! more than half of its deviation in the meantime. Holds at the [rest](super::stick_rest) of a stick are compared only
//! with each other. A hold is a dropout if the channel jumps to its value and back, each time by more than twice the
//! change that 999 of 1000 changes do not exceed.
//!
//! *Idle* is a stretch of [`MIN_IDLE_S`] or more in which both e and u stay within [`MAX_IDLE_RANGE`] of their
//! deviations in each half second, such as before the start or after the end of a run. This does not happen while a
//! person tracks, because e is then never at rest.

use std::ops::Range;

use super::{
    robust::{level_and_deviation, quantile, quantisation_step},
    stick_rest::{StickRest, runs},
};

/// Number of successive equal samples from which a channel of full precision counts as frozen.
const MIN_EQUAL_SAMPLES: usize = 6;
/// Minimum length of a frozen hold of a quantised channel, relative to the length that nine of ten holds do not exceed.
const MIN_RELATIVE_LENGTH: f64 = 20.0;
/// Minimum duration of a frozen hold of a quantised channel, s.
const MIN_FROZEN_S: f64 = 3.0;
/// Shortest idle stretch, s.
const MIN_IDLE_S: f64 = 1.5;
/// Length of the blocks in which the range of an idle channel is examined, s.
const BLOCK_S: f64 = 0.5;
/// Largest range of an idle channel within a block, relative to the deviation of the channel.
const MAX_IDLE_RANGE: f64 = 0.05;

/// A faulty hold of a channel.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Hold {
    pub samples: Range<usize>,
    /// Size of the jump, if the channel jumps to the held value and back.
    pub jump: Option<f64>,
}

/// Returns the frozen holds and dropouts of one channel. A hold of a quantised channel is frozen only if the other
/// channel moves.
pub(super) fn frozen_holds(values: &[f64], other: Option<&[f64]>, sample_time_s: f64) -> Vec<Hold> {
    let n = values.len();
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    if n < 20 || low >= high {
        return Vec::new();
    }
    let runs = runs(values);
    let in_steps = quantisation_step(values) > 0.0;
    let rest = StickRest::of(values);
    let rests = |run: &Range<usize>| rest.is_some_and(|rest| rest.value == values[run.start]);
    let moving = runs.iter().filter(|run| !rests(run));
    let mut lengths: Vec<f64> = moving.map(|run| run.len() as f64).collect();
    let typical = quantile(&mut lengths, 0.9);
    let mut changes: Vec<f64> = values.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let large = 2.0 * quantile(&mut changes, 0.999);
    let deviation_of_other = other.map(|o| level_and_deviation(o).1);
    let longest =
        |typical: f64| ((MIN_FROZEN_S / sample_time_s) as usize).max((MIN_RELATIVE_LENGTH * typical) as usize);
    let in_use = if in_steps { longest(typical) } else { MIN_EQUAL_SAMPLES };
    let at_rest = rest.map_or(in_use, |rest| longest(rest.typical_samples));
    let is_fault = |run: &Range<usize>| -> Option<Hold> {
        if run.len() < MIN_EQUAL_SAMPLES {
            return None;
        }
        let held = values[run.start];
        let least = if rests(run) { at_rest } else { in_use };
        let step = |t: usize| (values[t] - values[t - 1]).abs();
        let inside = run.start > 0 && run.end < n;
        let jump = (inside && step(run.start) > large && step(run.end) > large)
            .then(|| held - 0.5 * (values[run.start - 1] + values[run.end]));
        let at_rail = held == low || held == high;
        let moves = match (other, deviation_of_other) {
            (Some(other), Some(deviation)) => value_range(&other[run.clone()]) > 0.5 * deviation,
            _ => true,
        };
        let long = run.len() >= least && (!in_steps || moves);
        (jump.is_some() || long && (in_steps || !at_rail)).then(|| Hold {
            samples: run.clone(),
            jump,
        })
    };
    runs.iter().filter_map(is_fault).collect()
}

fn value_range(values: &[f64]) -> f64 {
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    high - low
}

/// Returns the stretches in which all channels are idle, apart from blocks with samples marked in `out`.
pub(super) fn idle_stretches(channels: &[&[f64]], out: &[bool], sample_time_s: f64) -> Vec<Range<usize>> {
    let n = channels.first().map_or(0, |c| c.len());
    let block = ((BLOCK_S / sample_time_s).round() as usize).max(5);
    let used = |c: &&[f64]| -> Vec<f64> { c.iter().zip(out).filter(|(_, out)| !**out).map(|(v, _)| *v).collect() };
    let scales: Vec<f64> = channels.iter().map(|c| level_and_deviation(&used(c)).1).collect();
    if n < 4 * block || scales.iter().any(|s| *s <= 0.0) {
        return Vec::new();
    }
    let quiet = |rows: Range<usize>| {
        let one = |(channel, scale): (&&[f64], &f64)| value_range(&channel[rows.clone()]) <= MAX_IDLE_RANGE * scale;
        channels.iter().zip(&scales).all(one)
    };
    let mut all: Vec<Range<usize>> = Vec::new();
    for start in (0..n).step_by(block) {
        let rows = start..(start + block).min(n);
        if rows.len() < 5 || out[rows.clone()].contains(&true) || !quiet(rows.clone()) {
            continue;
        }
        match all.last_mut() {
            Some(last) if last.end == rows.start => last.end = rows.end,
            _ => all.push(rows),
        }
    }
    let least = ((MIN_IDLE_S / sample_time_s).ceil() as usize).max(2 * block);
    let whole = |stretch: Range<usize>| {
        // Extends the stretch sample by sample, as long as every channel stays close to its value in the middle of the
        // stretch.
        let stays = |t: usize, stretch: &Range<usize>| {
            channels.iter().zip(&scales).all(|(channel, scale)| {
                let inside = &channel[stretch.clone()];
                let middle = inside[inside.len() / 2];
                (channel[t] - middle).abs() <= MAX_IDLE_RANGE * scale
            })
        };
        let (mut start, mut end) = (stretch.start, stretch.end);
        while start > 0 && stays(start - 1, &stretch) {
            start -= 1;
        }
        while end < n && stays(end, &stretch) {
            end += 1;
        }
        start..end
    };
    all.into_iter().map(whole).filter(|s| s.len() >= least).collect()
}

#[cfg(test)]
mod tests {
    use super::{super::test_signals::autoregressive_signal, *};

    #[test]
    fn frozen_channels_are_found_with_and_without_quantisation() {
        let (e, u) = (autoregressive_signal(4000, 1), autoregressive_signal(4000, 2));
        assert!(frozen_holds(&u, Some(&e), 0.01).is_empty());
        let mut held = u.clone();
        let value = held[1000];
        held[1000..1050].fill(value);
        let found = frozen_holds(&held, Some(&e), 0.01);
        assert_eq!(
            (found.len(), found[0].samples.clone(), found[0].jump),
            (1, 1000..1050, None)
        );
        let steps: Vec<f64> = u.iter().map(|v| v.round()).collect();
        assert!(frozen_holds(&steps, Some(&e), 0.01).is_empty());
        let mut held = steps;
        held[2000..2900].fill(2.0);
        let found = frozen_holds(&held, Some(&e), 0.01);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].samples.len() >= 900);
    }

    #[test]
    fn stick_in_its_dead_zone_is_not_frozen() {
        let e = autoregressive_signal(9000, 1);
        let zone = |v: &f64| v - v.clamp(-4.0, 4.0);
        // The signal is slow, like the movement of a hand.
        let slow = autoregressive_signal(1125, 2).into_iter().flat_map(|v| [zone(&v); 8]);
        let mut u: Vec<f64> = slow.collect();
        assert!(frozen_holds(&u, Some(&e), 0.01).is_empty());
        // The stick is released for five seconds, which is normal.
        u[3000..3500].fill(0.0);
        assert!(frozen_holds(&u, Some(&e), 0.01).is_empty());
        // The stick is held at a value other than the rest, and at the rest for most of a minute.
        u[1000..1400].fill(2.125);
        u[3900..8900].fill(0.0);
        let found = frozen_holds(&u, Some(&e), 0.01);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(
            found[0].samples == (1000..1400) && found[1].samples.len() >= 5000,
            "{found:?}"
        );
    }

    #[test]
    fn dropout_is_a_hold_with_jumps() {
        let mut u: Vec<f64> = autoregressive_signal(4000, 2).iter().map(|v| v + 40.0).collect();
        u[700..740].fill(0.0);
        let found = frozen_holds(&u, None, 0.01);
        assert_eq!((found.len(), found[0].samples.clone()), (1, 700..740));
        assert!((found[0].jump.unwrap() + 40.0).abs() < 12.0, "{found:?}");
    }

    #[test]
    fn saturation_is_not_reported_as_frozen() {
        let u: Vec<f64> = autoregressive_signal(4000, 2)
            .iter()
            .map(|v| v.clamp(-3.0, 3.0))
            .collect();
        assert!(frozen_holds(&u, None, 0.01).is_empty());
    }

    #[test]
    fn idle_span_before_a_run_is_found() {
        let mut state = 5_u64;
        let mut small = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            0.02 * ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5)
        };
        let before: Vec<f64> = (0..1500).map(|_| small()).collect();
        let with = |seed| [before.clone(), autoregressive_signal(6000, seed)].concat();
        let (e, u) = (with(1), with(2));
        let used = vec![false; 7500];
        let found = idle_stretches(&[&e, &u], &used, 0.01);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].start == 0 && (1500..1510).contains(&found[0].end), "{found:?}");
        assert!(idle_stretches(&[&e[1500..], &u[1500..]], &used[1500..], 0.01).is_empty());
        assert!(
            idle_stretches(&[&e[1500..], &u[..6000]], &used[1500..], 0.01).is_empty(),
            "one of them moves"
        );
        assert!(
            idle_stretches(&[], &[], 0.01).is_empty() && idle_stretches(&[&[1.0; 500]], &used[..500], 0.01).is_empty()
        );
    }
}
