//! Ring buffer of the signals of the most recent samples, which contains the signals for every delay.
//!
//! The response to an error that is delayed by k more samples equals the response k samples earlier. One filter
//! therefore gives the signals for all delays between the shortest and the longest; a ring buffer stores its most
//! recent signals after the whitening filter.

use super::response::Signals;

/// The signals at one sample for every delay.
#[derive(Debug, Clone, Copy)]
pub struct DelayedSignals<'a> {
    ring: &'a [Signals],
    newest: usize,
}

impl<'a> DelayedSignals<'a> {
    /// Creates the signals of a model whose delay is known.
    pub fn from_known_delay(signals: &'a Signals) -> Self {
        Self {
            ring: std::slice::from_ref(signals),
            newest: 0,
        }
    }

    /// Returns the signals for a delay that is `extra_delay` samples longer than the shortest.
    ///
    /// # Panics
    /// A delay that exceeds the longest delay causes a panic or returns the signals of another delay.
    #[inline(always)]
    pub fn at(&self, extra_delay: usize) -> &'a Signals {
        let index = if extra_delay > self.newest {
            self.newest + self.ring.len() - extra_delay
        } else {
            self.newest - extra_delay
        };
        &self.ring[index]
    }
}

/// Ring buffer of the signals of the most recent samples; its length is the number of delays.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalRing<B> {
    memory: B,
    newest: usize,
}

impl<B: AsMut<[Signals]>> hoid_core::state::State for SignalRing<B> {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        self.memory.as_mut().visit(each);
        self.newest.visit(each);
        self.newest = self.newest.min(self.memory.as_mut().len().saturating_sub(1));
    }
}

impl<B: AsRef<[Signals]> + AsMut<[Signals]>> SignalRing<B> {
    /// Creates a ring buffer of zeros with the size of the memory.
    pub fn new(mut memory: B) -> Self {
        memory.as_mut().fill([0.0; 6]);
        Self { memory, newest: 0 }
    }

    /// Returns the number of delays.
    pub fn delay_count(&self) -> usize {
        self.memory.as_ref().len()
    }

    /// Adds the signals of a sample for the shortest delay; they replace the oldest signals.
    #[inline(always)]
    pub fn push(&mut self, signals: Signals) {
        let memory = self.memory.as_mut();
        self.newest = if self.newest + 1 < memory.len() {
            self.newest + 1
        } else {
            0
        };
        memory[self.newest] = signals;
    }

    /// Returns the signals at the newest sample.
    #[inline(always)]
    pub fn newest(&self) -> DelayedSignals<'_> {
        DelayedSignals {
            ring: self.memory.as_ref(),
            newest: self.newest,
        }
    }

    /// Returns a mutable iterator over all signals in the buffer.
    pub fn iter_mut(&mut self) -> std::slice::IterMut<'_, Signals> {
        self.memory.as_mut().iter_mut()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delayed_signals_are_past_samples() {
        let mut ring = SignalRing::new([[7.0; 6]; 3]);
        for k in 0..8 {
            ring.push([f64::from(k); 6]);
            for extra_delay in 0..3 {
                let ago = f64::from(k) - extra_delay as f64;
                assert_eq!(ring.newest().at(extra_delay)[0], ago.max(0.0));
            }
        }
        let only = [4.0; 6];
        assert_eq!(DelayedSignals::from_known_delay(&only).at(0), &only);
    }
}
