//! Schedule of the comparison between the estimate and the start model. To keep the cost low, only the first
//! [`COMPARED_BLOCKS`] of every [`BLOCKS_PER_ROUND`] blocks are compared; after an unusual block, all of the next
//! [`BLOCKS_AFTER_UNUSUAL`] blocks are compared. In a round, the first [`SETTLING_BLOCKS`] blocks do not count, because
//! the filters of the start model start at rest.

use hoid_core::{
    delay::DelayLine,
    guard::{
        profile::{Block, CHANNEL_COUNT},
        reference::ReferenceModel,
    },
    state::{State, visit_all},
};

/// Number of blocks in a round, number of blocks at its start that are compared, and number of the first of these, in
/// which the filters settle.
const BLOCKS_PER_ROUND: u32 = 44;
const COMPARED_BLOCKS: u32 = 11;
const SETTLING_BLOCKS: u32 = 3;
/// Number of blocks that are compared after an unusual block.
const BLOCKS_AFTER_UNUSUAL: u32 = 30;

/// The start model with its delay line, and its place in the round.
#[derive(Debug, Clone)]
pub(super) struct ReferenceComparison {
    model: ReferenceModel,
    delay: DelayLine<Vec<f64>>,
    /// Number of blocks of the round so far, and number of blocks that are compared in the round.
    over: u32,
    compared: u32,
}

impl State for ReferenceComparison {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(
            &mut [&mut self.model, &mut self.delay, &mut self.over, &mut self.compared],
            each,
        );
    }
}

impl ReferenceComparison {
    pub fn new(model: ReferenceModel, nk: usize) -> Self {
        Self {
            model,
            delay: DelayLine::new(vec![0.0; nk]),
            over: 0,
            compared: COMPARED_BLOCKS,
        }
    }

    /// Starts a round in which many blocks are compared, with all filters at rest.
    pub fn start(&mut self) {
        self.model.reset();
        (self.over, self.compared) = (0, BLOCKS_AFTER_UNUSUAL);
    }

    /// Marks the current block as unusual: it does not count, and the next blocks are compared.
    pub fn mark_unusual(&mut self) {
        if self.over >= self.compared {
            self.start();
        } else {
            self.model.skip_block();
            self.compared = self.over.saturating_add(BLOCKS_AFTER_UNUSUAL);
        }
    }

    /// Takes a sample.
    #[inline]
    pub fn update(&mut self, [e, u]: [f64; CHANNEL_COUNT]) {
        let x = self.delay.step(e);
        if self.over < self.compared {
            self.model.step(x, u);
        }
    }

    /// Ends a block; returns true if the estimate has diverged.
    pub fn end_block(&mut self, block: &Block, length: u32) -> bool {
        self.over = self.over.saturating_add(1);
        // Blocks with held-back samples carry no information.
        let counts = self.over > SETTLING_BLOCKS && self.over <= self.compared && block.innovations == length;
        let diverged = if counts {
            self.model.end_block(block.innovation)
        } else {
            self.model.skip_block();
            false
        };
        if self.over >= BLOCKS_PER_ROUND.max(self.compared) {
            self.model.reset();
            (self.over, self.compared) = (0, COMPARED_BLOCKS);
        }
        diverged
    }
}
