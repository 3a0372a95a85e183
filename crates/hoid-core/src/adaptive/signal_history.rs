//! Last signals of a basis, the newest first, stored so that no signal is moved when a sample is added.
//!
//! The ring is stored twice in succession, so its signals are contiguous from any start.

use super::{
    f64x2::F64x2,
    sizes::{MAX_NOISE_ORDER, SIGNAL_COUNT},
};
use crate::state::State;

/// Signals of one sample, in pairs.
pub(super) type SignalPairs = [F64x2; SIGNAL_COUNT / 2];

/// Arranges the signals of one sample in pairs.
#[inline(always)]
pub(super) fn to_pairs(signals: &[f64; SIGNAL_COUNT]) -> SignalPairs {
    core::array::from_fn(|i| F64x2([signals[2 * i], signals[2 * i + 1]]))
}

/// Returns the signals of one sample from their pairs.
#[inline(always)]
pub(super) fn from_pairs(pairs: &SignalPairs) -> [f64; SIGNAL_COUNT] {
    core::array::from_fn(|i| pairs[i / 2].0[i % 2])
}

/// Signals of the most recent samples.
#[derive(Debug, Clone)]
pub(super) struct SignalHistory {
    twice: [SignalPairs; 2 * MAX_NOISE_ORDER],
    newest: usize,
}

impl SignalHistory {
    /// Signals of zero at all samples.
    pub const ZERO: Self = Self {
        twice: [[F64x2::ZERO; SIGNAL_COUNT / 2]; 2 * MAX_NOISE_ORDER],
        newest: 0,
    };

    /// Returns the signals of the most recent samples, the newest first.
    #[inline(always)]
    pub fn newest_first(&self) -> &[SignalPairs] {
        self.twice[self.newest..]
            .first_chunk::<MAX_NOISE_ORDER>()
            .map_or(&[], |past| past)
    }

    /// Stores the signals of a new sample in place of the signals of the oldest sample.
    #[inline(always)]
    pub fn push(&mut self, signals: &[f64; SIGNAL_COUNT]) {
        self.newest = self.newest.checked_sub(1).unwrap_or(MAX_NOISE_ORDER - 1);
        self.twice[self.newest] = to_pairs(signals);
        self.twice[self.newest + MAX_NOISE_ORDER] = to_pairs(signals);
    }
}

impl PartialEq for SignalHistory {
    /// True if the signals are equal, regardless of the position at which each ring starts.
    fn eq(&self, other: &Self) -> bool {
        self.newest_first() == other.newest_first()
    }
}

impl State for SignalHistory {
    /// Rotates the ring so that it starts at position zero, and then visits the signals, the newest first. The saved
    /// numbers thus do not depend on the position at which the ring started.
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        self.twice[..MAX_NOISE_ORDER].rotate_left(self.newest);
        self.newest = 0;
        let (first, second) = self.twice.split_at_mut(MAX_NOISE_ORDER);
        first.visit(each);
        second.copy_from_slice(first);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn history_keeps_the_order_and_can_be_saved_at_any_time() {
        let mut past = SignalHistory::ZERO;
        for t in 0..100 {
            past.push(&[f64::from(t); SIGNAL_COUNT]);
            let expected = |age: usize| (f64::from(t) - age as f64).max(0.0);
            for (age, signals) in past.newest_first().iter().enumerate() {
                assert_eq!(*signals, to_pairs(&[expected(age); SIGNAL_COUNT]));
            }
            assert_eq!(past.newest_first().len(), MAX_NOISE_ORDER);
            let (mut copy, mut age) = (past.clone(), 0);
            copy.visit(&mut |number| {
                assert_eq!(*number, expected(age / SIGNAL_COUNT));
                age += 1;
            });
            assert_eq!(copy, past);
            copy.push(&[1.0; SIGNAL_COUNT]);
            past.clone().push(&[1.0; SIGNAL_COUNT]);
            assert_eq!(copy.newest_first()[1..], past.newest_first()[..MAX_NOISE_ORDER - 1]);
        }
    }
}
