//! The value at which a stick rests.
//!
//! A stick with a dead zone or breakout gives exactly one value as long as the hand force is small. The same value
//! recurs if the hand works in pulses and releases the stick between them. Pilots leave the stick there for up to half
//! of the samples, and for seconds at a time. This is normal control and not a fault of the recording.
//!
//! The rest is the most frequent value, if it makes up at least [`MIN_REST_SHARE`] of the samples, is reached at least
//! [`MIN_VISITS`] times, and is at least [`MIN_RATIO_TO_OTHERS`] times as frequent as any other value. The levels of a
//! quantised channel have similar frequencies, and a frozen channel stops only once. The largest and the smallest value
//! of the channel cannot be the rest.

use std::ops::Range;

use super::robust::quantile;

const MIN_REST_SHARE: f64 = 0.1;
const MIN_VISITS: usize = 10;
const MIN_RATIO_TO_OTHERS: f64 = 4.0;

/// The rest of a stick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StickRest {
    /// Value of the signal at rest.
    pub value: f64,
    /// Share of the samples at the rest.
    pub share: f64,
    /// Number of times that the signal reaches the rest.
    pub visits: usize,
    /// 90 % quantile of the lengths of the visits to the rest, samples.
    pub typical_samples: f64,
}

impl StickRest {
    /// Returns the rest of a channel; `None` if the channel has no rest.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let mut counts: Vec<(usize, f64)> = (sorted.chunk_by(|a, b| a == b))
            .map(|equal| (equal.len(), equal[0]))
            .collect();
        let ends = [counts.first()?.1, counts.last()?.1];
        counts.sort_unstable_by_key(|(count, _)| std::cmp::Reverse(*count));
        let (most, value) = counts[0];
        let next = counts.get(1).map_or(0, |(count, _)| *count);
        let share = most as f64 / values.len() as f64;
        if share < MIN_REST_SHARE || (most as f64) < MIN_RATIO_TO_OTHERS * next as f64 || ends.contains(&value) {
            return None;
        }
        let mut lengths: Vec<f64> = (runs(values).iter())
            .filter(|run| values[run.start] == value)
            .map(|run| run.len() as f64)
            .collect();
        let visits = lengths.len();
        (visits >= MIN_VISITS).then(|| Self {
            value,
            share,
            visits,
            typical_samples: quantile(&mut lengths, 0.9),
        })
    }
}

/// Returns the runs of equal values, including runs of a single sample.
pub(super) fn runs(values: &[f64]) -> Vec<Range<usize>> {
    let mut all: Vec<Range<usize>> = Vec::new();
    for (t, v) in values.iter().enumerate() {
        match all.last_mut() {
            Some(run) if values[run.start] == *v => run.end = t + 1,
            _ => all.push(t..t + 1),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::{super::test_signals::autoregressive_signal, *};

    #[test]
    fn rest_is_found_only_in_dead_zones_and_pulses() {
        let u = autoregressive_signal(6000, 3);
        assert_eq!(StickRest::of(&u), None);
        let zone = |width: f64| -> Vec<f64> { u.iter().map(|v| v - v.clamp(-width, width)).collect() };
        let rest = StickRest::of(&zone(1.5)).unwrap();
        let at_rest = zone(1.5).iter().filter(|v| **v == 0.0).count();
        assert_eq!((rest.value, rest.share), (0.0, at_rest as f64 / 6000.0));
        assert!(rest.visits > 50 && rest.typical_samples > 2.0, "{rest:?}");
        let pulses: Vec<f64> = u
            .iter()
            .map(|v| if v.abs() < 4.0 { 0.7 } else { 0.7 + v.signum() })
            .collect();
        assert_eq!(StickRest::of(&pulses).map(|r| r.value), Some(0.7));
        for steps in [0.1, 1.0, 3.0] {
            let rounded: Vec<f64> = u.iter().map(|v| (v / steps).round()).collect();
            assert_eq!(StickRest::of(&rounded), None, "steps of {steps}");
        }
        let mut frozen = u.clone();
        frozen[1000..3000].fill(0.0);
        assert_eq!(StickRest::of(&frozen), None);
        let rail: Vec<f64> = u.iter().map(|v| v.max(0.0)).collect();
        assert_eq!(StickRest::of(&rail), None);
        assert_eq!(StickRest::of(&[]), None);
        assert_eq!(StickRest::of(&[f64::NAN; 40]), None);
        assert_eq!(StickRest::of(&[2.0; 40]), None);
    }
}
