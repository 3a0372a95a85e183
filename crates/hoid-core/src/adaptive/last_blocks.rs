//! The last blocks of a candidate, with one noise model and in one basis: the data of the detector.
//!
//! If samples are not used for longer than a quarter of a second, or the signals do not change, the blocks next to that gap
//! are dropped: samples before it may belong to the same fault, and after it the filters have to settle.

use super::blocks::{Block, EMPTY, Row};

/// Capacity, in blocks.
pub const BLOCKS: usize = 96;
/// Length of a block, s.
pub const BLOCK_S: f64 = 0.5;
/// Time from which unused samples are a gap, and time that is skipped after one, s.
const GAP_S: f64 = 0.25;
const BEHIND_S: f64 = 2.0;

/// The blocks, the oldest first.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LastBlocks {
    samples_of_block: u64,
    open: Block,
    blocks: [Block; BLOCKS],
    count: usize,
    /// Number of consecutive unused samples, and number of samples that are still to be skipped.
    gap: u64,
    behind: u64,
    fresh: usize,
    closed: bool,
}

crate::state!([] LastBlocks { open, blocks, count, gap, behind, fresh, closed });

impl LastBlocks {
    /// Without blocks, for a sample time in s.
    pub fn new(ts: f64) -> Self {
        Self {
            samples_of_block: libm::round(BLOCK_S / ts).max(1.0) as u64,
            open: EMPTY,
            blocks: [EMPTY; BLOCKS],
            count: 0,
            gap: 0,
            behind: 0,
            fresh: BLOCKS,
            closed: false,
        }
    }

    /// Takes a sample.
    #[inline(always)]
    pub fn take(&mut self, row: &Row) {
        (self.gap, self.closed) = (0, false);
        if self.behind > 0 {
            self.behind -= 1;
            return;
        }
        self.open.add(row);
        if self.open.samples >= self.samples_of_block as f64 {
            self.close();
        }
    }

    fn close(&mut self) {
        if self.count == BLOCKS {
            self.blocks.copy_within(1.., 0);
            self.count -= 1;
        }
        self.blocks[self.count] = core::mem::replace(&mut self.open, EMPTY);
        self.count += 1;
        self.fresh = (self.fresh + 1).min(BLOCKS);
        self.closed = true;
    }

    /// A sample without information that is not a fault.
    pub fn pass_over(&mut self) {
        self.closed = false;
    }

    /// A sample that is not used.
    pub fn skip(&mut self) {
        self.pass_over();
        self.gap += 1;
        let samples = |seconds: f64| (seconds / BLOCK_S * self.samples_of_block as f64) as u64;
        let (long, behind) = (samples(GAP_S).max(1), samples(BEHIND_S));
        if self.gap == long {
            // Drops the open block and the one before it.
            self.open = EMPTY;
            self.count = self.count.saturating_sub(1);
            self.fresh = 0;
        }
        if self.gap >= long {
            self.behind = behind;
        }
    }

    /// The blocks.
    pub fn all(&self) -> &[Block] {
        &self.blocks[..self.count.min(BLOCKS)]
    }

    /// Blocks since the last gap.
    pub fn fresh(&self) -> usize {
        self.fresh
    }

    /// True if the last sample ended a block.
    pub fn closed(&self) -> bool {
        self.closed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adaptive::sizes::STATES;

    const ROW: Row = Row {
        x: [1.0; STATES],
        y: 1.0,
        innovation: 0.0,
        variance: 1.0,
    };

    #[test]
    fn blocks_end_after_half_a_second_and_the_oldest_goes() {
        let mut last = LastBlocks::new(0.1);
        let mut closed = 0;
        for _ in 0..5 * (BLOCKS + 3) {
            last.take(&ROW);
            closed += usize::from(last.closed());
        }
        assert_eq!((closed, last.all().len()), (BLOCKS + 3, BLOCKS));
    }

    #[test]
    fn what_is_beside_a_gap_is_not_kept() {
        let mut last = LastBlocks::new(0.05);
        (0..25).for_each(|_| last.take(&ROW));
        assert_eq!(last.all().len(), 2);
        // Shorter than a gap, then one.
        (0..4).for_each(|_| last.skip());
        last.take(&ROW);
        assert_eq!(last.all().len(), 2);
        (0..5).for_each(|_| last.skip());
        assert_eq!((last.all().len(), last.fresh()), (1, 0));
        // Two seconds after it are not examined.
        (0..49).for_each(|_| last.take(&ROW));
        assert_eq!(last.all().len(), 1);
        last.take(&ROW);
        assert_eq!((last.all().len(), last.fresh()), (2, 1));
    }
}
