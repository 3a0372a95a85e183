//! States between past changes.

use super::sizes::MAX_SEGMENTS;

/// Segment that ended with a change: its last block, and the state at its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Segment<const S: usize> {
    pub until: u64,
    pub state: [f64; S],
}

crate::state!([const S: usize] Segment<S> { until, state });

/// States of successive segments, each with the last block of its segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Segments<const S: usize> {
    all: [Segment<S>; MAX_SEGMENTS + 1],
    count: usize,
}

crate::state!([const S: usize] Segments<S> { all, count });

impl<const S: usize> Segments<S> {
    pub const EMPTY: Self = Self {
        all: [Segment {
            until: 0,
            state: [0.0; S],
        }; MAX_SEGMENTS + 1],
        count: 0,
    };

    pub fn push(&mut self, segment: Segment<S>) {
        if let Some(place) = self.all.get_mut(self.count) {
            *place = segment;
            self.count += 1;
        }
    }

    /// Returns the segments for a candidate that starts `later` blocks later, with the states converted by `to`.
    pub fn converted(mut self, later: u64, to: impl Fn(&[f64; S]) -> [f64; S]) -> Self {
        for segment in &mut self.all {
            *segment = Segment {
                until: segment.until.saturating_sub(later),
                state: to(&segment.state),
            };
        }
        self
    }

    /// Returns the state of the segment that contains a block, or `None` if no segment contains it.
    pub fn at(&self, block: u64) -> Option<&[f64; S]> {
        let all = &self.all[..self.count.min(MAX_SEGMENTS + 1)];
        all.iter()
            .find(|segment| block < segment.until)
            .map(|segment| &segment.state)
    }
}
