//! The prediction error criterion with constraints and priors.
//!
//! The criterion is `N V(theta) = sum eps^2 + N sum_i w_i (theta_i - theta*_i)^2` (the regularised criterion of L.
//! Ljung, *System Identification*, 1999, eq. 7.107), with bounds on each parameter. Optionally, only models that are
//! stable from e to u are admitted.

use std::ops::Range;

use hoid_core::stability::roots_inside;

use crate::{
    constraint::Prior,
    criterion::{Criterion, Workspace},
    optimize::Linearisation,
    optimize::Objective,
};

/// The prediction error criterion with its limits and its prior.
pub(crate) struct ConstrainedCriterion<'c, 'a> {
    pub criterion: &'c Criterion<'a>,
    /// Lower and upper bound of each parameter.
    pub limits: Option<Vec<(f64, f64)>>,
    /// Prior guess for each parameter that has one, with its weight in the sum of squares.
    pub prior: Vec<(usize, Prior)>,
    /// True if the roots of A must also be inside the unit circle.
    pub stable: bool,
}

impl ConstrainedCriterion<'_, '_> {
    /// Returns the sum of squared residuals without the prior.
    pub fn sum_without_prior(&self, theta: &[f64], at: &Linearisation) -> f64 {
        at.sum_of_squares - self.penalty(theta)
    }

    fn penalty(&self, theta: &[f64]) -> f64 {
        let off = |(i, prior): &(usize, Prior)| prior.weight * (theta[*i] - prior.value).powi(2);
        self.prior.iter().map(off).sum()
    }
}

impl Objective for ConstrainedCriterion<'_, '_> {
    fn is_feasible(&self, theta: &[f64]) -> bool {
        self.criterion.is_feasible(theta) && (!self.stable || roots_inside(&theta[..self.criterion.orders.na], 1.0))
    }

    fn linearise(&self, theta: &[f64], workspace: &mut Workspace) -> Linearisation {
        let mut at = self.criterion.linearise(theta, workspace);
        at.sum_of_squares += self.penalty(theta);
        let p = theta.len();
        for (i, prior) in &self.prior {
            at.descent[*i] += prior.weight * (prior.value - theta[*i]);
            at.gram[i * p + i] += prior.weight;
        }
        at
    }

    fn output_power(&self) -> f64 {
        self.criterion.output_power()
    }

    fn stable_blocks(&self) -> Vec<Range<usize>> {
        let mut blocks = self.criterion.stable_blocks();
        let of_a = 0..self.criterion.orders.na;
        if self.stable && !of_a.is_empty() && !blocks.contains(&of_a) {
            blocks.push(of_a);
        }
        if let Some(limits) = &self.limits {
            let unlimited = |i: usize| limits[i] == (f64::NEG_INFINITY, f64::INFINITY);
            blocks.retain(|block| block.clone().all(unlimited));
        }
        blocks
    }

    fn limits(&self) -> Option<&[(f64, f64)]> {
        self.limits.as_deref()
    }
}
