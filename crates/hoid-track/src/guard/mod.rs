//! A guard in front of a recursion: treatment of samples and spans that cannot come from tracking. [`hoid_core::guard`]
//! detects them.
//!
//! | observation | input of the recursion | estimate | afterwards |
//! |---|---|---|---|
//! | outlier of up to [`MAX_HELD_BACK_S`] | predictions: of e by the guard, of u by the recursion | constant | the recursion is restored to its state before the outlier and takes the samples again; those that were held back are interpolated |
//! | lasting jump, or pulse of the hand | the same predictions | constant | the recursion is restored to its state before the jump and takes the samples as recorded: the result is the same as without a guard |
//! | samples that are not numbers, for longer than an outlier | the same predictions | constant | the estimate is updated again once the filters have settled |
//! | 30 times the typical magnitude | the long-run mean of e, the prediction of u | constant | the estimate is updated again once the filters have settled |
//! | frozen, idle, larger or rescaled, swapped, misfit (tested in blocks of a second) | the samples, for the filters only | restored to a state before the fault | the estimate is updated again once the span is over and the filters have settled |
//! | an estimate that has diverged according to [`hoid_core::guard::reference`] | the samples, for the filters only | restored to the start | the estimate is updated again once the filters have settled |
//!
//! **Steps and pulses.** `e = r - y`: a step in the target moves e by the same amount within one sample, while y and u
//! continue smoothly, since the person responds only after the delay. A lasting jump of e, after which e moves as
//! before while u continues as predicted, is therefore tracking and is not reported, up to [`STEP_TO_LEVEL_RATIO`]
//! times the largest level. The same limit applies to both signals while the person responds to the step. A disturbed
//! sensor recovers as fast as it failed: an excursion that ends with a jump is an outlier; one of e that ends without
//! a jump is a small step in the target. A fast hand leaves a dead zone at once but returns over several samples: an
//! excursion of u of [`MIN_PULSE_S`] or more within [`MAX_PULSE_SIZE`] times its mean magnitude, whose last step is
//! within the normal moves of u, is a pulse and is used as recorded.
//!
//! **Restoring.** The state of a recursion consists of few numbers ([`hoid_core::state`]). It is stored at the start,
//! when a sample is first held back, and every [`SNAPSHOT_INTERVAL`] blocks without a fault. Of the snapshots after
//! such blocks, the last two are kept, and the newest one that is older than the time in which the rules detect a fault
//! is restored. The ring of samples that may have to be taken again is twice [`MAX_HELD_BACK_S`] long, because both
//! signals may be held back one after the other. Memory is bounded, and nothing is allocated once the snapshots have
//! reached their size.
//!
//! **Misfits.** After a sudden change in the person with little remnant, the old estimate predicts u worse than the
//! past of u does. A recursion follows such a change within seconds, whereas a pause would keep the old estimate. A
//! misfit is therefore a fault only if the recursion has not followed it within [`FOLLOWING_BLOCKS`] more blocks, so
//! that R is at most twice its long-run value again ([`hoid_core::guard::profile`]). The state before the misfit is
//! then restored.
//!
//! **Filters have settled** when the delay and [`SETTLING_S`] have passed: after that time the slowest poles of
//! people's neuromuscular systems (omega zeta of 2 to 4 rad/s) leave less than 2 %.
//!
//! A misfit, exchanged channels or a larger level that last for [`ACCEPTANCE_TIME_S`] are accepted as normal: the
//! recursion restarts from its start, and the typical levels are estimated again. If the signals then return to their
//! former levels, the former typical levels are used again. Silence has no time limit.
//!
//! | file | contents |
//! |---|---|
//! | `holding` | samples that are held back, and their later treatment |
//! | `pausing` | pauses, from their start to their end |
//! | `blocks` | checks, learning and snapshots once a second |
//! | `prime` | typical values from the record of the start span |
//! | `constant` | start and end of spans in which a signal stays constant |
//! | `compared` | comparison of the estimate with the start model |
//! | `snapshot` | stored states of a recursion |
//! | `event`, `options` | events for reports; the option of the guard |

mod blocks;
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
mod compared;
mod constant;
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
        profile::{Block, CHANNEL_COUNT, Profile},
        reference::ReferenceModel,
        resting::RestDetector,
    },
    state::{State, visit_all},
};
use hoid_model::{Record, SampleTime};

use crate::recursion::{Recursion, Sample, StepOutcome};

use compared::ReferenceComparison;
use constant::ConstantSpan;
pub use event::{GuardAction, GuardChannel, GuardEvent, GuardKind, TrackFault};
pub use options::{GuardChoice, GuardOptions};
pub(crate) use snapshot::Snapshot;

/// Longest run of held-back samples, s.
const MAX_HELD_BACK_S: f64 = 0.1;
/// Time beyond the delay in which the filters settle, s.
pub(crate) const SETTLING_S: f64 = 2.0;
/// Length of a block, s.
const BLOCK_S: f64 = 1.0;
/// Number of blocks without a fault between two snapshots, and smallest age, in blocks, of a snapshot that is restored.
const SNAPSHOT_INTERVAL: u32 = 5;
const MIN_SNAPSHOT_AGE: u64 = 4;
/// Number of blocks in which the recursion may follow a change in the person before a misfit is a fault.
const FOLLOWING_BLOCKS: u32 = 6;
/// Multiple of the typical mean magnitude beyond which the level of a signal has changed.
const MAX_LEVEL_RATIO: f64 = 30.0;
/// Ratio of the largest step in a target to the largest level of a signal.
const STEP_TO_LEVEL_RATIO: f64 = 10.0;
/// Smallest size of an outlier as a multiple of the mean magnitude: e passes a low-pass filter before it reaches an
/// innovation, while u enters the innovation directly.
const MIN_OUTLIER_SIZE: [f64; CHANNEL_COUNT] = [0.3, 1e-3];
/// Shortest pulse of the hand (in s), and its largest size as a multiple of the mean magnitude.
const MIN_PULSE_S: f64 = 0.03;
const MAX_PULSE_SIZE: f64 = 6.0;
/// Time after which a misfit or swapped channels are accepted as normal, s.
const ACCEPTANCE_TIME_S: f64 = 120.0;

/// Decision of the guard on a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GuardDecision {
    /// Outcome of the recursion; `None` if the recursion did not take the sample as recorded.
    pub outcome: Option<StepOutcome>,
    /// True if the sample was held back or the estimate is paused.
    pub held: bool,
}

/// A sample as recorded; a missing or unreadable value is NaN.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct RawSample {
    values: [f64; CHANNEL_COUNT],
    /// External signal; NaN if it is not known.
    reference: f64,
    held: [bool; CHANNEL_COUNT],
    moves: bool,
}

hoid_core::state!([] RawSample { values, reference, held, moves });

impl RawSample {
    /// Returns the sample with other values of e and u.
    fn with_values(&self, [e, u]: [f64; CHANNEL_COUNT]) -> Sample {
        Sample {
            e,
            u,
            reference: Some(self.reference).filter(|reference| reference.is_finite()),
        }
    }
}

/// A pause, in which the estimate is kept constant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Pause {
    /// Index of the kind in [`GuardKind::ALL`], plus one; 0 without a pause.
    kind: usize,
    channel: usize,
    first: u64,
    size: f64,
    /// True if a fault was found in the last block.
    bad_block: bool,
    /// Number of consecutive samples without a fault.
    good: u64,
    /// Number of samples so far with a larger level, a misfit or swapped channels.
    suspect_samples: u64,
}

hoid_core::state!([] Pause { kind, channel, first, size, bad_block, good, suspect_samples });

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
    settling_samples: u64,
    sample_time: SampleTime,
    samples: u64,
    channels: [ChannelGuard; CHANNEL_COUNT],
    profile: Profile,
    resting: RestDetector,
    /// Typical values before they were last learnt again.
    former: Profile,
    block: Block,
    in_block: u32,
    sound_blocks: u32,
    /// Number of blocks in which the recursion has been following a misfit.
    following: u32,
    centre: [f64; CHANNEL_COUNT],
    largest: [f64; CHANNEL_COUNT],
    /// States of the recursion and of the channels before the held-back samples, and these samples.
    before: Snapshot,
    channels_before: [ChannelGuard; CHANNEL_COUNT],
    ring: Vec<RawSample>,
    in_ring: usize,
    sound: [Snapshot; 2],
    /// Sample number at which each snapshot was taken; 0 if there is no snapshot.
    sound_at: [u64; 2],
    start: Snapshot,
    reference: Option<ReferenceComparison>,
    pause: Pause,
    restarts: u64,
    /// Sample number of the last restart.
    restarted_at: u64,
    /// Sample number until which the person responds to the last step of the target.
    response_until: u64,
    event: Option<GuardEvent>,
    /// Number of samples since the state that was restored at the last sample.
    withdrawn: Option<u64>,
    /// Spans in which a signal stays constant.
    constant: [ConstantSpan; CHANNEL_COUNT],
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
                &mut self.following,
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
                &mut self.response_until,
                &mut self.constant,
            ],
            each,
        );
        if let Some(reference) = &mut self.reference {
            reference.visit(each);
        }
        // The ring must have room for the next held-back sample. The start of a pause, a snapshot and a restart cannot
        // be in the future.
        self.in_ring = self.in_ring.min(self.ring.len().saturating_sub(1));
        self.pause.first = self.pause.first.min(self.samples);
        self.pause.good = self.pause.good.min(self.samples);
        self.sound_at = self.sound_at.map(|at| at.min(self.samples));
        self.restarted_at = self.restarted_at.min(self.samples);
        self.response_until = (self.response_until).min(self.samples.saturating_add(self.settling_samples));
        self.pause.kind = self.pause.kind.min(GuardKind::ALL.len());
        self.pause.channel = self.pause.channel.min(GuardChannel::ALL.len() - 1);
    }
}

impl Guard {
    /// Builds the guard of a recursion at its start, with a delay of nk samples. Typical values are learnt from the
    /// record of the start span or, without one, from the first few seconds, in which only values that are not finite
    /// numbers are held back.
    pub fn new(recursion: &mut dyn Recursion, nk: usize, span: Option<&Record>, sample_time: SampleTime) -> Self {
        let ts = sample_time.s();
        let longest = (MAX_HELD_BACK_S / ts).round().max(1.0) as u32;
        let channel = ChannelGuard::new(ts);
        let mut start = Snapshot::default();
        start.take(recursion);
        let mut guard = Self {
            block_length: (BLOCK_S / ts).round().max(4.0) as u32,
            longest,
            shortest_pulse: (MIN_PULSE_S / ts).round().max(2.0) as u32,
            settling_samples: nk as u64 + (SETTLING_S / ts).round() as u64,
            sample_time,
            samples: 0,
            channels: [channel; CHANNEL_COUNT],
            profile: Profile::new(),
            resting: RestDetector::new(ts),
            former: Profile::new(),
            block: Block::default(),
            in_block: 0,
            sound_blocks: 0,
            following: 0,
            centre: [0.0; CHANNEL_COUNT],
            largest: [f64::INFINITY; CHANNEL_COUNT],
            before: Snapshot::default(),
            channels_before: [channel; CHANNEL_COUNT],
            // Both signals may be held back, one after the other.
            ring: vec![RawSample::default(); 2 * longest as usize + 2],
            in_ring: 0,
            sound: [Snapshot::default(), Snapshot::default()],
            sound_at: [0; 2],
            start,
            reference: None,
            pause: Pause::default(),
            restarts: 0,
            restarted_at: 0,
            response_until: 0,
            event: None,
            withdrawn: None,
            constant: [ConstantSpan::default(); CHANNEL_COUNT],
        };
        if let Some(span) = span {
            guard.prime(span);
        }
        guard
    }

    /// Takes a sample, in which NaN marks a missing value, and decides whether it reaches the recursion.
    #[inline]
    pub fn process(&mut self, recursion: &mut dyn Recursion, sample: Sample, moves: bool) -> GuardDecision {
        self.samples += 1;
        (self.event, self.withdrawn) = (None, None);
        let x = [sample.e, sample.u];
        self.resting.update(x[1]);
        for ((span, channel), x) in self.constant.iter_mut().zip(&self.channels).zip(x) {
            span.update(
                x,
                channel.constant_tolerance(),
                self.samples,
                u64::from(self.block_length),
            );
        }
        let errors = [self.channels[0].errors(x[0]), self.channels[1].errors(x[1])];
        let outliers = [
            self.channels[0].is_outlier(&errors[0]),
            self.channels[1].is_outlier(&errors[1]),
        ];
        let guarded = if self.pause.kind > 0 {
            self.process_paused(recursion, sample)
        } else if self.in_ring == 0 && !outliers[0] && !outliers[1] {
            self.channels[0].accept(x[0], &errors[0]);
            self.channels[1].accept(x[1], &errors[1]);
            self.block.add(&errors, x, self.centre);
            let outcome = if moves {
                recursion.step(sample)
            } else {
                recursion.step_without_update(sample)
            };
            self.block.add_innovation(outcome.innovation);
            if let Some(reference) = &mut self.reference {
                reference.update(x);
            }
            GuardDecision {
                outcome: Some(outcome),
                held: false,
            }
        } else {
            self.hold_back(recursion, sample, moves, outliers)
        };
        self.in_block += 1;
        if self.in_block >= self.block_length {
            self.end_block(recursion);
        }
        guarded
    }

    /// Compares the estimate with a start model, with the delay nk, from now on.
    pub fn compare_with(&mut self, model: ReferenceModel, nk: usize) {
        self.reference = Some(ReferenceComparison::new(model, nk));
    }

    fn report(&mut self, kind: GuardKind, channel: usize, samples: u64, size: f64, action: GuardAction, after: u64) {
        self.event = Some(GuardEvent {
            kind,
            channel: GuardChannel::ALL[channel],
            ago: (samples + after).saturating_sub(1),
            samples,
            size,
            action,
            withdrawn: self.withdrawn,
        });
    }

    /// Returns the event that was reported at the last sample.
    pub fn event(&self) -> Option<GuardEvent> {
        self.event
    }

    /// True while the estimate stays constant.
    pub fn is_paused(&self) -> bool {
        self.pause.kind > 0
    }

    /// Returns the number of restarts by the guard so far.
    pub fn restart_count(&self) -> u64 {
        self.restarts
    }

    /// Returns the time since the last restart in s; `None` without a restart.
    pub fn time_since_restart_s(&self) -> Option<f64> {
        (self.restarts > 0).then(|| (self.samples - self.restarted_at) as f64 * self.sample_time.s())
    }
}
