//! Order of the searches for faults, and the action for each fault.
//!
//! Wraps are searched for first, since they look like jumps, and then long faults: stretches in other units, idle
//! stretches and frozen channels. Spikes and steps are searched for in the remaining stretches, because an
//! autoregression of a record that is half idle describes neither half.

use std::ops::Range;

use hoid_model::{FaultAction, FaultKind};

use super::{
    constant_spans, levels,
    limits::{MAX_BRIDGED_S, MAX_SPIKE_SHARE},
    spikes,
};

/// Minimum length of a stretch between long faults for it to be searched for spikes and steps, samples.
const MIN_LENGTH: usize = 100;

/// A fault and the affected samples.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FaultSpan {
    pub kind: FaultKind,
    /// Index of the channel, e or u; `None` if both are affected.
    pub channel: Option<usize>,
    pub samples: Range<usize>,
    pub size: f64,
    pub deviations: Option<f64>,
}

/// Finds the faults of the channels of one record and returns them in order of time, each with its action. Channels
/// that wrap are unwrapped. Short faults are bridged, or cut out if `cut` is true.
pub(super) fn find_faults(values: &mut [Vec<f64>], ts: f64, cut: bool) -> Vec<(FaultSpan, FaultAction)> {
    let n = values.first().map_or(0, Vec::len);
    let long = |samples: &Range<usize>| samples.len() as f64 * ts > MAX_BRIDGED_S * (1.0 + 1e-9);
    let repaired = |samples: &Range<usize>| {
        if cut || long(samples) {
            FaultAction::Cut
        } else {
            FaultAction::Bridged
        }
    };
    let mut found: Vec<(FaultSpan, FaultAction)> = Vec::new();
    for (channel, values) in values.iter_mut().enumerate() {
        if let Some(wrap) = levels::find_wrap(values, ts) {
            *values = wrap.unwrapped;
            let place = FaultSpan {
                kind: FaultKind::Wrap,
                channel: Some(channel),
                samples: wrap.samples,
                size: wrap.modulus,
                deviations: None,
            };
            found.push((place, FaultAction::Bridged));
        }
    }
    let mut out = vec![false; n];
    for place in lasting_faults(values, ts) {
        let action = repaired(&place.samples);
        match (action, place.channel) {
            (FaultAction::Bridged, Some(channel)) => spikes::bridge(&mut values[channel], place.samples.clone()),
            _ => out[place.samples.clone()].fill(true),
        }
        found.push((place, action));
    }
    for (channel, values) in values.iter_mut().enumerate() {
        let before = values.clone();
        let mut of_channel: Vec<FaultSpan> = Vec::new();
        for stretch in stretches(&out) {
            let part = &mut values[stretch.clone()];
            for (at, size, deviations) in levels::steps(part, ts) {
                let place = FaultSpan {
                    kind: FaultKind::Step,
                    channel: Some(channel),
                    samples: stretch.start + at..stretch.start + at + 1,
                    size,
                    deviations: Some(deviations),
                };
                found.push((place, FaultAction::Cut));
            }
            of_channel.extend(spikes::find_spikes(part, ts).into_iter().map(|spike| FaultSpan {
                kind: FaultKind::Spike,
                channel: Some(channel),
                samples: stretch.start + spike.samples.start..stretch.start + spike.samples.end,
                size: spike.size,
                deviations: Some(spike.deviations),
            }));
        }
        let total: usize = of_channel.iter().map(|place| place.samples.len()).sum();
        let too_many = total as f64 > (MAX_SPIKE_SHARE * n as f64).max(3.0);
        if cut || too_many {
            *values = before;
        }
        for place in of_channel {
            let action = if too_many {
                FaultAction::Reported
            } else {
                repaired(&place.samples)
            };
            found.push((place, action));
        }
    }
    found.sort_by_key(|(place, _)| (place.samples.start, place.channel));
    found
}

/// Returns stretches in other units, idle stretches and frozen channels.
fn lasting_faults(values: &[Vec<f64>], ts: f64) -> Vec<FaultSpan> {
    let mut all: Vec<FaultSpan> = Vec::new();
    for (channel, values) in values.iter().enumerate() {
        all.extend(
            levels::scale_changes(values, ts)
                .into_iter()
                .map(|(samples, factor)| FaultSpan {
                    kind: FaultKind::Scale,
                    channel: Some(channel),
                    samples,
                    size: factor,
                    deviations: None,
                }),
        );
    }
    let both: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
    if both.len() > 1 {
        let mut out = vec![false; both[0].len()];
        all.iter().for_each(|place| out[place.samples.clone()].fill(true));
        all.extend(
            constant_spans::idle_stretches(&both, &out, ts)
                .into_iter()
                .map(|samples| FaultSpan {
                    kind: FaultKind::Idle,
                    channel: None,
                    size: samples.len() as f64 * ts,
                    samples,
                    deviations: None,
                }),
        );
    }
    let known: Vec<Range<usize>> = all.iter().map(|place| place.samples.clone()).collect();
    for (channel, values) in values.iter().enumerate() {
        let other = both.iter().enumerate().find(|(c, _)| *c != channel).map(|(_, v)| *v);
        for hold in constant_spans::frozen_holds(values, other, ts) {
            if known
                .iter()
                .any(|k| k.start < hold.samples.end && hold.samples.start < k.end)
            {
                continue;
            }
            all.push(FaultSpan {
                kind: if hold.jump.is_some() {
                    FaultKind::Dropout
                } else {
                    FaultKind::Frozen
                },
                channel: Some(channel),
                size: hold.jump.unwrap_or(hold.samples.len() as f64 * ts),
                samples: hold.samples,
                deviations: None,
            });
        }
    }
    all
}

/// Returns the stretches of at least [`MIN_LENGTH`] samples outside long faults (`out`).
fn stretches(out: &[bool]) -> Vec<Range<usize>> {
    let mut all: Vec<Range<usize>> = Vec::new();
    for t in (0..out.len()).filter(|t| !out[*t]) {
        match all.last_mut() {
            Some(last) if last.end == t => last.end = t + 1,
            _ => all.push(t..t + 1),
        }
    }
    all.retain(|stretch| stretch.len() >= MIN_LENGTH);
    all
}
