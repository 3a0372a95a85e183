//! Result of the prediction error fit of one form.

use super::{clusters::Clusters, layout::FamilyLayout};
use crate::{
    criterion::Workspace, grey_box::objective::PhysicalCriterion, linalg::least_squares::solve_symmetric,
    optimize::Minimum,
};

/// Prediction error fit of one form.
#[derive(Debug, Clone)]
pub(super) struct PredictionFit<'a> {
    pub criterion: PhysicalCriterion<'a, FamilyLayout>,
    pub minimum: Minimum,
    /// Loss `sum eps^2/n`, without the prior.
    pub loss: f64,
    /// Unbiased innovation variance.
    pub innovation_variance: f64,
    pub residuals: usize,
    pub states: usize,
    pub clusters: Clusters,
    /// Inflation kappa of the variances.
    pub inflation: f64,
    /// Relative increase in the diagonal of `G + P`: zero, or [`UNDETERMINED_RIDGE`] if a combination of parameters is
    /// undetermined. This combination then has a very large error; quantities that do not depend on it are unaffected.
    pub ridge: f64,
    /// Weight w of the lines ([`super::joint`]); zero if the criterion does not include lines.
    pub weight_of_lines: f64,
}

/// Ridge that makes `G + P` regular. A combination whose error would be more than 3e4 times the error of a single
/// parameter counts as undetermined.
pub(super) const UNDETERMINED_RIDGE: f64 = 1e-9;

impl PredictionFit<'_> {
    pub fn layout(&self) -> &FamilyLayout {
        &self.criterion.layout
    }

    pub fn eta(&self) -> &[f64] {
        &self.minimum.theta
    }

    /// Returns the minimum of the criterion: the sum of squares plus the prior and, if they are included, the lines.
    pub fn objective(&self) -> f64 {
        self.minimum.linearisation.sum_of_squares
    }

    /// Returns the residuals of one record.
    pub fn residuals_of(&self, record: usize, workspace: &mut Workspace) -> Option<Vec<f64>> {
        let mapped = self.criterion.model_of(self.eta(), record).ok()?;
        Some(
            self.criterion
                .record_criterion(&mapped, record)
                .residuals_of(&mapped.theta, 0, workspace),
        )
    }

    /// Returns the number of elements of eta.
    pub fn parameter_count(&self) -> usize {
        self.minimum.theta.len()
    }

    /// Solves `(G + P - less) x = rhs` for the elements in `free`; all other elements of x are zero. `None` if the
    /// matrix is singular.
    pub fn solve(&self, free: &[usize], less: Option<&[f64]>, rhs: &[f64]) -> Option<Vec<f64>> {
        let p = self.parameter_count();
        let gram = |i: usize, j: usize| {
            let own = self.minimum.linearisation.gram[i * p + j];
            let held = if i == j { self.ridge * own } else { 0.0 };
            own + held - less.map_or(0.0, |l| l[i * p + j])
        };
        let part: Vec<f64> = free
            .iter()
            .flat_map(|&i| free.iter().map(move |&j| (i, j)))
            .map(|(i, j)| gram(i, j))
            .collect();
        let right: Vec<f64> = free.iter().map(|&i| rhs[i]).collect();
        let solution = solve_symmetric(&part, &right)?;
        let mut whole = vec![0.0; p];
        free.iter().zip(solution).for_each(|(&i, v)| whole[i] = v);
        Some(whole)
    }

    /// Returns the indices in eta of the elements that are not at a bound.
    pub fn free_elements(&self) -> Vec<usize> {
        let limits = &self.criterion.limits;
        let eta = self.eta();
        (0..eta.len())
            .filter(|&i| limits[i].0 < eta[i] && eta[i] < limits[i].1)
            .collect()
    }

    /// Returns the indices in eta of the elements that are not fixed, including those at a bound. Their uncertainty
    /// contributes to the uncertainty of other elements, since the true value need not be at the bound.
    pub fn unfixed_elements(&self) -> Vec<usize> {
        let limits = &self.criterion.limits;
        (0..limits.len()).filter(|&i| limits[i].0 < limits[i].1).collect()
    }
}
