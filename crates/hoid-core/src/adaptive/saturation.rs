//! Where the stick ends.
//!
//! A stick that is at its end reports only that they would have gone at least as far. Taken as it is, such an output
//! reports that they answered less than they do, and the samples after it are held against a noise that was none. So
//! nothing is learnt of it, and what goes on in the filters is the output that was predicted, where that lies beyond
//! the end, and the end where it does not: the output given what is known, except for the noise (J. Tobin,
//! *Econometrica* 26 (1958) 24-36, has the regression with both).
//!
//! The stick is at its end where two samples one after the other are alike, and none has been farther out; from then on
//! one sample there is enough. The first time, the sample before is only known to be at the end when a replay reads it.

use super::history::Use;

/// The ends that have been reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Saturation {
    lowest: f64,
    highest: f64,
    last: f64,
    /// Whether the stick has stayed at its lowest and at its highest output.
    known: [bool; 2],
}

crate::state!([] Saturation { lowest, highest, last, known });

impl Saturation {
    /// At rest.
    pub const fn new() -> Self {
        Self {
            lowest: 0.0,
            highest: 0.0,
            last: 0.0,
            known: [false; 2],
        }
    }

    /// The end at which the stick is, if it is at one.
    #[inline(always)]
    pub fn end(&self, u: f64) -> Option<Use> {
        let [low, high] = self.known;
        let again = u == self.last;
        match self.highest > self.lowest {
            true if u == self.highest && (again || high) => Some(Use::AtUpperLimit),
            true if u == self.lowest && (again || low) => Some(Use::AtLowerLimit),
            _ => None,
        }
    }

    /// What goes on in the filters in the place of an output at an end, from what was predicted: never
    /// farther beyond it than the ends are from one another.
    #[inline(always)]
    pub fn beyond(&self, end: Use, u: f64, predicted: f64) -> f64 {
        let range = self.highest - self.lowest;
        match end {
            Use::AtUpperLimit => predicted.max(u).min(u + range),
            Use::AtLowerLimit => predicted.min(u).max(u - range),
            _ => u,
        }
    }

    /// Saturation a sample.
    #[inline(always)]
    pub fn remember(&mut self, u: f64) {
        let again = u == self.last && self.highest > self.lowest;
        let [low, high] = &mut self.known;
        *low = u >= self.lowest && (*low || again && u == self.lowest);
        *high = u <= self.highest && (*high || again && u == self.highest);
        self.lowest = self.lowest.min(u);
        self.highest = self.highest.max(u);
        self.last = u;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(outputs: &[f64]) -> Saturation {
        let mut ends = Saturation::new();
        outputs.iter().for_each(|u| ends.remember(*u));
        ends
    }

    #[test]
    fn a_stick_that_stands_farther_out_than_ever_is_at_its_end() {
        let ends = after(&[0.1, -0.4, 1.0]);
        // Predicted beyond the end, this side of it, and farther than can be.
        let beyond = |u: f64, predicted: f64| ends.end(u).map(|end| ends.beyond(end, u, predicted));
        assert_eq!(beyond(1.0, 1.3), Some(1.3));
        assert_eq!(beyond(1.0, 0.2), Some(1.0));
        assert_eq!(beyond(1.0, 1e9), Some(1.0 + 1.4));
        let lower = after(&[0.1, -0.4]);
        assert_eq!(lower.end(-0.4), Some(Use::AtLowerLimit));
        assert_eq!(lower.beyond(Use::AtLowerLimit, -0.4, -0.5), -0.5);
        assert_eq!(lower.beyond(Use::AtLowerLimit, -0.4, 3.0), -0.4);
    }

    #[test]
    fn one_that_moves_or_has_been_farther_is_not() {
        let ends = after(&[0.1, 1.0, 0.5]);
        assert_eq!(ends.end(0.5), None);
        assert_eq!(ends.end(1.0), None);
        assert_eq!(after(&[1.0]).end(1.1), None);
    }

    #[test]
    fn an_end_at_which_the_stick_has_stayed_is_known_at_once() {
        let ends = after(&[0.1, 1.0, 1.0, -0.3]);
        assert_eq!(ends.end(1.0), Some(Use::AtUpperLimit));
        assert_eq!(ends.end(-0.3), Some(Use::AtLowerLimit));
        // Farther out than the end is not an end.
        assert_eq!(after(&[0.1, 1.0, 1.0, 1.2, 0.0]).end(1.2), None);
    }

    #[test]
    fn a_stick_that_never_moved_has_no_end() {
        assert_eq!(after(&[]).end(0.0), None);
        assert_eq!(after(&[0.0; 4]).end(0.0), None);
    }

    #[test]
    fn a_pedal_ends_where_it_is_let_go() {
        let ends = after(&[0.0, 0.3, 0.0]);
        assert_eq!(ends.end(0.0), Some(Use::AtLowerLimit));
    }
}
