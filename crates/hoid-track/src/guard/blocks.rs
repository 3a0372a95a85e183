//! Tests, learning and snapshots at the end of each block of one second.

use hoid_core::guard::{
    channel::ChannelGuard,
    profile::{Block, CHANNEL_COUNT, CONSTANT_FRACTION, Fault},
};

use super::{
    ConstantSpan, FOLLOWING_BLOCKS, Guard, MAX_LEVEL_RATIO, MIN_OUTLIER_SIZE, MIN_SNAPSHOT_AGE, SNAPSHOT_INTERVAL,
    event::GuardKind,
};
use crate::recursion::Recursion;

impl Guard {
    /// Tests the block that has ended; starts a pause if there is a fault, otherwise learns from the block.
    #[cold]
    pub(super) fn end_block(&mut self, recursion: &mut dyn Recursion) {
        self.channels.iter_mut().for_each(ChannelGuard::end_block);
        let block = self.block.means();
        let enough = block.samples >= self.block_length.div_ceil(2);
        self.block = Block::default();
        self.in_block = 0;
        if !enough {
            self.sound_blocks = 0;
            return;
        }
        let fault = self.profile.find_fault(&block, self.resting.is_rest());
        if let Some(reference) = &mut self.reference {
            if self.pause.kind > 0 {
                reference.start();
            } else if self.profile.is_unusual(&block) {
                reference.mark_unusual();
            } else if fault.is_none() && reference.end_block(&block, self.block_length) {
                self.start.restore(recursion);
                self.withdrawn = Some(self.samples);
                self.sound_at = [0; 2];
                self.start_pause(GuardKind::Diverged, 2, 0, 0.0);
                return;
            }
        }
        if self.pause.kind > 0 {
            self.judge_pause(recursion, fault, &block);
            return;
        }
        match self.unless_followed(fault, &block) {
            Some(fault) => {
                let (kind, channel) = kind_and_channel(fault);
                let blocks = self.profile.duration_blocks(fault) + self.following.saturating_sub(1);
                let seen = u64::from(blocks) * u64::from(self.block_length);
                self.restore_older_state(recursion, seen);
                let seen = match kind {
                    GuardKind::Frozen | GuardKind::Idle => seen.max(self.constant_samples(channel, ConstantSpan::len)),
                    _ => seen,
                };
                self.start_pause(kind, channel, seen.min(self.samples), 0.0);
            }
            // Blocks that the recursion still has to explain are neither learnt nor stored.
            None if self.following > 0 => self.sound_blocks = 0,
            None if self.in_ring == 0 => {
                self.profile.update(&block);
                self.start_quantile_estimation(&block);
                self.set_limits();
                self.sound_blocks = if self.profile.is_calm() {
                    self.sound_blocks + 1
                } else {
                    0
                };
                if self.sound_blocks >= SNAPSHOT_INTERVAL {
                    self.sound_blocks = 0;
                    let older = usize::from(self.sound_at[1] < self.sound_at[0]);
                    self.sound[older].take(recursion);
                    self.sound_at[older] = self.samples;
                }
            }
            None => {}
        }
    }

    /// Returns the fault, unless it is a misfit that the recursion may still follow. After a change in the person, the
    /// model predicts u badly until the recursion has followed the change, and then as well as before; a pause would
    /// keep the old estimate. A misfit therefore becomes a fault only when it has lasted for [`FOLLOWING_BLOCKS`] more
    /// blocks.
    fn unless_followed(&mut self, fault: Option<Fault>, block: &Block) -> Option<Fault> {
        let lasts = match fault {
            Some(Fault::Misfit) => true,
            Some(_) => false,
            None => self.following > 0 && !self.profile.has_typical_fit(block),
        };
        self.following = if lasts { self.following + 1 } else { 0 };
        match fault {
            Some(Fault::Misfit) | None => (self.following > FOLLOWING_BLOCKS).then_some(Fault::Misfit),
            other => other,
        }
    }

    /// Starts to learn the quantiles of the differences of both signals if their typical values are not known yet.
    fn start_quantile_estimation(&mut self, block: &Block) {
        if !self.profile.is_known() {
            for (channel, means) in self.channels.iter_mut().zip(block.differences) {
                channel.start_estimation(means);
            }
        }
    }

    fn judge_pause(&mut self, recursion: &mut dyn Recursion, fault: Option<Fault>, block: &Block) {
        self.pause.bad_block = fault.is_some();
        if fault.is_some() {
            self.pause.good = 0;
        }
        if fault.is_some() && self.former.resembles(block) {
            let former = self.former;
            self.restart_and_forget(recursion);
            self.profile = former;
            self.set_limits();
        } else if fault.is_some_and(Fault::may_be_new_level) {
            self.pause.suspect_samples += u64::from(self.block_length);
        }
    }

    /// Restores a state of the recursion that is older than the last `samples` samples.
    fn restore_older_state(&mut self, recursion: &mut dyn Recursion, samples: u64) {
        let least = samples.max(MIN_SNAPSHOT_AGE * u64::from(self.block_length));
        let sound = (0..2)
            .filter(|i| self.sound_at[*i] > 0 && self.samples - self.sound_at[*i] >= least)
            .max_by_key(|i| self.sound_at[*i]);
        let (state, at) = match sound {
            Some(i) => (&self.sound[i], self.sound_at[i]),
            None => (&self.start, 0),
        };
        state.restore(recursion);
        self.withdrawn = Some(self.samples - at);
    }

    /// Returns a number of samples of the constant span of a channel, or the smaller number if both channels are meant.
    pub(super) fn constant_samples(&self, channel: usize, of: impl Fn(&ConstantSpan) -> u64) -> u64 {
        let each = self.constant.get(channel).map(&of);
        each.unwrap_or_else(|| self.constant.iter().map(of).min().unwrap_or(0))
    }

    /// Sets the limits of both signals, which follow from their typical values.
    pub(super) fn set_limits(&mut self) {
        if !self.profile.is_known() {
            return;
        }
        let typical = *self.profile.typical_values();
        self.centre = typical.mean;
        for c in 0..CHANNEL_COUNT {
            let size = typical.magnitude[c];
            self.largest[c] = if size > 0.0 {
                MAX_LEVEL_RATIO * size
            } else {
                f64::INFINITY
            };
            self.channels[c].set_limit_floor(MIN_OUTLIER_SIZE[c] * size);
            let still = CONSTANT_FRACTION * typical.differences[c][0];
            self.channels[c].set_constant_tolerance(still);
            if !self.channels[c].is_known() {
                self.channels[c].start_estimation(typical.differences[c]);
                self.channels[c].start_detection();
            }
        }
        self.resting
            .set_tolerance(CONSTANT_FRACTION * typical.differences[1][0]);
    }
}

/// Returns the kind and the channel of a fault.
fn kind_and_channel(fault: Fault) -> (GuardKind, usize) {
    match fault {
        Fault::FrozenInput => (GuardKind::Frozen, 0),
        Fault::FrozenOutput => (GuardKind::Frozen, 1),
        Fault::Idle => (GuardKind::Idle, 2),
        Fault::Larger => (GuardKind::Level, 2),
        Fault::RescaledInput => (GuardKind::Level, 0),
        Fault::RescaledOutput => (GuardKind::Level, 1),
        Fault::Swapped => (GuardKind::Swapped, 2),
        Fault::Misfit => (GuardKind::Misfit, 2),
    }
}

#[cfg(test)]
mod tests {
    use hoid_core::state::State;
    use hoid_model::SampleTime;

    use super::super::{Guard, GuardKind};
    use crate::recursion::{Recursion, Sample, StepOutcome};

    /// A recursion whose innovations are set by the test. Its state is the number of samples that updated it.
    struct Predictor {
        innovation: f64,
        updates: u64,
    }

    impl State for Predictor {
        fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
            self.updates.visit(each);
        }
    }

    impl Recursion for Predictor {
        fn step(&mut self, sample: Sample) -> StepOutcome {
            self.updates += 1;
            self.step_without_update(sample)
        }

        fn step_without_update(&mut self, _: Sample) -> StepOutcome {
            StepOutcome {
                innovation: self.innovation,
                shortened: false,
            }
        }

        fn bridge(&mut self, _: Sample) {}

        fn theta(&self) -> &[f64] {
            &[]
        }

        fn covariance(&self, _: &mut [f64]) -> bool {
            false
        }

        fn innovation_variance(&self) -> f64 {
            1.0
        }
    }

    /// Returns the faults that start a pause, and the number of updates at the end, if the innovations are many times
    /// larger for a number of seconds in the middle of two minutes.
    fn pauses(seconds: f64) -> (Vec<GuardKind>, u64) {
        let mut recursion = Predictor {
            innovation: 0.0,
            updates: 0,
        };
        let mut guard = Guard::new(&mut recursion, 20, None, SampleTime::AT_100_HZ);
        let mut pauses = Vec::new();
        let mut was_paused = false;
        for k in 0..12_000_u32 {
            let t = 0.01 * f64::from(k);
            let wave = |shift: f64| (0.9 * t + shift).sin() + (2.3 * t + shift).sin() + 0.01 * (31.0 * t + shift).sin();
            recursion.innovation = if (60.0..60.0 + seconds).contains(&t) {
                1e-2
            } else {
                1e-7
            };
            let sample = Sample {
                e: wave(0.0),
                u: 0.3 * wave(1.0),
                reference: None,
            };
            guard.process(&mut recursion, sample, true);
            if guard.is_paused() && !was_paused {
                pauses.extend(guard.event().map(|event| event.kind));
            }
            was_paused = guard.is_paused();
        }
        (pauses, recursion.updates)
    }

    /// A misfit of a few seconds is not a fault, since a recursion needs this time to follow a change in the person.
    #[test]
    fn short_misfit_is_no_fault() {
        let (none, all) = pauses(0.0);
        assert_eq!((none.as_slice(), all), ([].as_slice(), 12_000));
        assert_eq!(pauses(6.0), (none, all));
    }

    #[test]
    fn lasting_misfit_restores_the_state_before_it() {
        let (found, updates) = pauses(30.0);
        assert_eq!(found, [GuardKind::Misfit]);
        // The updates during the misfit are withdrawn, with those since the last stored state.
        let most = 12_000 - 3_000;
        assert!((most - 1_000..most).contains(&updates), "{updates}");
    }
}
