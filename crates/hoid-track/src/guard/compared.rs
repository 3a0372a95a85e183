//! Schedule of the comparison of the estimate with the model of the start: in the first [`COMPARED`] of every
//! [`EVERY`] blocks, which keeps the cost low, and in all blocks for [`SUSPECT_FOR`] after something unusual. The
//! filters of the model start at rest and have [`SETTLING`] blocks to settle.

use hoid_core::{
    delay::DelayLine,
    guard::{
        profile::{Block, CHANNELS},
        reference::ReferenceModel,
    },
    state::{State, visit_all},
};

/// Blocks of a round, and number of them that are compared.
const EVERY: u32 = 44;
const COMPARED: u32 = 11;
const SETTLING: u32 = 3;
/// Number of blocks that are compared after something unusual.
const SUSPECT_FOR: u32 = 30;

/// The model of the start with its delay line.
#[derive(Debug, Clone)]
pub(super) struct Reference {
    model: ReferenceModel,
    delay: DelayLine<Vec<f64>>,
    /// Blocks of the round so far, and number of blocks that are compared in it.
    over: u32,
    compared: u32,
}

impl State for Reference {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(
            &mut [&mut self.model, &mut self.delay, &mut self.over, &mut self.compared],
            each,
        );
    }
}

impl Reference {
    pub fn new(model: ReferenceModel, nk: usize) -> Self {
        Self {
            model,
            delay: DelayLine::new(vec![0.0; nk]),
            over: 0,
            compared: COMPARED,
        }
    }

    /// Starts a round, with all filters at rest.
    pub fn begin(&mut self) {
        self.model.reset();
        (self.over, self.compared) = (0, SUSPECT_FOR);
    }

    /// Reports something unusual: this block does not count, and the next ones are compared.
    pub fn suspect(&mut self) {
        if self.over >= self.compared {
            self.begin();
        } else {
            self.model.skip_block();
            self.compared = self.over.saturating_add(SUSPECT_FOR);
        }
    }

    /// Takes a sample.
    #[inline]
    pub fn take(&mut self, [e, u]: [f64; CHANNELS]) {
        let x = self.delay.step(e);
        if self.over < self.compared {
            self.model.step(x, u);
        }
    }

    /// Ends a block; true if the estimate has diverged.
    pub fn end_block(&mut self, block: &Block, length: u32) -> bool {
        self.over += 1;
        // Blocks with held-back samples carry no information.
        let counts = self.over > SETTLING && self.over <= self.compared && block.innovations == length;
        let astray = if counts {
            self.model.end_block(block.innovation)
        } else {
            self.model.skip_block();
            false
        };
        if self.over >= EVERY.max(self.compared) {
            self.model.reset();
            (self.over, self.compared) = (0, COMPARED);
        }
        astray
    }
}
