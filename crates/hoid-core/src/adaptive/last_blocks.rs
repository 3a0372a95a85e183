//! Last blocks of a candidate, all with the same noise model and in the same basis: the data used by the change
//! detector.
//!
//! If samples are unused for a quarter of a second or longer (for example, because the signals do not change), the
//! incomplete block and the block before it are dropped, since samples just before such a gap may already be faulty.
//! The samples in the two seconds after the gap are skipped, because the filters have to settle.

use super::blocks::{Block, Row};

/// Maximum number of blocks.
pub const MAX_BLOCKS: usize = 96;
/// Length of a block in s.
pub const BLOCK_S: f64 = 0.5;
/// Shortest time in s for which unused samples count as a gap; `SKIPPED_AFTER_GAP_S` is the time that is skipped after
/// a gap.
const MIN_GAP_S: f64 = 0.25;
const SKIPPED_AFTER_GAP_S: f64 = 2.0;

/// Last blocks, the oldest first.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LastBlocks<const S: usize, const P: usize> {
    samples_of_block: u64,
    open: Block<S, P>,
    blocks: [Block<S, P>; MAX_BLOCKS],
    count: usize,
    /// Number of consecutive unused samples, and number of samples that still have to be skipped.
    gap: u64,
    to_skip: u64,
    fresh: usize,
    closed: bool,
}

crate::state!([const S: usize, const P: usize] LastBlocks<S, P> { open, blocks, count, gap, to_skip, fresh, closed }, limit_restored);

impl<const S: usize, const P: usize> LastBlocks<S, P> {
    /// Limits the restored number of blocks.
    fn limit_restored(&mut self) {
        self.count = self.count.min(MAX_BLOCKS);
    }

    /// Returns an empty list of blocks, with the sample time in s.
    pub fn new(ts: f64) -> Self {
        Self {
            samples_of_block: libm::round(BLOCK_S / ts).max(1.0) as u64,
            open: Block::EMPTY,
            blocks: [Block::EMPTY; MAX_BLOCKS],
            count: 0,
            gap: 0,
            to_skip: 0,
            fresh: MAX_BLOCKS,
            closed: false,
        }
    }

    /// Adds a sample to the current block, unless it follows a gap and has to be skipped.
    #[inline(always)]
    pub fn add(&mut self, row: &Row<S>) {
        (self.gap, self.closed) = (0, false);
        if self.to_skip > 0 {
            self.to_skip -= 1;
            return;
        }
        self.open.add(row);
        if self.open.samples >= self.samples_of_block as f64 {
            self.close_block();
        }
    }

    fn close_block(&mut self) {
        if self.count == MAX_BLOCKS {
            self.blocks.copy_within(1.., 0);
            self.count -= 1;
        }
        self.blocks[self.count] = core::mem::replace(&mut self.open, Block::EMPTY);
        self.count += 1;
        self.fresh = (self.fresh + 1).min(MAX_BLOCKS);
        self.closed = true;
    }

    /// Passes over a sample that carries no information but is not faulty, such as an output at a limit of the stick.
    pub fn ignore_sample(&mut self) {
        self.closed = false;
    }

    /// Counts an unused sample.
    pub fn count_unused_sample(&mut self) {
        self.ignore_sample();
        self.gap += 1;
        let samples = |seconds: f64| (seconds / BLOCK_S * self.samples_of_block as f64) as u64;
        let (long, to_skip) = (samples(MIN_GAP_S).max(1), samples(SKIPPED_AFTER_GAP_S));
        if self.gap == long {
            // Drops the incomplete block and the block before it.
            self.open = Block::EMPTY;
            self.count = self.count.saturating_sub(1);
            self.fresh = 0;
        }
        if self.gap >= long {
            self.to_skip = to_skip;
        }
    }

    /// All stored blocks, the oldest first.
    pub fn blocks(&self) -> &[Block<S, P>] {
        &self.blocks[..self.count.min(MAX_BLOCKS)]
    }

    /// Number of blocks completed since the last gap.
    pub fn fresh_block_count(&self) -> usize {
        self.fresh
    }

    /// True if the last sample completed a block.
    pub fn is_block_complete(&self) -> bool {
        self.closed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        adaptive::sizes::{PRODUCT_COUNT, STATE_COUNT},
        state::State,
    };

    const ROW: Row<STATE_COUNT> = Row {
        x: [1.0; STATE_COUNT],
        y: 1.0,
        innovation: 0.0,
        variance: 1.0,
    };

    #[test]
    fn blocks_last_half_a_second_and_the_oldest_is_dropped() {
        let mut last = LastBlocks::<STATE_COUNT, PRODUCT_COUNT>::new(0.1);
        let mut closed = 0;
        for _ in 0..5 * (MAX_BLOCKS + 3) {
            last.add(&ROW);
            closed += usize::from(last.is_block_complete());
        }
        assert_eq!((closed, last.blocks().len()), (MAX_BLOCKS + 3, MAX_BLOCKS));
    }

    /// The number of blocks remains within the list after invalid numbers were restored.
    #[test]
    fn restored_block_count_is_limited() {
        let mut last = LastBlocks::<STATE_COUNT, PRODUCT_COUNT>::new(0.1);
        last.visit(&mut |number| *number = 1e18);
        (0..20).for_each(|_| last.add(&ROW));
        (last.to_skip, last.open) = (0, Block::EMPTY);
        (0..20).for_each(|_| last.add(&ROW));
        assert_eq!(last.blocks().len(), MAX_BLOCKS);
    }

    #[test]
    fn blocks_next_to_a_gap_are_dropped() {
        let mut last = LastBlocks::<STATE_COUNT, PRODUCT_COUNT>::new(0.05);
        (0..25).for_each(|_| last.add(&ROW));
        assert_eq!(last.blocks().len(), 2);
        // Fewer unused samples than in a gap have no effect; a gap removes the last block.
        (0..4).for_each(|_| last.count_unused_sample());
        last.add(&ROW);
        assert_eq!(last.blocks().len(), 2);
        (0..5).for_each(|_| last.count_unused_sample());
        assert_eq!((last.blocks().len(), last.fresh_block_count()), (1, 0));
        // The two seconds after the gap are skipped.
        (0..49).for_each(|_| last.add(&ROW));
        assert_eq!(last.blocks().len(), 1);
        last.add(&ROW);
        assert_eq!((last.blocks().len(), last.fresh_block_count()), (2, 1));
    }
}
