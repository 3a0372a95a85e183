//! Search for the lowest minimum from all starts of one fit, and the fit at this minimum.

use hoid_model::{SampleTime, polynomial::reflect_roots_inside};

use crate::{
    Fit, IdentError, Loss, Reason,
    assembled_fit::{Solution, assemble_fit, fixed_or_bounded_flags},
    criterion::{Block, Criterion, Workspace},
    initial_guess::c_drawn_inside::starts_with_reduced_c_roots,
    linalg::information::inverse_information_of_free,
    multistart::{LinearisationClient, MultiStart, Start},
    optimize::{Linearisation, Objective, free_parameters, minimise},
    pem::{constraints::ConstrainedCriterion, fit_settings::FitSettings, lower_minimum::lower_minimum, robust},
};

/// The searches of one fit.
pub(crate) struct FitProblem<'q, 'a> {
    settings: &'q FitSettings,
    constrained: &'q ConstrainedCriterion<'q, 'a>,
    sample_time: SampleTime,
    searches: MultiStart<'q>,
}

impl<'q, 'a> FitProblem<'q, 'a> {
    /// Creates the searches from the given start or, if there is none, from `own_starts`.
    ///
    /// # Errors
    /// [`IdentError::BadStart`] if the given start has the wrong length or no predictor.
    pub fn new(
        settings: &'q FitSettings,
        constrained: &'q ConstrainedCriterion<'q, 'a>,
        sample_time: SampleTime,
        own_starts: impl FnOnce() -> Vec<Start>,
    ) -> Result<Self, IdentError> {
        let starts = match &settings.start {
            Some(theta) => vec![Start::complete("given", checked_start(theta, constrained)?, 0.0)],
            None => own_starts()
                .into_iter()
                .filter_map(|start| stabilise(start, constrained))
                .collect(),
        };
        let (orders, most) = (settings.orders, settings.starts.max(1));
        Ok(Self {
            settings,
            constrained,
            sample_time,
            searches: MultiStart::new(constrained, orders, &settings.search, most, starts),
        })
    }

    /// Returns the fit at the lowest minimum, after all searches have ended.
    ///
    /// # Errors
    /// [`IdentError::NoFiniteLoss`] if no search was successful, [`IdentError::SingularInformation`] if the data do not
    /// determine all parameters.
    pub fn fit(self, workspace: &mut Workspace) -> Result<Fit, IdentError> {
        let Self {
            settings, constrained, ..
        } = self;
        let (mut start, mut minimum) = self.searches.lowest_minimum().ok_or(IdentError::NoFiniteLoss)?;
        if let Some((label, lower)) = lower_minimum(settings, constrained, &minimum, workspace) {
            (start, minimum) = (label, lower);
        }
        if settings.start.is_none() && matches!(minimum.termination.reason, Reason::Border | Reason::NoDescent) {
            // If the search ended on the border of stability, the loss often has a lower minimum inside.
            let inside = starts_with_reduced_c_roots(&settings.orders, &minimum.theta);
            let known = minimum.linearisation.sum_of_squares;
            let others = inside
                .into_iter()
                .filter_map(|theta| minimise(constrained, theta, &settings.search, Some(known), workspace));
            if let Some(lower) = others.min_by(|a, b| {
                a.linearisation
                    .sum_of_squares
                    .total_cmp(&b.linearisation.sum_of_squares)
            }) && lower.linearisation.sum_of_squares < known
            {
                start.push_str(", roots of C moved inside");
                minimum = lower;
            }
        }
        let exact = minimum.termination.reason == Reason::ExactFit;
        if let (Loss::Huber { threshold }, false) = (settings.loss, exact) {
            return robust::fit(
                settings,
                threshold,
                constrained,
                self.sample_time,
                minimum,
                start,
                workspace,
            );
        }
        let free = free_parameters(constrained, &minimum.theta, &minimum.linearisation.descent);
        let solution = Solution {
            sum_of_squares: constrained.sum_without_prior(&minimum.theta, &minimum.linearisation),
            is_fixed_or_bounded: fixed_or_bounded_flags(&free, settings.orders.parameter_count()),
            theta: minimum.theta,
            termination: minimum.termination,
            start,
        };
        let fit = assemble_fit(constrained.criterion, settings.structure, self.sample_time, solution)?;
        if exact {
            return Ok(fit);
        }
        let inverse =
            inverse_information_of_free(&minimum.linearisation.gram, &free, &settings.orders.parameter_names())?;
        let sigma2 = fit.innovation_variance;
        Ok(fit.with_covariance(sigma2, &inverse))
    }
}

/// Returns the start, with a stable A if stability is required; `None` if the roots of A cannot be found.
fn stabilise(mut start: Start, constrained: &ConstrainedCriterion<'_, '_>) -> Option<Start> {
    if constrained.stable {
        let na = constrained.criterion.orders.na;
        let a = reflect_roots_inside(&start.theta[..na])?;
        start.theta[..na].copy_from_slice(&a);
    }
    Some(start)
}

/// Returns the given start, or an error if its length is wrong or it has no predictor.
fn checked_start(theta: &[f64], constrained: &ConstrainedCriterion<'_, '_>) -> Result<Vec<f64>, IdentError> {
    let orders = constrained.criterion.orders;
    let bad = |reason: &str| IdentError::BadStart {
        reason: reason.to_owned(),
    };
    if theta.len() != orders.parameter_count() {
        return Err(bad(&format!(
            "it has {} coefficients, but the orders {} need {}",
            theta.len(),
            orders,
            orders.parameter_count()
        )));
    }
    if !constrained.is_feasible(theta) {
        return Err(bad(
            "C or F (or a polynomial required to be stable) has a root on or outside the unit circle; give a stable \
             start or no start",
        ));
    }
    Ok(theta.to_vec())
}

impl LinearisationClient for FitProblem<'_, '_> {
    fn criterion(&self) -> &Criterion<'_> {
        self.constrained.criterion
    }

    fn evaluation_point(&self) -> Option<&[f64]> {
        self.searches.evaluation_point()
    }

    fn block(&self) -> Option<Block> {
        self.searches.block()
    }

    fn update(&mut self, there: Linearisation, workspace: &mut Workspace) {
        self.searches.update(there, workspace);
    }
}
