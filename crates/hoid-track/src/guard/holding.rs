//! Held-back samples and their later treatment: interpolation, or use as recorded.

use hoid_core::guard::profile::CHANNEL_COUNT;

use super::{
    Guard, GuardDecision, MAX_PULSE_SIZE, RawSample, STEP_TO_LEVEL_RATIO,
    event::{GuardAction, GuardKind},
};
use crate::recursion::{Recursion, Sample};

impl Guard {
    /// Handles a sample that is held back, or the sample with which the signals return.
    #[cold]
    pub(super) fn hold_back(
        &mut self,
        recursion: &mut dyn Recursion,
        sample: Sample,
        moves: bool,
        outliers: [bool; 2],
    ) -> GuardDecision {
        if self.in_ring == 0 {
            self.before.take(recursion);
            self.channels_before = self.channels;
        }
        let x = [sample.e, sample.u];
        let place = self.in_ring;
        self.in_ring += 1;
        let mut clean = x;
        let mut holds = [false; CHANNEL_COUNT];
        for c in 0..CHANNEL_COUNT {
            let channel = &mut self.channels[c];
            let held = channel.held_count();
            if held == 0 && !outliers[c] {
                let errors = channel.errors(x[c]);
                channel.accept(x[c], &errors);
            } else if held > 0 && channel.has_returned(x[c]) {
                let (size, largest_move) = (channel.largest_held_error(), channel.jump_threshold());
                channel.resume(x[c]);
                if self.is_tracking(c, place, held, size, x[c], largest_move) {
                    let first = place.saturating_sub(held as usize);
                    self.ring[first..place].iter_mut().for_each(|raw| raw.held[c] = false);
                    continue;
                }
                self.report(GuardKind::Outlier, c, u64::from(held), size, GuardAction::Held, 1);
            } else {
                clean[c] = channel.hold_back(x[c]);
                holds[c] = true;
            }
        }
        self.ring[place] = RawSample {
            values: x,
            reference: sample.reference.unwrap_or(f64::NAN),
            held: holds,
            moves,
        };
        if let Some(reference) = &mut self.reference {
            reference.update(clean);
        }
        let lasting = (0..CHANNEL_COUNT).find(|c| self.channels[*c].held_count() > self.longest);
        if let Some(c) = lasting.or((self.in_ring == self.ring.len()).then_some(0)) {
            return self.handle_lasting(recursion, c, sample);
        }
        if holds == [false; CHANNEL_COUNT] {
            return self.reprocess(recursion);
        }
        let sample = Sample {
            e: clean[0],
            u: clean[1],
            ..sample
        };
        if holds[1] {
            recursion.bridge(sample);
        } else {
            recursion.step_without_update(sample);
        }
        GuardDecision {
            outcome: None,
            held: true,
        }
    }

    /// True if tracking can explain an excursion of a signal that ends with sample x at index `place` of the ring: it
    /// starts with a jump and does not end with one. In e this is a step in the target, in u a movement of the hand,
    /// which returns over several samples.
    fn is_tracking(&self, c: usize, place: usize, held: u32, size: f64, x: f64, largest_move: f64) -> bool {
        let Some(last) = place.checked_sub(1).map(|k| self.ring[k].values[c]) else {
            return false;
        };
        let ends_smoothly = (x - last).abs() <= largest_move && (x - last).abs() <= 0.5 * size;
        let is_pulse =
            held >= self.shortest_pulse && size <= MAX_PULSE_SIZE * self.profile.typical_values().magnitude[1];
        ends_smoothly && (c == 0 || is_pulse)
    }

    /// Handles the return of both signals. The recursion takes the samples again from the start of the excursion.
    /// Held-back samples are replaced by values on a parabola through the last good sample, with its slope, and the
    /// next good sample.
    fn reprocess(&mut self, recursion: &mut dyn Recursion) -> GuardDecision {
        for c in 0..CHANNEL_COUNT {
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
            let taken = raw.with_values(raw.values);
            // e acts on u only after the delay, so the current innovation does not contain the interpolated e. A tenth
            // of a second of interpolated u disturbs the estimate less than a bank that created no hypotheses for that
            // time would.
            outcome = Some(if raw.moves {
                recursion.step(taken)
            } else {
                recursion.step_without_update(taken)
            });
        }
        self.in_ring = 0;
        GuardDecision { outcome, held: false }
    }

    /// Handles a signal that has been held back for too long to be an outlier.
    fn handle_lasting(&mut self, recursion: &mut dyn Recursion, c: usize, sample: Sample) -> GuardDecision {
        let x = [sample.e, sample.u];
        let (held, size) = (
            u64::from(self.channels[c].held_count()),
            self.channels[c].largest_held_error(),
        );
        if !x[c].is_finite() {
            self.start_pause(GuardKind::Missing, c, held, 0.0);
            return self.process_paused(recursion, sample);
        }
        // A step in the target moves e at once, after which e varies as before; the person responds only after the
        // delay.
        let ring = &self.ring[..self.in_ring];
        // The number of held-back samples exceeds that in the ring only if the saved numbers were altered.
        let first = self.in_ring.saturating_sub(held as usize);
        let is_target = c == 0
            && !ring.iter().any(|raw| raw.held[1])
            && self.channels_before[0].moves_typically(ring[first..].iter().map(|raw| raw.values[0]));
        // Between rare steps of the target, both signals are small, so a step and the response to it may exceed the
        // largest level of continuous tracking.
        let margin = if is_target || self.samples < self.response_until {
            STEP_TO_LEVEL_RATIO
        } else {
            1.0
        };
        if self.is_larger(c, x[c], margin) {
            self.start_pause(GuardKind::Level, c, held, x[c].abs());
            return self.process_paused(recursion, sample);
        }
        self.before.restore(recursion);
        self.channels = self.channels_before;
        let mut last = self.channels_before.map(|channel| channel.last());
        let mut outcome = None;
        for k in 0..self.in_ring {
            let raw = self.ring[k];
            let RawSample { values, moves, .. } = raw;
            let mut sound = [true; CHANNEL_COUNT];
            for i in 0..CHANNEL_COUNT {
                sound[i] = values[i].is_finite() && !self.is_larger(i, values[i], margin);
                if sound[i] {
                    last[i] = values[i];
                    let errors = self.channels[i].errors(values[i]);
                    self.channels[i].accept(values[i], &errors);
                }
            }
            let taken = raw.with_values(last);
            outcome = None;
            match sound {
                [true, true] if moves => outcome = Some(recursion.step(taken)),
                [_, true] => {
                    recursion.step_without_update(taken);
                }
                [_, false] => recursion.bridge(taken),
            }
        }
        self.in_ring = 0;
        if is_target {
            self.response_until = self.samples + self.settling_samples;
        } else {
            self.report(GuardKind::Step, c, held, size, GuardAction::Accepted, 0);
        }
        GuardDecision { outcome, held: false }
    }
}
