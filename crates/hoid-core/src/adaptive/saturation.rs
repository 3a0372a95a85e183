//! Censored samples: outputs at a limit of the stick.
//!
//! An output at a limit shows only that the intended output was at or beyond this limit. If it were used as measured,
//! it would bias the gains towards zero and add an error to the residuals with which the following samples are
//! filtered. Such samples therefore do not update the estimate. The filters receive the predicted output if it lies
//! beyond the limit, and the limit otherwise (for regression with censored outputs see J. Tobin, *Econometrica* 26
//! (1958) 24-36).
//!
//! The stick is at a limit if two consecutive outputs are equal and no output has been farther in that direction. From
//! then on, a single sample at the limit is enough. When a limit is first reached, the first of the two samples is
//! recognised as a limit only in a replay.

use super::history::SampleUse;

/// Limits of the stick, as far as u has reached them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Saturation {
    lowest: f64,
    highest: f64,
    last: f64,
    /// True for the lower and for the upper limit if u has stayed there, so the limit is known.
    known: [bool; 2],
}

crate::state!([] Saturation { lowest, highest, last, known });

impl Saturation {
    /// Returns a state in which no limit is known.
    pub const fn new() -> Self {
        Self {
            lowest: 0.0,
            highest: 0.0,
            last: 0.0,
            known: [false; 2],
        }
    }

    /// Returns the limit that an output has reached, or `None` if it is not at a limit.
    #[inline(always)]
    pub fn limit_reached(&self, u: f64) -> Option<SampleUse> {
        let [low, high] = self.known;
        let again = u == self.last;
        match self.highest > self.lowest {
            true if u == self.highest && (again || high) => Some(SampleUse::AtUpperLimit),
            true if u == self.lowest && (again || low) => Some(SampleUse::AtLowerLimit),
            _ => None,
        }
    }

    /// Returns the output that replaces an output at a limit in the filters: the prediction, limited to the interval
    /// from the limit to one range of the stick beyond it.
    #[inline(always)]
    pub fn replacement(&self, end: SampleUse, u: f64, predicted: f64) -> f64 {
        let range = self.highest - self.lowest;
        match end {
            SampleUse::AtUpperLimit => predicted.max(u).min(u + range),
            SampleUse::AtLowerLimit => predicted.min(u).max(u - range),
            _ => u,
        }
    }

    /// Updates the limits with a sample.
    #[inline(always)]
    pub fn update(&mut self, u: f64) {
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

    fn saturation_after(outputs: &[f64]) -> Saturation {
        let mut ends = Saturation::new();
        outputs.iter().for_each(|u| ends.update(*u));
        ends
    }

    #[test]
    fn held_extreme_value_is_a_limit() {
        let ends = saturation_after(&[0.1, -0.4, 1.0]);
        // Predictions beyond the limit, inside the limit, and more than one range beyond it.
        let beyond = |u: f64, predicted: f64| ends.limit_reached(u).map(|end| ends.replacement(end, u, predicted));
        assert_eq!(beyond(1.0, 1.3), Some(1.3));
        assert_eq!(beyond(1.0, 0.2), Some(1.0));
        assert_eq!(beyond(1.0, 1e9), Some(1.0 + 1.4));
        let lower = saturation_after(&[0.1, -0.4]);
        assert_eq!(lower.limit_reached(-0.4), Some(SampleUse::AtLowerLimit));
        assert_eq!(lower.replacement(SampleUse::AtLowerLimit, -0.4, -0.5), -0.5);
        assert_eq!(lower.replacement(SampleUse::AtLowerLimit, -0.4, 3.0), -0.4);
    }

    #[test]
    fn moving_or_inner_value_is_not_a_limit() {
        let ends = saturation_after(&[0.1, 1.0, 0.5]);
        assert_eq!(ends.limit_reached(0.5), None);
        assert_eq!(ends.limit_reached(1.0), None);
        assert_eq!(saturation_after(&[1.0]).limit_reached(1.1), None);
    }

    #[test]
    fn known_limit_is_recognised_at_once() {
        let ends = saturation_after(&[0.1, 1.0, 1.0, -0.3]);
        assert_eq!(ends.limit_reached(1.0), Some(SampleUse::AtUpperLimit));
        assert_eq!(ends.limit_reached(-0.3), Some(SampleUse::AtLowerLimit));
        // An output beyond the limit is not at a limit.
        assert_eq!(saturation_after(&[0.1, 1.0, 1.0, 1.2, 0.0]).limit_reached(1.2), None);
    }

    #[test]
    fn constant_output_has_no_limit() {
        assert_eq!(saturation_after(&[]).limit_reached(0.0), None);
        assert_eq!(saturation_after(&[0.0; 4]).limit_reached(0.0), None);
    }

    #[test]
    fn released_pedal_is_at_its_lower_limit() {
        let ends = saturation_after(&[0.0, 0.3, 0.0]);
        assert_eq!(ends.limit_reached(0.0), Some(SampleUse::AtLowerLimit));
    }
}
