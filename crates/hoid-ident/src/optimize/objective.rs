//! Requirements of a search on a model, and what it finds.

use std::ops::Range;

use hoid_model::Complex64;

use super::termination::Termination;
use crate::criterion::Workspace;

/// Sum of squares, `psi' eps` and the projected `psi' psi` (by rows).
#[derive(Debug, Clone, Default)]
pub(crate) struct Linearisation {
    pub sum_of_squares: f64,
    pub descent: Vec<f64>,
    pub gram: Vec<f64>,
}

impl Linearisation {
    /// Nothing summed, over p parameters.
    pub fn empty(p: usize) -> Self {
        Self {
            sum_of_squares: 0.0,
            descent: vec![0.0; p],
            gram: vec![0.0; p * p],
        }
    }

    /// Adds `weight |r|^2` of a complex residual r = H - M, `slopes` the derivatives of M.
    pub fn add_complex(&mut self, weight: f64, residual: Complex64, slopes: &[Complex64]) {
        let p = slopes.len();
        self.sum_of_squares += weight * residual.norm_sqr();
        for i in 0..p {
            self.descent[i] += weight * (slopes[i].conj() * residual).re;
            for j in 0..p {
                self.gram[i * p + j] += weight * (slopes[i].conj() * slopes[j]).re;
            }
        }
    }
}

/// A sum of squares over theta with its derivatives: what the search needs to know of a model. The
/// search takes it as `dyn`: a call is nothing compared with a pass over a record, and it is
/// compiled once for all models.
pub(crate) trait Objective {
    /// True if the predictor exists: finite theta, stable polynomials.
    fn is_feasible(&self, theta: &[f64]) -> bool;
    /// Sum of squares, `psi' eps` and `psi' psi` at a feasible theta; the workspace is room for
    /// signals, kept from one linearisation to the next.
    fn linearise(&self, theta: &[f64], workspace: &mut Workspace) -> Linearisation;
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
