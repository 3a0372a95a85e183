//! Tests, learning and snapshots at the end of each block of one second.

use hoid_core::guard::{
    channel::ChannelGuard,
    profile::{Block, CHANNEL_COUNT, CONSTANT_FRACTION, Fault},
};

use super::{
    ConstantSpan, Guard, MAX_LEVEL_RATIO, MIN_OUTLIER_SIZE, MIN_SNAPSHOT_AGE, SNAPSHOT_INTERVAL, event::GuardKind,
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
        match fault {
            Some(fault) => {
                let (kind, channel) = kind_and_channel(fault);
                let blocks = self.profile.duration_blocks(fault);
                let seen = u64::from(blocks) * u64::from(self.block_length);
                self.restore_older_state(recursion, seen);
                let seen = match kind {
                    GuardKind::Frozen | GuardKind::Idle => seen.max(self.constant_samples(channel, ConstantSpan::len)),
                    _ => seen,
                };
                self.start_pause(kind, channel, seen.min(self.samples), 0.0);
            }
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

    /// Returns a number of samples of the constant span of a channel; of both channels, the smaller one.
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
