//! Where the stick ends.
//!
//! A stick that stands at its end says only that they would have gone at least as far. Taken as it is, such
//! an output says that they answered less than they do, and the samples behind it are held against a noise
//! that was none. So nothing is learnt of it, and what goes on in the filters is the output that was
//! foretold, where that lies beyond the end, and the end where it does not: the output given what is known,
//! but for the noise (J. Tobin, *Econometrica* 26 (1958) 24-36, has the regression with both).
//!
//! The stick stands at its end where two samples one after another are alike, and none has been farther
//! out. An end is only known once it has been reached, so the first sample there counts as any other.

/// The ends that have been reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ends {
    lowest: f64,
    highest: f64,
    last: f64,
}

crate::state!([] Ends { lowest, highest, last });

impl Ends {
    /// At rest.
    pub const fn new() -> Self {
        Self {
            lowest: 0.0,
            highest: 0.0,
            last: 0.0,
        }
    }

    /// Takes an output, and what was foretold; what goes on in the filters in its place where the stick
    /// stands at an end: never farther beyond it than the ends are from one another.
    #[inline(always)]
    pub fn beyond(&self, u: f64, foretold: f64) -> Option<f64> {
        let range = self.highest - self.lowest;
        match u == self.last && range > 0.0 {
            true if u == self.highest => Some(foretold.max(u).min(u + range)),
            true if u == self.lowest => Some(foretold.min(u).max(u - range)),
            _ => None,
        }
    }

    /// Ends a sample.
    #[inline(always)]
    pub fn remember(&mut self, u: f64) {
        self.lowest = self.lowest.min(u);
        self.highest = self.highest.max(u);
        self.last = u;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(outputs: &[f64]) -> Ends {
        let mut ends = Ends::new();
        outputs.iter().for_each(|u| ends.remember(*u));
        ends
    }

    #[test]
    fn a_stick_that_stands_farther_out_than_ever_is_at_its_end() {
        let ends = after(&[0.1, -0.4, 1.0]);
        // Foretold beyond the end, this side of it, and farther than can be.
        assert_eq!(ends.beyond(1.0, 1.3), Some(1.3));
        assert_eq!(ends.beyond(1.0, 0.2), Some(1.0));
        assert_eq!(ends.beyond(1.0, 1e9), Some(1.0 + 1.4));
        let lower = after(&[0.1, -0.4]);
        assert_eq!(lower.beyond(-0.4, -0.5), Some(-0.5));
        assert_eq!(lower.beyond(-0.4, 3.0), Some(-0.4));
    }

    #[test]
    fn one_that_moves_or_has_been_farther_is_not() {
        let ends = after(&[0.1, 1.0, 0.5]);
        assert_eq!(ends.beyond(0.5, 2.0), None);
        assert_eq!(ends.beyond(1.0, 2.0), None);
        assert_eq!(after(&[1.0]).beyond(1.1, 2.0), None);
    }

    #[test]
    fn a_stick_that_never_moved_has_no_end() {
        assert_eq!(after(&[]).beyond(0.0, 2.0), None);
        assert_eq!(after(&[0.0; 4]).beyond(0.0, 2.0), None);
    }

    #[test]
    fn a_pedal_ends_where_it_is_let_go() {
        let ends = after(&[0.0, 0.3, 0.0]);
        assert_eq!(ends.beyond(0.0, -0.2), Some(-0.2));
    }
}
