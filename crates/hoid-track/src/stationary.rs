//! Behaviour of a recursion without a guard while the signals are constant.
//!
//! Where e and u stay constant the regressor is zero or constant, the innovations vanish, and their variance, a mean of
//! `eps^2/(1 + h' Sigma h)` with an exponential memory ([`hoid_core::innovation_variance`]), is forgotten to zero: it
//! falls as `lambda^t`, while the covariance over it grows by `1/lambda` a sample at most, in unexcited directions
//! alone, and no further than its bound. The error bars, the root of their product, go to zero while nothing is learnt.
//! Such samples carry no information about parameters or noise, for neither is excited (G. C. Goodwin and K. S. Sin,
//! *Adaptive Filtering Prediction and Control*, 1984, section 3.4; K. J. Åström and B. Wittenmark, *Adaptive Control*,
//! 2nd ed. 1995, section 11.5, conditional updating). So they go into the filters alone:
//!
//! - A signal is **stationary** while it stays within [`SHARE`] of its typical size of the value at which the stand
//!   started. The size is the geometric mean over blocks of a second of the largest distance from the value at the
//!   start of the block; before ten blocks are known, a stand is of one value.
//! - **Nothing arrives** where e and u represent [`BOTH_S`], or one of them for [`ONE_S`]: a channel that is frozen, or
//!   a hand that rests while no answer can be distinguished from none.
//! - The recursion is then put back to the first sample of the stand, bit for bit (a jump to its position is part of
//!   it): to the numbers that were kept before it, from which it takes the samples again. Value, covariance and
//!   innovation variance stay as they are there, however long it lasts.
//! - It continues once both signals move and the filters have settled ([`crate::guard`]).
//!
//! A recursion that never stays constant has the same digits as without. Samples closer than 40 us are not watched.

use hoid_core::state::{State, visit_all};
use hoid_model::SampleTime;

use crate::{
    guard::{GuardAction, GuardChannel, GuardEvent, GuardKind, Guarded, SETTLE_S, Snapshot},
    recursion::{Recursion, Sample, StepOutcome},
};

/// Share of the typical size within which a signal is stationary.
const SHARE: f64 = 0.02;
/// Stationary spans of both signals, and of one of them, from which nothing arrives, s, and least samples of one.
pub(crate) const BOTH_S: f64 = 1.0;
const ONE_S: f64 = 5.0;
const LEAST: u64 = 20;
/// Blocks after which the size of a signal is known, and those over which it is averaged.
const LEARNT: u32 = 10;
const AVERAGED: u32 = 60;
/// Most samples between two snapshots.
const MOST: u64 = 1 << 17;
/// e and u.
const CHANNELS: usize = 2;

/// Action of a recursion on a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Act {
    /// It takes it.
    Step,
    /// The filters take it.
    Follow,
    /// The filters take it, with the prediction of u.
    Bridge,
}

impl Act {
    const ALL: [Self; 3] = [Self::Step, Self::Follow, Self::Bridge];

    /// Does it; no innovation where u is missing.
    #[inline]
    pub fn on(self, recursion: &mut dyn Recursion, sample: Sample) -> Option<StepOutcome> {
        match self {
            Self::Step => Some(recursion.step(sample)),
            Self::Follow => Some(recursion.follow(sample)),
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
    values: [f64; CHANNELS],
    /// NaN for none.
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

/// How long a signal has been stationary, and how large it usually is.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Channel {
    /// Value at which the stand started, samples after it, and the last samples that are the same number.
    value: f64,
    stands: u64,
    same: u64,
    last: f64,
    /// Largest step within the block before and within this one, and whether the signal came to the stand
    /// and to the number by a larger one.
    steps: [f64; 2],
    jumped: [bool; 2],
    tolerance: f64,
    /// Value at the start of the block, and the largest distance from it.
    first: f64,
    largest: f64,
    /// Mean logarithm of these distances, and blocks in it.
    size: f64,
    blocks: u32,
}

hoid_core::state!([] Channel { value, stands, same, last, steps, jumped, tolerance, first, largest, size, blocks });

impl Channel {
    /// Nothing is known.
    const NEW: Self = Self {
        value: f64::NAN,
        stands: 0,
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
    fn take(&mut self, x: f64, missing: bool) {
        let step = (x - self.last).abs();
        let jumped = step > self.steps[0].max(self.steps[1]);
        if !missing && step == 0.0 {
            self.same += 1;
        } else {
            (self.same, self.jumped[1]) = (0, jumped);
        }
        if !missing && (x - self.value).abs() <= self.tolerance {
            self.stands += 1;
        } else {
            (self.value, self.stands, self.jumped[0]) = (x, 0, jumped);
        }
        self.last = x;
        self.steps[1] = self.steps[1].max(step);
        self.largest = self.largest.max((x - self.first).abs());
    }

    /// Samples of a stand of at least so many that are to be taken back: those that repeat one number
    /// where nearly all do, and the one before them where the signal jumped to it.
    fn stood(&self, least: u64) -> (u64, bool) {
        if 4 * self.same >= 3 * least {
            (self.same, self.jumped[1])
        } else {
            (self.stands, self.jumped[0])
        }
    }

    fn end_block(&mut self, x: f64) {
        self.steps = [self.steps[1], 0.0];
        let distance = std::mem::take(&mut self.largest);
        self.first = x;
        // For a stand the size is not learnt.
        if distance <= self.tolerance || !distance.is_finite() {
            return;
        }
        self.blocks = self.blocks.saturating_add(1);
        self.size += (distance.ln() - self.size) / f64::from(self.blocks.min(AVERAGED));
        if self.blocks >= LEARNT {
            self.tolerance = SHARE * self.size.exp();
        }
    }
}

/// The watch of a recursion.
#[derive(Debug, Clone)]
pub(crate) struct StationaryWatch {
    /// Lengths in samples of stationary spans of both signals and of one from which nothing arrives, of a block, until
    /// the filters have settled.
    both: u64,
    one: u64,
    block: u64,
    settle: u64,
    samples: u64,
    channels: [Channel; CHANNELS],
    /// The recursion before the samples that are kept, and before the last `since` of them.
    kept: [Snapshot; 2],
    since: usize,
    ring: Vec<BufferedSample>,
    /// Samples of the pause so far, and in a row in which both move; zero outside of one.
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
        self.ring
            .resize(length.min(2 * self.one as usize), BufferedSample::default());
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
        self.channel = self.channel.min(GuardChannel::ALL.len() - 1);
    }
}

impl StationaryWatch {
    /// For a recursion with a delay of nk samples; none if samples are too close.
    pub fn new(nk: usize, sample_time: SampleTime) -> Option<Self> {
        let samples = |seconds: f64| ((seconds / sample_time.s()).round() as u64).max(LEAST);
        let one = samples(ONE_S);
        (one <= MOST).then(|| Self {
            both: samples(BOTH_S),
            one,
            block: ((1.0 / sample_time.s()).round() as u64).max(4),
            settle: (nk as u64).saturating_add((SETTLE_S / sample_time.s()).round() as u64),
            samples: 0,
            channels: [Channel::NEW; CHANNELS],
            kept: [Snapshot::default(), Snapshot::default()],
            since: 0,
            ring: Vec::new(),
            paused: 0,
            moving: 0,
            channel: 0,
            event: None,
        })
    }

    /// Takes a sample to the recursion.
    #[inline]
    pub fn take(&mut self, recursion: &mut dyn Recursion, sample: Sample, act: Act) -> Guarded {
        self.event = None;
        let x = [sample.e, sample.u];
        for (channel, x) in self.channels.iter_mut().zip(x) {
            channel.take(x, act == Act::Bridge);
        }
        self.samples += 1;
        if self.samples.is_multiple_of(self.block) {
            for (channel, x) in self.channels.iter_mut().zip(x) {
                channel.end_block(x);
            }
        }
        if self.paused > 0 {
            return self.pause(recursion, sample, act);
        }
        if self.ring.is_empty() || self.ring.len() - self.since >= self.one as usize {
            self.keep(recursion);
        }
        self.ring.push(BufferedSample {
            values: x,
            reference: sample.reference.unwrap_or(f64::NAN),
            act: Act::ALL.iter().position(|a| *a == act).unwrap_or(0),
        });
        if act == Act::Step
            && let Some((channel, stood)) = self.stationary_channel()
        {
            return self.begin_pause(recursion, channel, stood, sample);
        }
        Guarded {
            outcome: act.on(recursion, sample),
            held: false,
        }
    }

    /// The channel that has been constant for too long, and the number of samples to undo.
    #[inline]
    fn stationary_channel(&self) -> Option<(GuardChannel, u64)> {
        let [e, u] = self.channels.map(|channel| channel.stands);
        let stood = |c: usize, least: u64| self.channels[c].stood(least);
        let all = |(repeats, jumped): (u64, bool)| repeats + u64::from(jumped);
        if e.min(u) >= self.both {
            let (e, u) = (stood(0, self.both), stood(1, self.both));
            let shorter = if e.0 == u.0 { (e.0, e.1 || u.1) } else { e.min(u) };
            Some((GuardChannel::Both, all(shorter)))
        } else if e >= self.one {
            Some((GuardChannel::Input, all(stood(0, self.one))))
        } else if u >= self.one {
            Some((GuardChannel::Output, all(stood(1, self.one))))
        } else {
            None
        }
    }

    /// Keeps the numbers of the recursion as they are before the next sample, and forgets those of two
    /// snapshots ago.
    fn keep(&mut self, recursion: &mut dyn Recursion) {
        self.ring.drain(..self.since);
        self.since = self.ring.len();
        self.kept.swap(0, 1);
        self.kept[1].take(recursion);
        if self.ring.is_empty() {
            self.kept[0] = self.kept[1].clone();
        }
    }

    /// Back to before the last `stood` samples, all of which then go into the filters.
    #[cold]
    fn begin_pause(
        &mut self,
        recursion: &mut dyn Recursion,
        channel: GuardChannel,
        stood: u64,
        sample: Sample,
    ) -> Guarded {
        let last = self.ring.len() - 1;
        let begin = last.checked_sub(stood.saturating_sub(1) as usize);
        // What was before the ring started, and did not move the estimate there, is left as it is.
        if let Some(begin) = begin {
            let newer = usize::from(begin >= self.since);
            self.kept[newer].restore(recursion);
            let first = if newer == 1 { self.since } else { 0 };
            for (at, taken) in self.ring.iter().enumerate().take(last).skip(first) {
                let act = match Act::ALL[taken.act.min(Act::ALL.len() - 1)] {
                    Act::Step if at >= begin => Act::Follow,
                    act => act,
                };
                act.on(recursion, taken.sample());
            }
        }
        let outcome = Act::Follow.on(recursion, sample);
        self.ring.clear();
        self.since = 0;
        self.paused = stood.max(1);
        self.moving = 0;
        self.channel = GuardChannel::ALL.iter().position(|c| *c == channel).unwrap_or(0);
        self.tell(GuardAction::Paused);
        Guarded { outcome, held: true }
    }

    #[cold]
    fn pause(&mut self, recursion: &mut dyn Recursion, sample: Sample, act: Act) -> Guarded {
        let act = if act == Act::Bridge { act } else { Act::Follow };
        let outcome = act.on(recursion, sample);
        self.paused += 1;
        self.moving = if self.stationary_soon() { 0 } else { self.moving + 1 };
        if self.moving >= self.settle {
            self.tell(GuardAction::Resumed);
            self.paused = 0;
        }
        Guarded { outcome, held: true }
    }

    /// True while a stand may still be that of the pause, or is half one of its own.
    fn stationary_soon(&self) -> bool {
        let [e, u] = self.channels.map(|channel| channel.stands);
        2 * e.min(u) >= self.both || 2 * e >= self.one || 2 * u >= self.one
    }

    fn tell(&mut self, action: GuardAction) {
        let channel = GuardChannel::ALL[self.channel];
        self.event = Some(GuardEvent {
            kind: match channel {
                GuardChannel::Both => GuardKind::Idle,
                _ => GuardKind::Frozen,
            },
            channel,
            ago: self.paused.saturating_sub(1),
            samples: self.paused,
            size: 0.0,
            action,
        });
    }

    /// Findings and actions at the last sample.
    pub fn event(&self) -> Option<GuardEvent> {
        self.event
    }

    /// True while the estimate stays constant.
    pub fn is_paused(&self) -> bool {
        self.paused > 0
    }
}
