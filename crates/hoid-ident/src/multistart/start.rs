//! A start of a search, with polynomials that may still be unknown.

use hoid_model::Orders;

use crate::{
    criterion::Block,
    linalg::{
        least_squares::solve_symmetric,
        vectors::{add_scaled, dot},
    },
    optimize::Linearisation,
};

/// A start of a search, with its label.
#[derive(Debug, Clone)]
pub(crate) struct Start {
    pub label: String,
    pub theta: Vec<f64>,
    /// Sum of squares of the start; not finite before the start is complete, or if the regression for B was singular.
    pub value: f64,
    /// Polynomials that are still unknown; the last element is computed next.
    unknown_blocks: Vec<Block>,
}

impl Start {
    /// Creates a complete start.
    pub fn complete(label: &str, theta: Vec<f64>, value: f64) -> Self {
        Self {
            label: label.to_owned(),
            theta,
            value,
            unknown_blocks: Vec::new(),
        }
    }

    /// Creates a start from F, for a model without A and C. The unknowns are B with white noise, D from the residual,
    /// and B again with this noise model.
    pub fn from_poles(label: &str, o: &Orders, f: &[f64]) -> Self {
        let left = if o.nd > 0 {
            vec![Block::B, Block::D, Block::B]
        } else {
            vec![Block::B]
        };
        Self::with_unknown(label, [&vec![0.0; o.nb + o.nd], f].concat(), left)
    }

    /// Creates a start with some unknown polynomials `left`; the last of these is computed next.
    pub fn with_unknown(label: &str, theta: Vec<f64>, left: Vec<Block>) -> Self {
        Self {
            label: label.to_owned(),
            theta,
            value: f64::NAN,
            unknown_blocks: left,
        }
    }

    /// Marks D, and then B with this noise model, as unknown; no effect on a model without D.
    pub fn with_unknown_noise(mut self, o: &Orders) -> Self {
        if o.nd > 0 {
            self.unknown_blocks = vec![Block::B, Block::D];
        }
        self
    }

    /// Returns the next unknown polynomial; `None` if the start is complete.
    pub fn next_block(&self) -> Option<Block> {
        self.unknown_blocks.last().copied()
    }

    /// Updates the next unknown polynomial from the linearisation at theta. The residual is affine in B and in D, so
    /// one least-squares step computes either polynomial while the others are fixed.
    pub fn update(&mut self, o: &Orders, there: &Linearisation) {
        let Some(block) = self.unknown_blocks.pop() else { return };
        let (p, index) = (self.theta.len(), block.range(o));
        let rows = index.clone().map(|i| &there.gram[i * p..(i + 1) * p]);
        let gram: Vec<f64> = rows.flat_map(|row| &row[index.clone()]).copied().collect();
        let descent = &there.descent[index.clone()];
        if let Some(step) = solve_symmetric(&gram, descent) {
            self.value = there.sum_of_squares - dot(&step, descent);
            add_scaled(&mut self.theta[index], 1.0, &step);
        } else if block == Block::B {
            (self.value, self.unknown_blocks) = (f64::NAN, Vec::new());
        }
    }
}
