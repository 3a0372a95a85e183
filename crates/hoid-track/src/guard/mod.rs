//! A guard in front of a recursion: what is done with samples and spans that no tracking makes.
//! What they are is told by [`hoid_core::guard`].
//!
//! | found | what reaches the recursion | estimate | afterwards |
//! |---|---|---|---|
//! | outlier of up to [`LONGEST_S`] | the prediction of e; the recursion's own prediction of u | stays | the recursion is put back to before it and takes the samples again, those that were held back interpolated |
//! | a jump that stays | the same | stays | the recursion is put back to before it and takes the samples as they came: the result is that without a guard |
//! | no numbers for longer | the same | stays | goes on once the filters have settled |
//! | 30 times the usual magnitude | the long-run mean of e, the prediction of u | stays | goes on from there once the filters have settled |
//! | frozen, idle, larger or rescaled, swapped, misfit (by blocks of a second) | the samples, into the filters alone | is put back to before it | goes on from there once the span is over and the filters have settled |
//! | an estimate that has gone astray by [`hoid_core::guard::reference`] | the samples, into the filters alone | is put back to the start | goes on from there once the filters have settled |
//!
//! **Putting back.** The numbers of a recursion are few ([`hoid_core::state`]). They are kept when a
//! sample is first held back, every [`SOUND_EVERY`] blocks in which all was well (the last two are
//! kept, of which the one is taken that is older than what the rules need to see a trouble), and at
//! the start. The ring of samples that may have to be taken again is [`LONGEST_S`] long. Memory is
//! bounded, nothing is allocated once the snapshots have their size.
//!
//! **Filters have settled** after the delay and [`SETTLE_S`]: the slowest poles of people's
//! neuromuscular systems (omega zeta of 2 to 4 rad/s) leave less than 2 % after that time.
//!
//! A misfit, swapped channels or a larger level that last for [`GIVEN_UP_S`] are taken for the new
//! usual: the recursion begins again from its start, and what is usual is learnt anew. When after
//! that the signals are as they were before, so is what is usual. Silence has no end.

mod compared;
mod event;
mod options;
mod prime;
mod snapshot;
#[cfg(test)]
mod tests;

use hoid_core::{
    guard::{
        channel::{ChannelGuard, QUANTILE_OVER_MEAN},
        profile::{Block, CHANNELS, Profile, Trouble},
        reference::ReferenceModel,
    },
    state::{State, visit_all},
};
use hoid_model::{Record, SampleTime};

use crate::recursion::{Recursion, Sample, StepOutcome};

use compared::Reference;
pub use event::{GuardAction, GuardChannel, GuardEvent, GuardKind, TrackFault};
pub use options::{GuardChoice, GuardOptions};
use snapshot::Snapshot;

/// Longest run of samples that is held back, s.
const LONGEST_S: f64 = 0.1;
/// Settling time beyond the delay, s.
const SETTLE_S: f64 = 2.0;
/// Length of a block, s.
const BLOCK_S: f64 = 1.0;
/// Sound blocks between two snapshots, and the least age in blocks of one that is gone back to.
const SOUND_EVERY: u32 = 5;
const LEAST_AGE: u64 = 4;
/// Magnitude in units of the usual mean magnitude beyond which a signal is not what it was.
const LARGEST: f64 = 30.0;
/// Least limit of outliers in units of the mean magnitude: e passes a low-pass filter before it
/// meets an innovation, u stands in the innovation itself.
const FLOOR: [f64; CHANNELS] = [0.3, 1e-3];
/// A misfit or swapped channels of so long are the new usual, s.
const GIVEN_UP_S: f64 = 120.0;

/// What the guard made of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Guarded {
    /// What the recursion said; no innovation where the sample did not reach it as it came.
    pub outcome: Option<StepOutcome>,
    /// True where the sample was held back or the estimate is paused.
    pub held: bool,
}

/// A sample as it came; NaN for what is no number.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Raw {
    values: [f64; CHANNELS],
    held: [bool; CHANNELS],
    moves: bool,
}

hoid_core::state!([] Raw { values, held, moves });

/// A pause.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Pause {
    /// One more than the place of its kind in [`GuardKind::ALL`]; 0 for none.
    kind: usize,
    channel: usize,
    first: u64,
    size: f64,
    /// True where the last block was not as it should be.
    bad_block: bool,
    /// Samples in a row that are as they should be.
    good: u64,
    /// Samples of a larger level, of a misfit or of swapped channels.
    doubtful: u64,
}

hoid_core::state!([] Pause { kind, channel, first, size, bad_block, good, doubtful });

/// The guard of a recursion.
#[derive(Debug, Clone)]
pub(crate) struct Guard {
    block_length: u32,
    longest: u32,
    settle: u64,
    sample_time: SampleTime,
    samples: u64,
    channels: [ChannelGuard; CHANNELS],
    profile: Profile,
    /// What was usual before it was learnt anew.
    former: Profile,
    block: Block,
    in_block: u32,
    sound_blocks: u32,
    centre: [f64; CHANNELS],
    largest: [f64; CHANNELS],
    /// Before the samples that are being held back: recursion, channels, and those samples.
    before: Snapshot,
    channels_before: [ChannelGuard; CHANNELS],
    ring: Vec<Raw>,
    in_ring: usize,
    sound: [Snapshot; 2],
    /// Number of the sample at which each was taken; 0 for none.
    sound_at: [u64; 2],
    start: Snapshot,
    reference: Option<Reference>,
    pause: Pause,
    restarts: u64,
    /// Number of the sample of the last restart.
    restarted_at: u64,
    event: Option<GuardEvent>,
}

impl State for Guard {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(
            &mut [
                &mut self.samples,
                &mut self.channels,
                &mut self.profile,
                &mut self.former,
                &mut self.block,
                &mut self.in_block,
                &mut self.sound_blocks,
                &mut self.centre,
                &mut self.largest,
                &mut self.before,
                &mut self.channels_before,
                &mut self.ring.as_mut_slice(),
                &mut self.in_ring,
                &mut self.sound,
                &mut self.sound_at,
                &mut self.start,
                &mut self.pause,
                &mut self.restarts,
                &mut self.restarted_at,
            ],
            each,
        );
        if let Some(reference) = &mut self.reference {
            reference.visit(each);
        }
        self.in_ring = self.in_ring.min(self.ring.len());
        self.pause.kind = self.pause.kind.min(GuardKind::ALL.len());
        self.pause.channel = self.pause.channel.min(GuardChannel::ALL.len() - 1);
    }
}

impl Guard {
    /// A guard of a recursion at its start, with a delay of nk samples. What is usual is learnt from
    /// the record of the start span, or where there is none from the first seconds, in which only
    /// what is no number is held back.
    pub fn new(recursion: &mut dyn Recursion, nk: usize, span: Option<&Record>, sample_time: SampleTime) -> Self {
        let ts = sample_time.s();
        let longest = (LONGEST_S / ts).round().max(1.0) as u32;
        let channel = ChannelGuard::new(ts);
        let mut start = Snapshot::default();
        start.take(recursion);
        let mut guard = Self {
            block_length: (BLOCK_S / ts).round().max(4.0) as u32,
            longest,
            settle: nk as u64 + (SETTLE_S / ts).round() as u64,
            sample_time,
            samples: 0,
            channels: [channel; CHANNELS],
            profile: Profile::new(),
            former: Profile::new(),
            block: Block::default(),
            in_block: 0,
            sound_blocks: 0,
            centre: [0.0; CHANNELS],
            largest: [f64::INFINITY; CHANNELS],
            before: Snapshot::default(),
            channels_before: [channel; CHANNELS],
            // Both signals may be held back one after the other.
            ring: vec![Raw::default(); 2 * longest as usize + 2],
            in_ring: 0,
            sound: [Snapshot::default(), Snapshot::default()],
            sound_at: [0; 2],
            start,
            reference: None,
            pause: Pause::default(),
            restarts: 0,
            restarted_at: 0,
            event: None,
        };
        if let Some(span) = span {
            guard.prime(span);
        }
        guard
    }

    /// Takes a sample, whose values are NaN where they are no numbers, to the recursion or not.
    #[inline]
    pub fn take(&mut self, recursion: &mut dyn Recursion, sample: Sample, moves: bool) -> Guarded {
        self.samples += 1;
        self.event = None;
        let x = [sample.e, sample.u];
        let errors = [self.channels[0].errors(x[0]), self.channels[1].errors(x[1])];
        let outliers = [
            self.channels[0].is_outlier(&errors[0]),
            self.channels[1].is_outlier(&errors[1]),
        ];
        let guarded = if self.pause.kind > 0 {
            self.paused(recursion, sample)
        } else if self.in_ring == 0 && !outliers[0] && !outliers[1] {
            self.channels[0].accept(x[0], &errors[0]);
            self.channels[1].accept(x[1], &errors[1]);
            self.block.add(&errors, x, self.centre);
            let outcome = if moves {
                recursion.step(sample)
            } else {
                recursion.follow(sample)
            };
            self.block.add_innovation(outcome.innovation);
            if let Some(reference) = &mut self.reference {
                reference.take(x);
            }
            Guarded {
                outcome: Some(outcome),
                held: false,
            }
        } else {
            self.hold(recursion, sample, moves, outliers)
        };
        self.in_block += 1;
        if self.in_block >= self.block_length {
            self.end_block(recursion);
        }
        guarded
    }

    /// A sample that is held back, or the one with which the signals are back.
    #[cold]
    fn hold(&mut self, recursion: &mut dyn Recursion, sample: Sample, moves: bool, outliers: [bool; 2]) -> Guarded {
        if self.in_ring == 0 {
            self.before.take(recursion);
            self.channels_before = self.channels;
        }
        let x = [sample.e, sample.u];
        let place = self.in_ring;
        self.in_ring += 1;
        let mut clean = x;
        let mut holds = [false; CHANNELS];
        for c in 0..CHANNELS {
            let channel = &mut self.channels[c];
            let held = channel.held();
            if held == 0 && !outliers[c] {
                let errors = channel.errors(x[c]);
                channel.accept(x[c], &errors);
            } else if held > 0 && channel.is_back(x[c]) {
                let size = channel.size();
                channel.resume(x[c]);
                self.tell(GuardKind::Outlier, c, u64::from(held), size, GuardAction::Held, 1);
            } else {
                clean[c] = channel.hold(x[c]);
                holds[c] = true;
            }
        }
        self.ring[place] = Raw {
            values: x,
            held: holds,
            moves,
        };
        if let Some(reference) = &mut self.reference {
            reference.take(clean);
        }
        let lasting = (0..CHANNELS).find(|c| self.channels[*c].held() > self.longest);
        if let Some(c) = lasting.or((self.in_ring == self.ring.len()).then_some(0)) {
            return self.lasting(recursion, c, sample);
        }
        if holds == [false; CHANNELS] {
            return self.take_again(recursion, sample);
        }
        let sample = Sample {
            e: clean[0],
            u: clean[1],
            ..sample
        };
        if holds[1] {
            recursion.bridge(sample);
        } else {
            recursion.follow(sample);
        }
        Guarded {
            outcome: None,
            held: true,
        }
    }

    /// Both signals are back: the recursion takes the samples since before they went, those that were
    /// held back on a parabola from the last good one and its slope to the next good one.
    fn take_again(&mut self, recursion: &mut dyn Recursion, sample: Sample) -> Guarded {
        for c in 0..CHANNELS {
            let mut last = self.channels_before[c].last();
            let mut slope = self.channels_before[c].slope();
            let mut k = 0;
            while k < self.in_ring {
                let run = self.ring[k..self.in_ring].iter().take_while(|raw| raw.held[c]).count();
                let Some(next) = self.ring[..self.in_ring].get(k + run).map(|raw| raw.values[c]) else {
                    break;
                };
                let span = (run + 1) as f64;
                let rest = (next - last - slope * span) / (span * span);
                for i in 0..run {
                    let s = (i + 1) as f64;
                    self.ring[k + i].values[c] = last + slope * s + rest * s * s;
                }
                let before = if run > 0 {
                    self.ring[k + run - 1].values[c]
                } else {
                    last
                };
                slope = if self.channels_before[c].has_slope() {
                    next - before
                } else {
                    0.0
                };
                last = next;
                k += run + 1;
            }
        }
        self.before.restore(recursion);
        let mut outcome = None;
        for raw in &self.ring[..self.in_ring] {
            let taken = Sample {
                e: raw.values[0],
                u: raw.values[1],
                ..sample
            };
            // e acts only after the delay: an innovation of now does not know it. A tenth of a second of
            // interpolated u moves an estimate by less than the clock of births of a bank of
            // hypotheses does that is stopped for as long.
            outcome = Some(if raw.moves {
                recursion.step(taken)
            } else {
                recursion.follow(taken)
            });
        }
        self.in_ring = 0;
        Guarded { outcome, held: false }
    }

    /// A signal that has been held back for too long to be an outlier.
    fn lasting(&mut self, recursion: &mut dyn Recursion, c: usize, sample: Sample) -> Guarded {
        let x = [sample.e, sample.u];
        let (held, size) = (u64::from(self.channels[c].held()), self.channels[c].size());
        if !x[c].is_finite() {
            self.begin_pause(GuardKind::Missing, c, held, 0.0);
            return self.paused(recursion, sample);
        }
        if self.is_too_large(c, x[c]) {
            self.begin_pause(GuardKind::Level, c, held, x[c].abs());
            return self.paused(recursion, sample);
        }
        self.before.restore(recursion);
        self.channels = self.channels_before;
        let mut last = self.channels_before.map(|channel| channel.last());
        let mut outcome = None;
        for k in 0..self.in_ring {
            let Raw { values, moves, .. } = self.ring[k];
            let mut sound = [true; CHANNELS];
            for i in 0..CHANNELS {
                sound[i] = values[i].is_finite() && !self.is_too_large(i, values[i]);
                if sound[i] {
                    last[i] = values[i];
                    let errors = self.channels[i].errors(values[i]);
                    self.channels[i].accept(values[i], &errors);
                }
            }
            let taken = Sample {
                e: last[0],
                u: last[1],
                ..sample
            };
            outcome = None;
            match sound {
                [true, true] if moves => outcome = Some(recursion.step(taken)),
                [_, true] => {
                    recursion.follow(taken);
                }
                [_, false] => recursion.bridge(taken),
            }
        }
        self.in_ring = 0;
        self.tell(GuardKind::Step, c, held, size, GuardAction::Accepted, 0);
        Guarded { outcome, held: false }
    }

    fn is_too_large(&self, c: usize, x: f64) -> bool {
        (x - self.centre[c]).abs() > self.largest[c]
    }

    /// The estimate stands still from here on.
    fn begin_pause(&mut self, kind: GuardKind, channel: usize, samples: u64, size: f64) {
        self.in_ring = 0;
        let place = GuardKind::ALL.iter().position(|k| *k == kind).unwrap_or(0);
        self.pause = Pause {
            kind: place + 1,
            channel,
            first: self.samples.saturating_sub(samples),
            size,
            bad_block: !matches!(kind, GuardKind::Missing | GuardKind::Level | GuardKind::Astray),
            good: 0,
            doubtful: 0,
        };
        self.block = Block::default();
        self.in_block = 0;
        self.tell(kind, channel, samples, size, GuardAction::Paused, 0);
    }

    /// A sample of a pause: into the filters, where it can be.
    #[cold]
    fn paused(&mut self, recursion: &mut dyn Recursion, sample: Sample) -> Guarded {
        let mut values = [sample.e, sample.u];
        let mut good = [true; CHANNELS];
        let mut errors = [[0.0; 4]; CHANNELS];
        for c in 0..CHANNELS {
            let x = values[c];
            good[c] = x.is_finite() && !self.is_too_large(c, x);
            if x.abs() > self.pause.size && self.pause.kind() == GuardKind::Level {
                self.pause.size = x.abs();
            }
            if good[c] {
                errors[c] = self.channels[c].errors(x);
                self.channels[c].follow(x, &errors[c]);
            } else {
                values[c] = self.centre[c];
                self.channels[c].restart(std::iter::once(values[c]));
            }
        }
        let taken = Sample {
            e: values[0],
            u: values[1],
            ..sample
        };
        let mut outcome = None;
        if good[1] {
            let followed = recursion.follow(taken);
            if good[0] {
                self.block.add(&errors, values, self.centre);
                self.block.add_innovation(followed.innovation);
                outcome = Some(followed);
            }
        } else {
            recursion.bridge(taken);
        }
        let larger = (0..CHANNELS).any(|c| !good[c] && [sample.e, sample.u][c].is_finite());
        self.pause.doubtful += u64::from(larger);
        if self.pause.doubtful as f64 * self.sample_time.s() > GIVEN_UP_S {
            self.learn_anew(recursion);
            return Guarded { outcome, held: true };
        }
        self.pause.good = if good == [true; CHANNELS] {
            self.pause.good + 1
        } else {
            0
        };
        if self.pause.good >= self.settle && !self.pause.bad_block {
            let action = match self.pause.kind() {
                GuardKind::Missing => GuardAction::Resumed,
                _ => GuardAction::Restarted,
            };
            self.end_pause(action);
        }
        Guarded { outcome, held: true }
    }

    /// The estimate moves again.
    fn end_pause(&mut self, action: GuardAction) {
        let Pause {
            channel, first, size, ..
        } = self.pause;
        let kind = self.pause.kind();
        self.pause = Pause::default();
        self.block = Block::default();
        (self.in_block, self.sound_blocks) = (0, 0);
        if action != GuardAction::Resumed {
            self.restarts += 1;
            self.restarted_at = self.samples;
        }
        self.tell(kind, channel, self.samples - first, size, action, 0);
    }

    /// A second is over.
    #[cold]
    fn end_block(&mut self, recursion: &mut dyn Recursion) {
        self.channels.iter_mut().for_each(ChannelGuard::choose);
        let block = self.block.means();
        let enough = 2 * block.samples >= self.block_length;
        self.block = Block::default();
        self.in_block = 0;
        if !enough {
            self.sound_blocks = 0;
            return;
        }
        let trouble = self.profile.judge(&block);
        if let Some(reference) = &mut self.reference {
            if self.pause.kind > 0 {
                reference.begin();
            } else if self.profile.is_unusual(&block) {
                reference.suspect();
            } else if trouble.is_none() && reference.end_block(&block, self.block_length) {
                self.start.restore(recursion);
                self.sound_at = [0; 2];
                self.begin_pause(GuardKind::Astray, 2, 0, 0.0);
                return;
            }
        }
        if self.pause.kind > 0 {
            self.judge_pause(recursion, trouble, &block);
            return;
        }
        match trouble {
            Some(trouble) => {
                let (kind, channel) = named(trouble);
                let seen = u64::from(trouble.blocks()) * u64::from(self.block_length);
                self.go_back(recursion, seen);
                self.begin_pause(kind, channel, seen.min(self.samples), 0.0);
            }
            None if self.in_ring == 0 => {
                self.profile.learn(&block);
                self.set_limits();
                self.sound_blocks = if self.profile.is_calm() {
                    self.sound_blocks + 1
                } else {
                    0
                };
                if self.sound_blocks >= SOUND_EVERY {
                    self.sound_blocks = 0;
                    let older = usize::from(self.sound_at[1] < self.sound_at[0]);
                    self.sound[older].take(recursion);
                    self.sound_at[older] = self.samples;
                }
            }
            None => {}
        }
    }

    fn judge_pause(&mut self, recursion: &mut dyn Recursion, trouble: Option<Trouble>, block: &Block) {
        self.pause.bad_block = trouble.is_some();
        if trouble.is_some() {
            self.pause.good = 0;
        }
        if trouble.is_some() && self.former.resembles(block) {
            let former = self.former;
            self.learn_anew(recursion);
            self.profile = former;
            self.set_limits();
        } else if trouble.is_some_and(Trouble::may_be_the_new_usual) {
            self.pause.doubtful += u64::from(self.block_length);
        }
    }

    /// The recursion begins again from its start, and nothing is known of the signals.
    fn learn_anew(&mut self, recursion: &mut dyn Recursion) {
        self.start.restore(recursion);
        self.former = std::mem::take(&mut self.profile);
        self.sound_at = [0; 2];
        self.centre = [0.0; CHANNELS];
        self.largest = [f64::INFINITY; CHANNELS];
        for channel in &mut self.channels {
            channel.set_quantiles([0.0; 4]);
            channel.set_floor(0.0);
        }
        self.end_pause(GuardAction::Relearnt);
    }

    /// Compares with the model of the start from now on.
    pub fn compare_with(&mut self, model: ReferenceModel, nk: usize) {
        self.reference = Some(Reference::new(model, nk));
    }

    /// Puts the recursion back to before the last samples of which there were so many.
    fn go_back(&self, recursion: &mut dyn Recursion, samples: u64) {
        let least = samples.max(LEAST_AGE * u64::from(self.block_length));
        let sound = (0..2)
            .filter(|i| self.sound_at[*i] > 0 && self.samples - self.sound_at[*i] >= least)
            .max_by_key(|i| self.sound_at[*i]);
        match sound {
            Some(i) => self.sound[i].restore(recursion),
            None => self.start.restore(recursion),
        };
    }

    /// Limits that follow from the long-run values.
    fn set_limits(&mut self) {
        if !self.profile.is_known() {
            return;
        }
        let usual = *self.profile.usual();
        self.centre = usual.mean;
        for c in 0..CHANNELS {
            let size = usual.magnitude[c];
            self.largest[c] = if size > 0.0 { LARGEST * size } else { f64::INFINITY };
            self.channels[c].set_floor(FLOOR[c] * size);
            if !self.channels[c].is_known() {
                let mean = usual.differences[c];
                self.channels[c].set_quantiles(mean.map(|m| QUANTILE_OVER_MEAN * m));
            }
        }
    }

    fn tell(&mut self, kind: GuardKind, channel: usize, samples: u64, size: f64, action: GuardAction, after: u64) {
        self.event = Some(GuardEvent {
            kind,
            channel: GuardChannel::ALL[channel],
            ago: (samples + after).saturating_sub(1),
            samples,
            size,
            action,
        });
    }

    /// What was found or done at the last sample.
    pub fn event(&self) -> Option<GuardEvent> {
        self.event
    }

    /// True while the estimate stands still.
    pub fn is_paused(&self) -> bool {
        self.pause.kind > 0
    }

    /// Restarts so far.
    pub fn restarts(&self) -> u64 {
        self.restarts
    }

    /// Seconds since the last restart, where there was one.
    pub fn since_restart_s(&self) -> Option<f64> {
        (self.restarts > 0).then(|| (self.samples - self.restarted_at) as f64 * self.sample_time.s())
    }
}

impl Pause {
    fn kind(&self) -> GuardKind {
        GuardKind::ALL[self.kind.max(1) - 1]
    }
}

/// The kind and the channel of a trouble.
fn named(trouble: Trouble) -> (GuardKind, usize) {
    match trouble {
        Trouble::FrozenInput => (GuardKind::Frozen, 0),
        Trouble::FrozenOutput => (GuardKind::Frozen, 1),
        Trouble::Idle => (GuardKind::Idle, 2),
        Trouble::Larger => (GuardKind::Level, 2),
        Trouble::RescaledInput => (GuardKind::Level, 0),
        Trouble::RescaledOutput => (GuardKind::Level, 1),
        Trouble::Swapped => (GuardKind::Swapped, 2),
        Trouble::Misfit => (GuardKind::Misfit, 2),
    }
}
