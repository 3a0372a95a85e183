//! Pauses: the estimate is kept constant, and the samples enter only the filters, if possible.

use hoid_core::guard::profile::{Block, CHANNEL_COUNT};

use super::{
    ACCEPTANCE_TIME_S, ConstantSpan, Guard, GuardDecision, Pause,
    event::{GuardAction, GuardKind},
};
use crate::recursion::{Recursion, Sample};

impl Guard {
    /// True if a sample is farther from the centre than `margin` times the largest level of its signal.
    pub(super) fn is_larger(&self, c: usize, x: f64, margin: f64) -> bool {
        (x - self.centre[c]).abs() > margin * self.largest[c]
    }

    /// Starts a pause.
    pub(super) fn start_pause(&mut self, kind: GuardKind, channel: usize, samples: u64, size: f64) {
        self.in_ring = 0;
        let place = GuardKind::ALL.iter().position(|k| *k == kind).unwrap_or(0);
        self.pause = Pause {
            kind: place + 1,
            channel,
            first: self.samples.saturating_sub(samples),
            size,
            bad_block: !matches!(kind, GuardKind::Missing | GuardKind::Level | GuardKind::Diverged),
            good: 0,
            suspect_samples: 0,
        };
        self.block = Block::default();
        (self.in_block, self.following) = (0, 0);
        self.report(kind, channel, samples, size, GuardAction::Paused, 0);
    }

    /// Handles a sample during a pause: it enters the filters of the recursion if possible.
    #[cold]
    pub(super) fn process_paused(&mut self, recursion: &mut dyn Recursion, sample: Sample) -> GuardDecision {
        self.resting.reject();
        let mut values = [sample.e, sample.u];
        let mut good = [true; CHANNEL_COUNT];
        let mut errors = [[0.0; 4]; CHANNEL_COUNT];
        for c in 0..CHANNEL_COUNT {
            let x = values[c];
            good[c] = x.is_finite() && !self.is_larger(c, x, 1.0);
            if x.abs() > self.pause.size && self.pause.kind() == GuardKind::Level {
                self.pause.size = x.abs();
            }
            if good[c] {
                errors[c] = self.channels[c].errors(x);
                self.channels[c].update_prediction(x, &errors[c]);
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
            let followed = recursion.step_without_update(taken);
            if good[0] {
                self.block.add(&errors, values, self.centre);
                self.block.add_innovation(followed.innovation);
                outcome = Some(followed);
            }
        } else {
            recursion.bridge(taken);
        }
        let larger = (0..CHANNEL_COUNT).any(|c| !good[c] && [sample.e, sample.u][c].is_finite());
        self.pause.suspect_samples += u64::from(larger);
        if self.pause.suspect_samples as f64 * self.sample_time.s() > ACCEPTANCE_TIME_S {
            self.restart_and_forget(recursion);
            return GuardDecision { outcome, held: true };
        }
        self.pause.good = if good == [true; CHANNEL_COUNT] {
            self.pause.good + 1
        } else {
            0
        };
        if self.pause.good >= self.settling_samples && !self.pause.bad_block {
            let action = match self.pause.kind() {
                GuardKind::Missing => GuardAction::Resumed,
                _ => GuardAction::Restarted,
            };
            self.end_pause(action);
        }
        GuardDecision { outcome, held: true }
    }

    /// Ends a pause.
    fn end_pause(&mut self, action: GuardAction) {
        let Pause {
            channel,
            first,
            size,
            good,
            ..
        } = self.pause;
        let kind = self.pause.kind();
        let mut end = self.samples - good;
        if matches!(kind, GuardKind::Frozen | GuardKind::Idle) {
            end = end.max(self.constant_samples(channel, ConstantSpan::end));
        }
        self.pause = Pause::default();
        self.block = Block::default();
        (self.in_block, self.sound_blocks) = (0, 0);
        if action != GuardAction::Resumed {
            self.restarts += 1;
            self.restarted_at = self.samples;
        }
        let end = end.max(first);
        self.report(kind, channel, end - first, size, action, self.samples - end);
    }

    /// Restarts the recursion from its start and forgets the typical values of the signals.
    pub(super) fn restart_and_forget(&mut self, recursion: &mut dyn Recursion) {
        self.start.restore(recursion);
        self.former = std::mem::take(&mut self.profile);
        self.sound_at = [0; 2];
        self.centre = [0.0; CHANNEL_COUNT];
        self.largest = [f64::INFINITY; CHANNEL_COUNT];
        for channel in &mut self.channels {
            channel.set_quantiles([0.0; 4]);
            channel.set_limit_floor(0.0);
        }
        self.end_pause(GuardAction::Relearnt);
    }
}
