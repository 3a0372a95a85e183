//! Treatment of constant signals in a recursion without a guard.
//!
//! If e and u stay constant, the regressor is zero or constant and the innovations vanish. Their variance, a mean of
//! `eps^2/(1 + h' Sigma h)` with an exponential memory ([`hoid_core::innovation_variance`]), decays to zero as
//! `lambda^t`, while the covariance divided by this variance grows by at most `1/lambda` per sample, in unexcited
//! directions only, and up to its bound. The error bars, the square roots of the products of both, go to zero although
//! nothing is learnt. Such samples carry no information about parameters or noise, since neither is excited (G. C.
//! Goodwin and K. S. Sin, *Adaptive Filtering Prediction and Control*, 1984, section 3.4; K. J. Åström and B.
//! Wittenmark, *Adaptive Control*, 2nd ed. 1995, section 11.5, conditional updating). They therefore enter only the
//! filters:
//!
//! - A signal is **stationary** while it stays within [`STATIONARY_SHARE`] of its typical size from its value at the
//!   start of the stationary span. The typical size is the geometric mean, over blocks of one second, of the largest
//!   distance from the value at the start of the block. Before ten blocks are known, a span is stationary only if all
//!   its values are equal.
//! - There is **no information** if both e and u are stationary for [`MIN_STATIONARY_BOTH_S`], or one of the two for
//!   [`MIN_STATIONARY_ONE_S`]: a frozen channel, or a resting hand, which cannot be distinguished from a hand that does
//!   not respond.
//! - The recursion is then restored exactly to its state before the first sample of the span (or before a jump to the
//!   value of the span): a stored state is restored, and the recursion takes the samples from then on again. Estimate,
//!   covariance and innovation variance keep their values of that time for the whole span.
//! - The estimate is updated again once both signals move and the filters have settled ([`crate::guard`]).
//!
//! Without stationary spans, the results are the same with and without this watch. At sample times below 40 us, there
//! is no watch.

use hoid_core::state::{State, visit_all};
use hoid_model::SampleTime;

use crate::{
    guard::{GuardAction, GuardChannel, GuardDecision, GuardEvent, GuardKind, SETTLING_S, Snapshot},
    recursion::{Recursion, Sample, StepOutcome},
};

/// Share of its typical size within which a signal is stationary.
const STATIONARY_SHARE: f64 = 0.02;
/// Shortest stationary span of both signals that carries no information (in s).
pub(crate) const MIN_STATIONARY_BOTH_S: f64 = 1.0;
/// Shortest stationary span of one signal that carries no information (in s).
const MIN_STATIONARY_ONE_S: f64 = 5.0;
/// Smallest number of samples in a stationary span.
const MIN_SAMPLES: u64 = 20;
/// Number of blocks after which the typical size of a signal is known.
const MIN_BLOCKS: u32 = 10;
/// Largest number of blocks over which the typical size is averaged.
const MAX_AVERAGED_BLOCKS: u32 = 60;
/// Largest number of samples between two stored states.
const MAX_STATE_AGE_SAMPLES: u64 = 1 << 17;
/// Number of channels: e and u.
const CHANNEL_COUNT: usize = 2;

/// Way in which a recursion uses a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RecursionCall {
    /// Filters and estimate are updated.
    Step,
    /// Only the filters are updated.
    Follow,
    /// Only the filters are updated, with the prediction of u.
    Bridge,
}

impl RecursionCall {
    const ALL: [Self; 3] = [Self::Step, Self::Follow, Self::Bridge];

    /// Passes the sample to the recursion; returns `None` if u is missing.
    #[inline]
    pub fn on(self, recursion: &mut dyn Recursion, sample: Sample) -> Option<StepOutcome> {
        match self {
            Self::Step => Some(recursion.step(sample)),
            Self::Follow => Some(recursion.step_without_update(sample)),
            Self::Bridge => {
                recursion.bridge(sample);
                None
            }
        }
    }
}

/// A sample that may have to be taken again.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct BufferedSample {
    values: [f64; CHANNEL_COUNT],
    /// External signal; NaN if there is none.
    reference: f64,
    act: usize,
}

hoid_core::state!([] BufferedSample { values, reference, act });

impl BufferedSample {
    fn sample(&self) -> Sample {
        Sample {
            e: self.values[0],
            u: self.values[1],
            reference: (!self.reference.is_nan()).then_some(self.reference),
        }
    }
}

/// Duration of the stationary span of a signal, and its typical size.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Channel {
    /// Value at which the span started, number of samples since then, and number of times that the last value was
    /// repeated.
    value: f64,
    stationary_samples: u64,
    same: u64,
    last: f64,
    /// Largest step in the previous block and in this one, and whether the signal made a larger step at the start of
    /// the span and at the start of the repeated value.
    steps: [f64; 2],
    jumped: [bool; 2],
    tolerance: f64,
    /// Value at the start of the block, and the largest distance from it so far.
    first: f64,
    largest: f64,
    /// Mean logarithm of the largest distances, and number of blocks in this mean.
    size: f64,
    blocks: u32,
}

hoid_core::state!([] Channel { value, stationary_samples, same, last, steps, jumped, tolerance, first, largest, size, blocks });

impl Channel {
    /// A channel before the first sample.
    const INITIAL: Self = Self {
        value: f64::NAN,
        stationary_samples: 0,
        same: 0,
        last: f64::NAN,
        steps: [0.0; 2],
        jumped: [false; 2],
        tolerance: 0.0,
        first: 0.0,
        largest: 0.0,
        size: 0.0,
        blocks: 0,
    };

    #[inline]
    fn update(&mut self, x: f64, missing: bool) {
        let step = (x - self.last).abs();
        let jumped = step > self.steps[0].max(self.steps[1]);
        if !missing && step == 0.0 {
            self.same = self.same.saturating_add(1);
        } else {
            (self.same, self.jumped[1]) = (0, jumped);
        }
        if !missing && (x - self.value).abs() <= self.tolerance {
            self.stationary_samples = self.stationary_samples.saturating_add(1);
        } else {
            (self.value, self.stationary_samples, self.jumped[0]) = (x, 0, jumped);
        }
        self.last = x;
        self.steps[1] = self.steps[1].max(step);
        self.largest = self.largest.max((x - self.first).abs());
    }

    /// Returns the number of samples of the current stationary span that must be undone, and true if the signal jumped
    /// at its start, so the sample before it must also be undone. `least` is the shortest span without information; if
    /// the last value was repeated for three quarters of this length, only its repetitions are counted.
    fn samples_to_undo(&self, least: u64) -> (u64, bool) {
        if self.same.saturating_mul(4) >= least.saturating_mul(3) {
            (self.same, self.jumped[1])
        } else {
            (self.stationary_samples, self.jumped[0])
        }
    }

    fn end_block(&mut self, x: f64) {
        self.steps = [self.steps[1], 0.0];
        let distance = std::mem::take(&mut self.largest);
        self.first = x;
        // The size of a signal is not learnt from blocks within a stationary span.
        if distance <= self.tolerance || !distance.is_finite() {
            return;
        }
        self.blocks = self.blocks.saturating_add(1);
        self.size += (distance.ln() - self.size) / f64::from(self.blocks.min(MAX_AVERAGED_BLOCKS));
        if self.blocks >= MIN_BLOCKS {
            self.tolerance = STATIONARY_SHARE * self.size.exp();
        }
    }
}

/// The stationarity watch of a recursion.
#[derive(Debug, Clone)]
pub(crate) struct StationaryWatch {
    /// Numbers of samples: shortest stationary span of both signals, and of one signal, without information; in a
    /// block; until the filters have settled.
    both: u64,
    one: u64,
    block: u64,
    settle: u64,
    samples: u64,
    channels: [Channel; CHANNEL_COUNT],
    /// State of the recursion before the first stored sample, and before the stored sample with index `since`.
    kept: [Snapshot; 2],
    since: usize,
    ring: Vec<BufferedSample>,
    /// Number of samples of the pause so far, and number of consecutive samples in which both signals move; zero
    /// outside a pause.
    paused: u64,
    moving: u64,
    channel: usize,
    event: Option<GuardEvent>,
}

impl State for StationaryWatch {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        let mut length = self.ring.len();
        visit_all(
            &mut [
                &mut self.samples,
                &mut self.channels,
                &mut self.kept,
                &mut self.since,
                &mut length,
            ],
            each,
        );
        let longest = (self.one as usize).saturating_mul(2);
        self.ring.resize(length.min(longest), BufferedSample::default());
        self.since = self.since.min(self.ring.len());
        visit_all(
            &mut [
                &mut self.ring.as_mut_slice(),
                &mut self.paused,
                &mut self.moving,
                &mut self.channel,
            ],
            each,
        );
        self.channel = self.channel.min(GuardChannel::ALL.len().saturating_sub(1));
    }
}

impl StationaryWatch {
    /// Builds the watch for a recursion with a delay of nk samples; `None` if the sample time is too short.
    pub fn new(nk: usize, sample_time: SampleTime) -> Option<Self> {
        let samples = |seconds: f64| ((seconds / sample_time.s()).round() as u64).max(MIN_SAMPLES);
        let one = samples(MIN_STATIONARY_ONE_S);
        (one <= MAX_STATE_AGE_SAMPLES).then(|| Self {
            both: samples(MIN_STATIONARY_BOTH_S),
            one,
            block: ((1.0 / sample_time.s()).round() as u64).max(4),
            settle: (nk as u64).saturating_add((SETTLING_S / sample_time.s()).round() as u64),
            samples: 0,
            channels: [Channel::INITIAL; CHANNEL_COUNT],
            kept: [Snapshot::default(), Snapshot::default()],
            since: 0,
            ring: Vec::new(),
            paused: 0,
            moving: 0,
            channel: 0,
            event: None,
        })
    }

    /// Passes a sample to the recursion.
    #[inline]
    pub fn process(&mut self, recursion: &mut dyn Recursion, sample: Sample, act: RecursionCall) -> GuardDecision {
        self.event = None;
        let x = [sample.e, sample.u];
        for (channel, x) in self.channels.iter_mut().zip(x) {
            channel.update(x, act == RecursionCall::Bridge);
        }
        self.samples = self.samples.saturating_add(1);
        if self.samples.is_multiple_of(self.block) {
            for (channel, x) in self.channels.iter_mut().zip(x) {
                channel.end_block(x);
            }
        }
        if self.paused > 0 {
            return self.process_paused(recursion, sample, act);
        }
        if self.ring.is_empty() || self.ring.len().saturating_sub(self.since) >= self.one as usize {
            self.store_state(recursion);
        }
        self.ring.push(BufferedSample {
            values: x,
            reference: sample.reference.unwrap_or(f64::NAN),
            act: RecursionCall::ALL.iter().position(|a| *a == act).unwrap_or(0),
        });
        if act == RecursionCall::Step
            && let Some((channel, stood)) = self.stationary_channel()
        {
            return self.start_pause(recursion, channel, stood, sample);
        }
        GuardDecision {
            outcome: act.on(recursion, sample),
            held: false,
        }
    }

    /// Returns the channel whose stationary span carries no information, and the number of samples that must be undone.
    #[inline]
    fn stationary_channel(&self) -> Option<(GuardChannel, u64)> {
        let [input, output] = &self.channels;
        let (e, u) = (input.stationary_samples, output.stationary_samples);
        let all = |(repeats, jumped): (u64, bool)| repeats.saturating_add(u64::from(jumped));
        if e.min(u) >= self.both {
            let (e, u) = (input.samples_to_undo(self.both), output.samples_to_undo(self.both));
            let shorter = if e.0 == u.0 { (e.0, e.1 || u.1) } else { e.min(u) };
            Some((GuardChannel::Both, all(shorter)))
        } else if e >= self.one {
            Some((GuardChannel::Input, all(input.samples_to_undo(self.one))))
        } else if u >= self.one {
            Some((GuardChannel::Output, all(output.samples_to_undo(self.one))))
        } else {
            None
        }
    }

    /// Stores the state of the recursion before the next sample, and drops the older of two stored states with its
    /// samples.
    fn store_state(&mut self, recursion: &mut dyn Recursion) {
        self.ring.drain(..self.since);
        self.since = self.ring.len();
        self.kept.swap(0, 1);
        self.kept[1].take(recursion);
        if self.ring.is_empty() {
            self.kept[0] = self.kept[1].clone();
        }
    }

    /// Restores the recursion to its state before the last `stood` samples; these samples then update only the filters.
    #[cold]
    fn start_pause(
        &mut self,
        recursion: &mut dyn Recursion,
        channel: GuardChannel,
        stood: u64,
        sample: Sample,
    ) -> GuardDecision {
        let last = self.ring.len().saturating_sub(1);
        let begin = last.checked_sub(stood.saturating_sub(1) as usize);
        // If the span starts before the stored samples, nothing is undone, because the earlier samples did not change
        // the estimate.
        if let Some(begin) = begin {
            let [older, newer] = &self.kept;
            let (kept, first) = match begin >= self.since {
                true => (newer, self.since),
                false => (older, 0),
            };
            kept.restore(recursion);
            for (at, taken) in self.ring.iter().enumerate().take(last).skip(first) {
                let act = match RecursionCall::ALL
                    .get(taken.act)
                    .copied()
                    .unwrap_or(RecursionCall::Bridge)
                {
                    RecursionCall::Step if at >= begin => RecursionCall::Follow,
                    act => act,
                };
                act.on(recursion, taken.sample());
            }
        }
        let outcome = RecursionCall::Follow.on(recursion, sample);
        self.ring.clear();
        self.since = 0;
        self.paused = stood.max(1);
        self.moving = 0;
        self.channel = GuardChannel::ALL.iter().position(|c| *c == channel).unwrap_or(0);
        self.report(GuardAction::Paused, Some(stood));
        GuardDecision { outcome, held: true }
    }

    #[cold]
    fn process_paused(&mut self, recursion: &mut dyn Recursion, sample: Sample, act: RecursionCall) -> GuardDecision {
        let act = if act == RecursionCall::Bridge {
            act
        } else {
            RecursionCall::Follow
        };
        let outcome = act.on(recursion, sample);
        self.paused = self.paused.saturating_add(1);
        self.moving = match self.may_become_stationary() {
            true => 0,
            false => self.moving.saturating_add(1),
        };
        if self.moving >= self.settle {
            self.report(GuardAction::Resumed, None);
            self.paused = 0;
        }
        GuardDecision { outcome, held: true }
    }

    /// True while one or both signals have been stationary for half of the time after which they carry no information.
    fn may_become_stationary(&self) -> bool {
        let [e, u] = self
            .channels
            .map(|channel| channel.stationary_samples.saturating_mul(2));
        e.min(u) >= self.both || e >= self.one || u >= self.one
    }

    fn report(&mut self, action: GuardAction, withdrawn: Option<u64>) {
        let channel = GuardChannel::ALL
            .get(self.channel)
            .copied()
            .unwrap_or(GuardChannel::Both);
        self.event = Some(GuardEvent {
            kind: match channel {
                GuardChannel::Both => GuardKind::Idle,
                _ => GuardKind::Frozen,
            },
            channel,
            ago: self.paused.saturating_sub(1),
            samples: self.paused.saturating_sub(self.moving),
            size: 0.0,
            action,
            withdrawn,
        });
    }

    /// Returns the event reported at the last sample.
    pub fn event(&self) -> Option<GuardEvent> {
        self.event
    }

    /// True while the estimate stays constant.
    pub fn is_paused(&self) -> bool {
        self.paused > 0
    }
}
