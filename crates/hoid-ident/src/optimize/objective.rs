//! Interface between a search and a model, and the result of a search.

use std::ops::Range;

use hoid_model::Complex64;

use super::termination::Termination;
use crate::{criterion::Workspace, linalg::least_squares::solve_symmetric};

/// Sum of squares, `psi' eps` and `psi' psi` (by rows) of a criterion at one value of theta, with the initial states
/// projected out.
#[derive(Debug, Clone, Default)]
pub(crate) struct Linearisation {
    pub sum_of_squares: f64,
    pub descent: Vec<f64>,
    pub gram: Vec<f64>,
}

impl Linearisation {
    /// Creates a linearisation with zero sums for p parameters.
    pub fn empty(p: usize) -> Self {
        Self {
            sum_of_squares: 0.0,
            descent: vec![0.0; p],
            gram: vec![0.0; p * p],
        }
    }

    /// Adds `weight |r|^2` for a complex residual r = H - M; `slopes` are the derivatives of M.
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

    /// Increases the diagonal of `psi' psi` by the fraction `ridge` and returns the solution of the normal equations;
    /// `None` if they are singular.
    pub fn solution(&mut self, ridge: f64) -> Option<Vec<f64>> {
        let p = self.descent.len();
        (0..p).for_each(|i| self.gram[i * p + i] *= 1.0 + ridge);
        solve_symmetric(&self.gram, &self.descent)
    }

    /// Returns `variance (psi' psi)^-1` by rows; `None` if the matrix is singular.
    pub fn covariance(&self, variance: f64) -> Option<Vec<f64>> {
        let p = self.descent.len();
        let mut all = Vec::with_capacity(p * p);
        for i in 0..p {
            let mut unit = vec![0.0; p];
            unit[i] = variance;
            all.extend(solve_symmetric(&self.gram, &unit)?);
        }
        Some(all)
    }
}

/// A sum of squares as a function of theta, with its derivatives: the interface between a search and a model. The
/// search uses it as `dyn`, so it is compiled once for all models; the cost of a call is negligible compared with a
/// pass over a record.
pub(crate) trait Objective {
    /// True if the predictor exists, i.e. if theta is finite and the polynomials are stable.
    fn is_feasible(&self, theta: &[f64]) -> bool;
    /// Returns the sum of squares, `psi' eps` and `psi' psi` at a feasible theta. The workspace is memory for signals
    /// that the next linearisation uses again.
    fn linearise(&self, theta: &[f64], workspace: &mut Workspace) -> Linearisation;
    /// Returns the sum of squares of the output, relative to which small residuals count as zero.
    fn output_power(&self) -> f64;
    /// Returns the lower and the upper bound of each parameter; equal bounds fix a parameter. By default there are no
    /// bounds.
    fn limits(&self) -> Option<&[(f64, f64)]> {
        None
    }
    /// Returns the index ranges in theta that contain polynomials which must be stable and are not restricted by
    /// limits.
    fn stable_blocks(&self) -> Vec<Range<usize>> {
        Vec::new()
    }
}

/// Result of a search.
#[derive(Debug, Clone)]
pub(crate) struct Minimum {
    pub theta: Vec<f64>,
    pub linearisation: Linearisation,
    pub termination: Termination,
}
