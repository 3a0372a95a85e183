//! Spikes: one or a few samples that are inconsistent with their neighbours.
//!
//! Two explanations of a large innovation are compared (A. J. Fox, *J. Royal Statistical Society B* 34 (1972) 350-363;
//! I. Chang, G. C. Tiao and C. Chen, *Technometrics* 30 (1988) 193-204). A *push* by the person enters the innovations:
//! it moves the channel, which then continues with its normal dynamics. A *fault* is added only to the samples: each
//! following innovation is off by a multiple of a coefficient of A, and the channel continues as if nothing had
//! happened. For m samples from sample s on, the two explanations leave:
//!
//! | explanation | residual sum `S = sum eps^2/sigma^2` |
//! |---|---|
//! | m pushes | `S` without the m largest terms |
//! | m faulty samples | `S` after [interpolation](super::interpolation) of the faulty samples |
//!
//! Each explanation has m unknowns. The faulty samples are the smallest set whose interpolation
//!
//! 1. reduces the sum by more than [`ROOT_OF_MIN_REDUCTION`]^2, which happens once in 1e15 samples for normal
//!    innovations;
//! 2. leaves less of the sum than m pushes leave, by more than [`ROOT_OF_MIN_ADVANTAGE`]^2; the advantage is also more
//!    than [`MIN_ADVANTAGE_SHARE`] of the reduction, or the pushes leave more than [`MIN_SUM_RATIO`] times as much
//!    (several faulty samples of a smooth channel give a few more large innovations than there are pushes, and their
//!    squares make up nearly all of S);
//! 3. leaves no innovation beyond [`MAX_INNOVATION`] sigma (or at most a twentieth of S);
//! 4. moves a sample by more than [`MIN_CHANGE`] deviations of the channel, and by more than two of its quantisation
//!    steps.
//!
//! The first samples of a record are searched in reversed time, where they are the last samples: a Gaussian
//! autoregression is the same in both directions.
//!
//! In a channel without memory, and at the last sample of a record, the two explanations do not differ; there a sample
//! beyond [`IMPOSSIBLE_DEVIATION`] deviations is faulty. sigma is the median absolute innovation over 0.6745, of the
//! whole record or of the seconds around the sample, whichever is larger: the remnant is not stationary and depends on
//! u. The faults are bridged, the autoregression is fitted again, and the search is repeated (C. Chen and L. M. Liu,
//! *J. American Statistical Association* 88 (1993) 284-297).

use std::ops::Range;

use super::{
    autoregression::{Autoregression, NOISE_FLOOR},
    interpolation::{Interpolation, apply_change},
    robust::{level_and_deviation, median, quantisation_step},
};

/// Square root of the minimum reduction in S.
const ROOT_OF_MIN_REDUCTION: f64 = 8.0;
/// Square root of the minimum advantage of faults over pushes in S.
const ROOT_OF_MIN_ADVANTAGE: f64 = 5.0;
/// Minimum advantage of faults over pushes, as a share of the reduction in S by interpolation.
const MIN_ADVANTAGE_SHARE: f64 = 0.2;
/// Minimum ratio of the sum that pushes leave to the sum that faults (or noise alone) leave. It applies if the
/// advantage of faults is less than the share [`MIN_ADVANTAGE_SHARE`].
const MIN_SUM_RATIO: f64 = 20.0;
/// Largest innovation that may remain after interpolation, as a multiple of sigma.
const MAX_INNOVATION: f64 = 5.0;
/// Innovation at which a search for a fault starts, as a multiple of sigma.
const START_INNOVATION: f64 = 4.0;
/// Minimum change in a faulty sample by interpolation, relative to the deviation of the channel.
const MIN_CHANGE: f64 = 1.5;
/// Deviation that no person reaches within a few samples, in robust deviations of the channel.
const IMPOSSIBLE_DEVIATION: f64 = 20.0;
const MAX_ROUNDS: usize = 4;

/// A spike: samples that are not part of the signal.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Spike {
    pub samples: Range<usize>,
    /// Largest deviation of the samples from their interpolation, with its sign.
    pub size: f64,
    /// Square root of the reduction in S by interpolation.
    pub deviations: f64,
}

/// Finds the spikes of a channel and bridges them.
pub(super) fn find_spikes(values: &mut [f64], sample_time_s: f64) -> Vec<Spike> {
    let (level, deviation) = level_and_deviation(values);
    let mut x: Vec<f64> = values.iter().map(|v| v - level).collect();
    let step = quantisation_step(values);
    let window = ((1.0 / sample_time_s) as usize).clamp(64, 4096);
    // A spike is at most as long as a fault that is bridged, and has at most 12 samples.
    let longest = ((super::limits::MAX_BRIDGED_S / sample_time_s).round() as usize).clamp(1, 12);
    let mut found: Vec<Spike> = Vec::new();
    for _ in 0..MAX_ROUNDS {
        let Some(ar) = Autoregression::of(&x, deviation) else {
            break;
        };
        let mut eps = ar.residuals(&x);
        let sigma = innovation_scales(&eps, window, (NOISE_FLOOR * deviation).max(step) * ar.norm());
        let search = Search {
            ar: &ar,
            sigma: &sigma,
            smallest: (MIN_CHANGE * deviation).max(2.0 * step),
            deviation,
            longest,
            context_samples: effective_length(&ar),
        };
        let mut new = search.search_round(&mut x, &mut eps);
        new.extend(search.search_start(&mut x));
        if new.is_empty() {
            break;
        }
        found.extend(new);
    }
    for spike in &found {
        for t in spike.samples.clone() {
            values[t] = level + x[t];
        }
    }
    join_adjacent(found)
}

/// Replaces these samples by an interpolation from their neighbours.
pub(super) fn bridge(values: &mut [f64], samples: Range<usize>) {
    let (level, deviation) = level_and_deviation(values);
    let x: Vec<f64> = values.iter().map(|v| v - level).collect();
    let Some(ar) = Autoregression::of(&x, deviation) else {
        return;
    };
    let eps = ar.residuals(&x);
    let found = Interpolation::new(&ar, &eps, samples.start, samples.len());
    let m = found.max_samples();
    for (t, change) in samples.zip(found.change(m)) {
        values[t] += change;
    }
}

/// Returns the lag up to which the coefficients of the autoregression make up 95 % of `|a|^2`.
fn effective_length(ar: &Autoregression) -> usize {
    let total = ar.norm().powi(2);
    let mut sum = 0.0;
    let held = ar.a.iter().position(|a| {
        sum += a * a;
        sum >= 0.95 * total
    });
    held.unwrap_or(ar.order())
}

/// Returns the scale of the innovations in each window: the largest of the scales of the window, its neighbours and the
/// whole channel, and at least `least`.
pub(super) fn innovation_scales(eps: &[f64], window: usize, least: f64) -> Scales {
    let sizes: Vec<f64> = eps.iter().map(|e| e.abs()).collect();
    let of = |part: &[f64]| median(part) / 0.674_489_75;
    let all = of(&sizes).max(least);
    let local: Vec<f64> = sizes.chunks(window).map(of).collect();
    let around = |k: usize| {
        let near = &local[k.saturating_sub(1)..(k + 2).min(local.len())];
        near.iter().copied().fold(all, f64::max)
    };
    Scales {
        window_scales: (0..local.len()).map(around).collect(),
        window,
    }
}

pub(super) struct Scales {
    window_scales: Vec<f64>,
    window: usize,
}

impl Scales {
    pub(super) fn at(&self, t: usize) -> f64 {
        self.window_scales[t / self.window]
    }
}

struct Search<'a> {
    ar: &'a Autoregression,
    sigma: &'a Scales,
    smallest: f64,
    deviation: f64,
    longest: usize,
    context_samples: usize,
}

impl Search<'_> {
    /// Searches the first samples in reversed time, bridges their spikes and returns them.
    fn search_start(&self, x: &mut [f64]) -> Vec<Spike> {
        let p = self.ar.order();
        let length = x.len().min(8 * p);
        let mut backwards: Vec<f64> = x[..length].iter().rev().copied().collect();
        let mut eps = self.ar.residuals(&backwards);
        let found = self.search_round(&mut backwards, &mut eps);
        let mut kept = Vec::new();
        for spike in found.into_iter().filter(|spike| spike.samples.start >= length - p) {
            let samples = length - spike.samples.end..length - spike.samples.start;
            for t in samples.clone() {
                x[t] = backwards[length - 1 - t];
            }
            kept.push(Spike { samples, ..spike });
        }
        kept
    }

    fn search_round(&self, x: &mut [f64], eps: &mut [f64]) -> Vec<Spike> {
        let mut found = Vec::new();
        let mut t = self.ar.order();
        while t < x.len() {
            if eps[t].abs() <= START_INNOVATION * self.sigma.at(t) {
                t += 1;
                continue;
            }
            match self.at(x, eps, t) {
                Some((spike, delta)) => {
                    apply_change(self.ar, eps, t, &delta);
                    for (k, change) in spike.samples.clone().zip(&delta) {
                        x[k] += change;
                    }
                    t = spike.samples.end;
                    found.push(spike);
                }
                None => t += 1,
            }
        }
        found
    }

    /// Returns the spike that starts at sample `start`, with the changes of its samples; `None` if there is no spike.
    fn at(&self, x: &[f64], eps: &[f64], start: usize) -> Option<(Spike, Vec<f64>)> {
        let sigma = self.sigma.at(start);
        let all = Interpolation::new(self.ar, eps, start, self.longest);
        for m in 1..=all.max_samples() {
            let fall = all.sum_decrease(m) / (sigma * sigma);
            if fall < ROOT_OF_MIN_REDUCTION * ROOT_OF_MIN_REDUCTION {
                continue;
            }
            let rows = start..(start + m + self.context_samples).min(eps.len());
            let delta = all.change(m);
            let size = delta
                .iter()
                .copied()
                .fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
            if size.abs() < self.smallest {
                continue;
            }
            let mut after = eps[rows.start..(start + m + self.ar.order()).min(eps.len())].to_vec();
            self.apply_change_from(&mut after, rows.start, start, &delta);
            let left: Vec<f64> = after[..rows.len()].iter().map(|e| (e / sigma).powi(2)).collect();
            let mut before: Vec<f64> = eps[rows].iter().map(|e| (e / sigma).powi(2)).collect();
            let total: f64 = before.iter().sum();
            let left_by_faults: f64 = left.iter().sum();
            before.sort_unstable_by(|a, b| b.total_cmp(a));
            let left_by_pushes: f64 = before.iter().skip(m).sum();
            let better = left_by_pushes - left_by_faults;
            let largest = left.iter().copied().fold(0.0, f64::max);
            let clean = largest <= MAX_INNOVATION * MAX_INNOVATION || left_by_faults <= 0.05 * total;
            let decisive = left_by_pushes > MIN_SUM_RATIO * left_by_faults.max(left.len() as f64);
            let is_fault = clean
                && better > ROOT_OF_MIN_ADVANTAGE * ROOT_OF_MIN_ADVANTAGE
                && (better > MIN_ADVANTAGE_SHARE * fall || decisive);
            let worst = |k: usize| x[start + k].abs();
            let is_wild = m <= 3
                && (0..m).all(|k| worst(k) > IMPOSSIBLE_DEVIATION * self.deviation)
                && size.abs() > IMPOSSIBLE_DEVIATION * self.deviation
                && left_by_faults <= 0.5 * total;
            if is_fault || is_wild {
                let spike = Spike {
                    samples: start..start + m,
                    size: -size,
                    deviations: fall.sqrt(),
                };
                return Some((spike, delta));
            }
        }
        None
    }

    /// Updates the innovations as [`apply_change`] does, for an array that starts at row `first`.
    fn apply_change_from(&self, eps: &mut [f64], first: usize, start: usize, delta: &[f64]) {
        for (i, change) in delta.iter().enumerate() {
            for (lag, a) in self.ar.a.iter().enumerate() {
                let row = (start + i + lag).checked_sub(first);
                if let Some(e) = row.and_then(|row| eps.get_mut(row)) {
                    *e += a * change;
                }
            }
        }
    }
}

/// Joins adjacent spikes into one.
fn join_adjacent(mut all: Vec<Spike>) -> Vec<Spike> {
    all.sort_by_key(|spike| spike.samples.start);
    let mut joined: Vec<Spike> = Vec::new();
    for spike in all {
        match joined.last_mut() {
            Some(last) if spike.samples.start <= last.samples.end => {
                last.samples.end = last.samples.end.max(spike.samples.end);
                last.deviations = last.deviations.max(spike.deviations);
                if spike.size.abs() > last.size.abs() {
                    last.size = spike.size;
                }
            }
            _ => joined.push(spike),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::{super::test_signals::autoregressive_signal, *};

    #[test]
    fn spike_is_found_and_response_to_a_push_is_not() {
        let clean = autoregressive_signal(4000, 11);
        assert!(find_spikes(&mut clean.clone(), 0.01).is_empty());
        let mut faulty = clean.clone();
        faulty[2000] += 30.0;
        let found = find_spikes(&mut faulty, 0.01);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].samples, 2000..2001);
        assert!((found[0].size - 30.0).abs() < 3.0, "{found:?}");
        // The bridged value equals the original sample within the effect of one innovation.
        assert!((faulty[2000] - clean[2000]).abs() < 2.0);
        // The same change through the dynamics of the channel is a push.
        let mut pushed = clean;
        let (mut one, mut two) = (30.0, 0.0);
        for v in &mut pushed[2000..] {
            *v += one;
            (one, two) = (1.6 * one - 0.8 * two, one);
        }
        assert!(find_spikes(&mut pushed, 0.01).is_empty());
    }

    #[test]
    fn adjacent_and_boundary_spikes_are_found() {
        let clean = autoregressive_signal(3000, 2);
        for places in [&[5_usize, 6, 7][..], &[2999], &[0], &[1000, 1004], &[1500, 1514, 1530]] {
            let mut faulty = clean.clone();
            places.iter().for_each(|t| faulty[*t] += 150.0);
            let found = find_spikes(&mut faulty, 0.01);
            for t in places {
                assert!(found.iter().any(|s| s.samples.contains(t)), "{places:?} {found:?}");
            }
            let length: usize = found.iter().map(|s| s.samples.len()).sum();
            assert!(length <= places.len() + 3, "{places:?} {found:?}");
        }
    }

    #[test]
    fn empty_constant_and_short_channels_have_no_spikes() {
        assert!(find_spikes(&mut [], 0.01).is_empty());
        assert!(find_spikes(&mut [1.0; 500], 0.01).is_empty());
        assert!(find_spikes(&mut [1.0, 2.0, 3.0], 0.01).is_empty());
    }

    #[test]
    fn bridge_is_the_conditional_expectation() {
        let clean = autoregressive_signal(2000, 8);
        let mut broken = clean.clone();
        broken[700..705].fill(1e3);
        bridge(&mut broken, 700..705);
        for t in 700..705 {
            assert!((broken[t] - clean[t]).abs() < 6.0, "{t} {} {}", broken[t], clean[t]);
        }
    }
}
