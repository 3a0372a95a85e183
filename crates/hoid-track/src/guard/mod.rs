//! A guard in front of a recursion: treatment of samples and spans that no tracking produces. [`hoid_core::guard`]
//! detects them.
//!
//! | found | input of the recursion | estimate | afterwards |
//! |---|---|---|---|
//! | outlier of up to [`LONGEST_S`] | the prediction of e; the recursion's own prediction of u | stays | the recursion is put back to before it and takes the samples again, those that were held back interpolated |
//! | a jump that stays, a pulse of the hand | the same | stays | the recursion is put back to before it and takes the samples as they came: the result is that without a guard |
//! | no numbers for longer | the same | stays | continues once the filters have settled |
//! | 30 times the typical magnitude | the long-run mean of e, the prediction of u | stays | continues from there once the filters have settled |
//! | frozen, idle, larger or rescaled, swapped, misfit (by blocks of a second) | the samples, into the filters alone | is put back to before it | continues from there once the span is over and the filters have settled |
//! | an estimate that has gone diverged by [`hoid_core::guard::reference`] | the samples, into the filters alone | is put back to the start | continues from there once the filters have settled |
//!
//! **Steps and pulses.** `e = r - y`: a step of the target moves e by the same amount within one sample, and y
//! continues; so does u, since the person responds after the delay. A jump of e that stays, after which e moves as
//! before while u continues as predicted, is tracking and is not reported. A disturbed sensor recovers as fast as it
//! failed: an excursion that ends by a jump is an outlier. A fast hand leaves a dead zone at once but returns over
//! several samples: an excursion of u of [`PULSE_S`] or more within [`PULSE`] times its mean magnitude, whose last
//! step is within the normal moves of u, is a pulse and is taken as recorded.
//!
//! **Restoring.** The numbers of a recursion are few ([`hoid_core::state`]). They are stored when a sample is first
//! held back, every [`SOUND_EVERY`] blocks without a fault (the last two are kept; the one that is older than the time
//! in which the rules detect a fault is used), and at the start. The ring of samples that may have to be taken again is
//! [`LONGEST_S`] long. Memory is bounded, and nothing is allocated once the snapshots have their size.
//!
//! **Filters have settled** after the delay and [`SETTLE_S`]: the slowest poles of people's neuromuscular systems
//! (omega zeta of 2 to 4 rad/s) leave less than 2 % after that time.
//!
//! A misfit, exchanged channels or a larger level that last for [`GIVEN_UP_S`] are accepted as the new signals: the
//! recursion restarts from its start, and the typical levels are estimated again. If the signals then return to their
//! former levels, the former typical levels are used again. Silence has no time limit.
//!
//! | file | contents |
//! |---|---|
//! | `holding` | samples that are held back, and the treatment of them |
//! | `pausing` | pauses, from their start to their end |
//! | `blocks` | checks, learning and snapshots once a second |
//! | `prime` | the default, from the record of the start span |
//! | `compared` | the model of the start next to the signals |
//! | `snapshot` | the numbers of a recursion, kept and put back |
//! | `event`, `options` | events for reports; options |

mod blocks;
mod compared;
mod event;
mod holding;
mod options;
mod pausing;
mod prime;
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
mod snapshot;

use hoid_core::{
    guard::{
        channel::ChannelGuard,
        profile::{Block, CHANNELS, Profile},
        reference::ReferenceModel,
        resting::Resting,
    },
    state::{State, visit_all},
};
use hoid_model::{Record, SampleTime};

use crate::recursion::{Recursion, Sample, StepOutcome};

use compared::Reference;
pub use event::{GuardAction, GuardChannel, GuardEvent, GuardKind, TrackFault};
pub use options::{GuardChoice, GuardOptions};
pub(crate) use snapshot::Snapshot;

/// Longest run of held-back samples, s.
const LONGEST_S: f64 = 0.1;
/// Settling time beyond the delay, s.
pub(crate) const SETTLE_S: f64 = 2.0;
/// Length of a block, s.
const BLOCK_S: f64 = 1.0;
/// Sound blocks between two snapshots, and least age in blocks of the snapshot that is restored.
const SOUND_EVERY: u32 = 5;
const LEAST_AGE: u64 = 4;
/// Magnitude, in units of the typical mean magnitude, beyond which the level of a signal has changed.
const LARGEST: f64 = 30.0;
/// Lower limit of outliers in units of the mean magnitude: e passes a low-pass filter before it reaches an innovation,
/// u enters the innovation directly.
const FLOOR: [f64; CHANNELS] = [0.3, 1e-3];
/// Shortest pulse of the hand, s, and its largest size in units of the mean magnitude.
const PULSE_S: f64 = 0.03;
const PULSE: f64 = 6.0;
/// Time after which a misfit or swapped channels are accepted as the new typical level, s.
const GIVEN_UP_S: f64 = 120.0;

/// Decision of the guard on a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Guarded {
    /// Outcome of the recursion; without innovation if the sample did not reach it as recorded.
    pub outcome: Option<StepOutcome>,
    /// True if the sample was held back or the estimate is paused.
    pub held: bool,
}

/// A sample as recorded; NaN for a value that is not a number.
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
    /// One more than the index of its kind in [`GuardKind::ALL`]; 0 for none.
    kind: usize,
    channel: usize,
    first: u64,
    size: f64,
    /// True if a fault was found in the last block.
    bad_block: bool,
    /// Number of consecutive samples without a fault.
    good: u64,
    /// Number of samples of a larger level, of a misfit or of swapped channels.
    doubtful: u64,
}

hoid_core::state!([] Pause { kind, channel, first, size, bad_block, good, doubtful });

impl Pause {
    fn kind(&self) -> GuardKind {
        GuardKind::ALL[self.kind.max(1) - 1]
    }
}

/// The guard of a recursion.
#[derive(Debug, Clone)]
pub(crate) struct Guard {
    block_length: u32,
    longest: u32,
    shortest_pulse: u32,
    settle: u64,
    sample_time: SampleTime,
    samples: u64,
    channels: [ChannelGuard; CHANNELS],
    profile: Profile,
    resting: Resting,
    /// The typical values before they were learnt again.
    former: Profile,
    block: Block,
    in_block: u32,
    sound_blocks: u32,
    centre: [f64; CHANNELS],
    largest: [f64; CHANNELS],
    /// State before the held-back samples: recursion, channels, and those samples.
    before: Snapshot,
    channels_before: [ChannelGuard; CHANNELS],
    ring: Vec<Raw>,
    in_ring: usize,
    sound: [Snapshot; 2],
    /// Number of the sample at which each snapshot was taken; 0 for none.
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
                &mut self.resting,
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
        // The next held-back sample takes its place. A pause, a snapshot and a restart are not later than now.
        self.in_ring = self.in_ring.min(self.ring.len().saturating_sub(1));
        self.pause.first = self.pause.first.min(self.samples);
        self.sound_at = self.sound_at.map(|at| at.min(self.samples));
        self.restarted_at = self.restarted_at.min(self.samples);
        self.pause.kind = self.pause.kind.min(GuardKind::ALL.len());
        self.pause.channel = self.pause.channel.min(GuardChannel::ALL.len() - 1);
    }
}

impl Guard {
    /// Builds the guard of a recursion at its start, with a delay of nk samples. Typical values are learnt from the
    /// record of the start span or, without one, from the first seconds, in which only values that are not numbers are
    /// held back.
    pub fn new(recursion: &mut dyn Recursion, nk: usize, span: Option<&Record>, sample_time: SampleTime) -> Self {
        let ts = sample_time.s();
        let longest = (LONGEST_S / ts).round().max(1.0) as u32;
        let channel = ChannelGuard::new(ts);
        let mut start = Snapshot::default();
        start.take(recursion);
        let mut guard = Self {
            block_length: (BLOCK_S / ts).round().max(4.0) as u32,
            longest,
            shortest_pulse: (PULSE_S / ts).round().max(2.0) as u32,
            settle: nk as u64 + (SETTLE_S / ts).round() as u64,
            sample_time,
            samples: 0,
            channels: [channel; CHANNELS],
            profile: Profile::new(),
            resting: Resting::new(ts),
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

    /// Takes a sample, with NaN for values that are not numbers, and decides whether it reaches the recursion.
    #[inline]
    pub fn take(&mut self, recursion: &mut dyn Recursion, sample: Sample, moves: bool) -> Guarded {
        self.samples += 1;
        self.event = None;
        let x = [sample.e, sample.u];
        self.resting.take(x[1]);
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

    /// Compares with the model of the start from now on.
    pub fn compare_with(&mut self, model: ReferenceModel, nk: usize) {
        self.reference = Some(Reference::new(model, nk));
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

    /// Returns the event at the last sample.
    pub fn event(&self) -> Option<GuardEvent> {
        self.event
    }

    /// True while the estimate stays constant.
    pub fn is_paused(&self) -> bool {
        self.pause.kind > 0
    }

    /// Returns the number of restarts so far.
    pub fn restarts(&self) -> u64 {
        self.restarts
    }

    /// Returns the seconds since the last restart, if there was one.
    pub fn since_restart_s(&self) -> Option<f64> {
        (self.restarts > 0).then(|| (self.samples - self.restarted_at) as f64 * self.sample_time.s())
    }
}
