//! Delays that are not known, or that change: a hypothesis says which one holds.
//!
//! The response to an error that arrives k samples later is the response k samples ago: one filter gives the signals for all delays between
//! the shortest and the longest, and a ring keeps those of the last samples, behind the whitening filter. Each hypothesis has a delay of whole samples and
//! takes the signals of that delay. Two kinds are born:
//!
//! - **beside** the likeliest, with delays next to its own, as what may have held all the time: since the same birth, each of its parameters opened by
//!   what so many samples of delay are worth in it; the first of them when the bank begins;
//! - **elsewhere**, as what the person may have changed to: at every so many-th of the possible delays, with gains that are opened as in any change, and
//!   probabilities in proportion to the normal density of the step. The places move on by one each time, so that all have their turn, and the number of
//!   hypotheses is bounded however many delays there are.
//!
//! The delay of the mixture is the mean over the hypotheses. Its variance has that of rounding to whole samples, 1/12, in it.

use super::{hypothesis::OPERATOR, response::Signals};

/// What is supposed of the delay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Delays {
    /// Number of delays in question, one sample apart; one: it is known.
    pub count: usize,
    /// Births of hypotheses that the gains change, for one time at which other delays are proposed.
    pub every: u32,
    /// Odds that the delay changes too against a change of the gains alone.
    pub odds: f64,
    /// Delays elsewhere that are proposed at a time, at most.
    pub births: usize,
    /// Standard deviation of a change of the delay, samples.
    pub jump: f64,
    /// Probability of a delay next to the likeliest.
    pub neighbour: f64,
    /// What a sample of delay is worth: deviations of K_e and K_e_dot in the units of [`super::Suppositions::jump`], of omega_nm and zeta_nm as shares of them.
    pub worth: [f64; OPERATOR],
}

impl Delays {
    /// A delay that is known and stays.
    pub const KNOWN: Self = Self {
        count: 1,
        every: u32::MAX,
        odds: 0.0,
        births: 1,
        jump: 1.0,
        neighbour: 0.0,
        worth: [0.0; OPERATOR],
    };
}

/// The signals of one sample for every delay.
#[derive(Debug, Clone, Copy)]
pub struct ByDelay<'a> {
    ring: &'a [Signals],
    newest: usize,
}

impl<'a> ByDelay<'a> {
    /// Of a delay that is known.
    pub fn known(signals: &'a Signals) -> Self {
        Self {
            ring: core::slice::from_ref(signals),
            newest: 0,
        }
    }

    /// For a delay so many samples longer than the shortest.
    ///
    /// # Panics
    /// Beyond the longest.
    #[inline(always)]
    pub fn at(&self, later: usize) -> &'a Signals {
        let place = if later > self.newest {
            self.newest + self.ring.len() - later
        } else {
            self.newest - later
        };
        &self.ring[place]
    }
}

/// The signals of the last samples, as many as there are delays.
#[derive(Debug, Clone, PartialEq)]
pub struct Ring<B> {
    memory: B,
    newest: usize,
}

impl<B: AsMut<[Signals]>> crate::state::State for Ring<B> {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        self.memory.as_mut().visit(each);
        self.newest.visit(each);
    }
}

impl<B: AsRef<[Signals]> + AsMut<[Signals]>> Ring<B> {
    /// At rest, as long as its memory.
    pub fn new(mut memory: B) -> Self {
        memory.as_mut().fill([0.0; 6]);
        Self { memory, newest: 0 }
    }

    /// Number of delays.
    pub fn count(&self) -> usize {
        self.memory.as_ref().len()
    }

    /// Takes the signals of a sample for the shortest delay.
    #[inline(always)]
    pub fn put(&mut self, signals: Signals) {
        let memory = self.memory.as_mut();
        self.newest = if self.newest + 1 < memory.len() {
            self.newest + 1
        } else {
            0
        };
        memory[self.newest] = signals;
    }

    /// The signals of the sample that was taken last.
    #[inline(always)]
    pub fn last(&self) -> ByDelay<'_> {
        ByDelay {
            ring: self.memory.as_ref(),
            newest: self.newest,
        }
    }

    /// All that is remembered.
    pub fn iter_mut(&mut self) -> core::slice::IterMut<'_, Signals> {
        self.memory.as_mut().iter_mut()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signals_of_a_delay_are_those_of_so_many_samples_ago() {
        let mut ring = Ring::new([[7.0; 6]; 3]);
        for k in 0..8 {
            ring.put([f64::from(k); 6]);
            for later in 0..3 {
                let ago = f64::from(k) - later as f64;
                assert_eq!(ring.last().at(later)[0], ago.max(0.0));
            }
        }
        let only = [4.0; 6];
        assert_eq!(ByDelay::known(&only).at(0), &only);
    }
}
