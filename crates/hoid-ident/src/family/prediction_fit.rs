//! Result of the prediction error search of one form.

use super::{clusters::Clusters, layout::FamilyLayout};
use crate::{
    criterion::Workspace, grey_box::objective::PhysicalCriterion, linalg::least_squares::solve_symmetric,
    optimize::Minimum,
};

/// A fit of one form.
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
    /// kappa.
    pub inflation: f64,
    /// Relative part of the diagonal of `G + P` that is added to it: zero, or [`OPEN`] if a combination of parameters
    /// is undetermined. This combination then has a very large error, and quantities that do not depend on it are not
    /// affected.
    pub ridge: f64,
    /// The weight w of [`super::joint`]; zero if the lines are not a part of the criterion.
    pub weight_of_lines: f64,
}

/// The ridge that makes `G + P` regular: errors of 3e4 times those of a single parameter count as undetermined.
pub(super) const OPEN: f64 = 1e-9;

impl PredictionFit<'_> {
    pub fn layout(&self) -> &FamilyLayout {
        &self.criterion.layout
    }

    pub fn eta(&self) -> &[f64] {
        &self.minimum.theta
    }

    /// Minimum of the objective: the sum of squares with the prior.
    pub fn objective(&self) -> f64 {
        self.minimum.at.sum_of_squares
    }

    /// Residuals of one record.
    pub fn residuals_of(&self, record: usize, workspace: &mut Workspace) -> Option<Vec<f64>> {
        let mapped = self.criterion.model_of(self.eta(), record).ok()?;
        Some(
            self.criterion
                .of_record(&mapped, record)
                .residuals_of(&mapped.theta, 0, workspace),
        )
    }

    /// Number of free parameters.
    pub fn parameters(&self) -> usize {
        self.minimum.theta.len()
    }

    /// Solves with `G + P`, reduced by `less`, for a right-hand side over these elements; zero for the others.
    pub fn solve(&self, free: &[usize], less: Option<&[f64]>, rhs: &[f64]) -> Option<Vec<f64>> {
        let p = self.parameters();
        let gram = |i: usize, j: usize| {
            let own = self.minimum.at.gram[i * p + j];
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

    /// Elements of eta that are not at their bounds.
    pub fn free(&self) -> Vec<usize> {
        let limits = &self.criterion.limits;
        let eta = self.eta();
        (0..eta.len())
            .filter(|&i| limits[i].0 < eta[i] && eta[i] < limits[i].1)
            .collect()
    }

    /// Elements of eta that were free in the search, including those at a bound: their uncertainty contributes to that
    /// of others, as the true value need not be at the bound.
    pub fn sought(&self) -> Vec<usize> {
        let limits = &self.criterion.limits;
        (0..limits.len()).filter(|&i| limits[i].0 < limits[i].1).collect()
    }
}
