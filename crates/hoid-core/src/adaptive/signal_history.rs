//! Last signals of a basis, the newest first, stored so that no signal is moved when a sample is added.
//!
//! The ring is stored twice in succession, so its signals are contiguous from any start.

use super::{
    f64x2::F64x2,
    sizes::{LARGEST_ORDER, SIGNALS},
};
use crate::state::State;

/// Signals of one sample, in pairs.
pub(super) type Paired = [F64x2; SIGNALS / 2];

/// Arranges the signals of one sample in pairs.
#[inline(always)]
pub(super) fn paired(signals: &[f64; SIGNALS]) -> Paired {
    core::array::from_fn(|i| F64x2([signals[2 * i], signals[2 * i + 1]]))
}

/// Signals of the last samples.
#[derive(Debug, Clone)]
pub(super) struct SignalHistory {
    twice: [Paired; 2 * LARGEST_ORDER],
    newest: usize,
}

impl SignalHistory {
    /// Signals of zero at all samples.
    pub const ZERO: Self = Self {
        twice: [[F64x2::ZERO; SIGNALS / 2]; 2 * LARGEST_ORDER],
        newest: 0,
    };

    /// Returns the signals of the last samples, the newest first.
    #[inline(always)]
    pub fn newest_first(&self) -> &[Paired] {
        self.twice[self.newest..]
            .first_chunk::<LARGEST_ORDER>()
            .map_or(&[], |past| past)
    }

    /// Stores the signals of a new sample in place of the signals of the oldest sample.
    #[inline(always)]
    pub fn push(&mut self, signals: &[f64; SIGNALS]) {
        self.newest = self.newest.checked_sub(1).unwrap_or(LARGEST_ORDER - 1);
        self.twice[self.newest] = paired(signals);
        self.twice[self.newest + LARGEST_ORDER] = paired(signals);
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
        self.twice[..LARGEST_ORDER].rotate_left(self.newest);
        self.newest = 0;
        let (first, second) = self.twice.split_at_mut(LARGEST_ORDER);
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
            past.push(&[f64::from(t); SIGNALS]);
            let expected = |age: usize| (f64::from(t) - age as f64).max(0.0);
            for (age, signals) in past.newest_first().iter().enumerate() {
                assert_eq!(*signals, paired(&[expected(age); SIGNALS]));
            }
            assert_eq!(past.newest_first().len(), LARGEST_ORDER);
            let (mut copy, mut age) = (past.clone(), 0);
            copy.visit(&mut |number| {
                assert_eq!(*number, expected(age / SIGNALS));
                age += 1;
            });
            assert_eq!(copy, past);
            copy.push(&[1.0; SIGNALS]);
            past.clone().push(&[1.0; SIGNALS]);
            assert_eq!(copy.newest_first()[1..], past.newest_first()[..LARGEST_ORDER - 1]);
        }
    }
}
