//! Many starts of one criterion, of which polynomials are still to be found by least squares.

use super::{LinearisationClient, Start};
use crate::{
    criterion::{Block, Criterion, Workspace},
    optimize::{Linearisation, Objective},
};

/// The starts, completed one after the other. One that leaves the region of stability is left as it
/// is.
pub(crate) struct Completion<'c> {
    criterion: &'c Criterion<'c>,
    pub starts: Vec<Start>,
    /// The start that is being completed.
    at: usize,
}

impl<'c> Completion<'c> {
    /// Of these starts.
    pub fn new(criterion: &'c Criterion<'c>, starts: Vec<Start>) -> Self {
        let mut completion = Self {
            criterion,
            starts,
            at: 0,
        };
        completion.skip();
        completion
    }

    /// To the next start of which something can be found.
    fn skip(&mut self) {
        let open = |start: &Start| start.next_block().is_some() && self.criterion.is_feasible(&start.theta);
        while self.starts.get(self.at).is_some_and(|start| !open(start)) {
            self.at += 1;
        }
    }

    /// Completes all, alone.
    pub fn run(&mut self, workspace: &mut Workspace) {
        while let (Some(theta), Some(block)) = (self.evaluation_point(), self.block()) {
            let there = self.criterion.linearise_block(theta, block, workspace);
            self.update(there, workspace);
        }
    }
}

impl LinearisationClient for Completion<'_> {
    fn criterion(&self) -> &Criterion<'_> {
        self.criterion
    }

    fn evaluation_point(&self) -> Option<&[f64]> {
        self.starts.get(self.at).map(|start| start.theta.as_slice())
    }

    fn block(&self) -> Option<Block> {
        self.starts.get(self.at).and_then(Start::next_block)
    }

    fn update(&mut self, there: Linearisation, _workspace: &mut Workspace) {
        if let Some(start) = self.starts.get_mut(self.at) {
            start.update(&self.criterion.orders, &there);
            self.skip();
        }
    }
}
