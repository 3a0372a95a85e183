//! What a search needs to know of a model, and what it finds.

use std::ops::Range;

use super::termination::Termination;

/// Sum of squares, `psi' eps` and the projected `psi' psi` (by rows).
#[derive(Debug, Clone, Default)]
pub(crate) struct Linearisation {
    pub sum_of_squares: f64,
    pub descent: Vec<f64>,
    pub gram: Vec<f64>,
}

/// A sum of squares over theta with its derivatives: what the search needs to know of a model.
pub(crate) trait Objective {
    /// Room for signals that a linearisation needs, kept from one to the next.
    type Workspace;

    /// True where the predictor exists: finite theta, stable polynomials.
    fn is_feasible(&self, theta: &[f64]) -> bool;
    /// Sum of squares, `psi' eps` and `psi' psi` at a feasible theta.
    fn linearise(&self, theta: &[f64], workspace: &mut Self::Workspace) -> Linearisation;
    /// Sum of squares of the output, against which residuals count as zero.
    fn output_power(&self) -> f64;
    /// Lower and upper bound of each parameter; equal bounds fix it. By default there are none.
    fn limits(&self) -> Option<&[(f64, f64)]> {
        None
    }
    /// Places of the polynomials in theta that must be stable and have no limits of their own.
    fn stable_blocks(&self) -> Vec<Range<usize>> {
        Vec::new()
    }
}

/// Where a search ended.
#[derive(Debug, Clone)]
pub(crate) struct Minimum {
    pub theta: Vec<f64>,
    pub at: Linearisation,
    pub termination: Termination,
}
