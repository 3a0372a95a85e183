//! The search for the lowest minimum from all starts of one fit, and the fit there.

use hoid_model::SampleTime;

use crate::{
    Estimator, Fit, IdentError, Loss, Reason,
    estimator::held,
    initial_guess::{c_drawn_inside::with_c_drawn_inside, start::Start},
    linalg::information::inverse_of_free,
    optimize::Linearisation,
    optimize::multistart::MultiStart,
    optimize::{free_parameters, minimise},
    pem::constraints::ConstrainedCriterion,
    pem::criterion::{Block, Criterion, Workspace},
    pem::linearisation_client::LinearisationClient,
};

/// All that is under way for one fit.
pub(crate) struct FitProblem<'q, 'a> {
    estimator: &'q Estimator,
    informed: &'q ConstrainedCriterion<'q, 'a>,
    sample_time: SampleTime,
    searches: MultiStart<'q, ConstrainedCriterion<'q, 'a>>,
}

impl<'q, 'a> FitProblem<'q, 'a> {
    /// From the start that the estimator was given, or from those that `own` makes.
    ///
    /// # Errors
    /// [`IdentError::BadStart`].
    pub fn new(
        estimator: &'q Estimator,
        informed: &'q ConstrainedCriterion<'q, 'a>,
        sample_time: SampleTime,
        own: impl FnOnce() -> Vec<Start>,
    ) -> Result<Self, IdentError> {
        let starts = match &estimator.start {
            Some(theta) => vec![Start::complete("given", estimator.check_start(theta, informed)?, 0.0)],
            None => own()
                .into_iter()
                .filter_map(|start| estimator.stabilised(start))
                .collect(),
        };
        let (orders, most) = (estimator.orders, estimator.starts.max(1));
        Ok(Self {
            estimator,
            informed,
            sample_time,
            searches: MultiStart::new(informed, orders, &estimator.search, most, starts),
        })
    }

    /// The fit at the lowest minimum, once all searches have ended.
    ///
    /// # Errors
    /// [`IdentError::NoFiniteLoss`] where no search came anywhere, [`IdentError::SingularInformation`].
    pub fn fit(self, workspace: &mut Workspace) -> Result<Fit, IdentError> {
        let Self {
            estimator, informed, ..
        } = self;
        let (mut start, mut minimum) = self.searches.lowest().ok_or(IdentError::NoFiniteLoss)?;
        if estimator.start.is_none() && matches!(minimum.termination.reason, Reason::Border | Reason::NoDescent) {
            // The loss often has a minimum on the border besides a lower one inside.
            let inside = with_c_drawn_inside(&estimator.orders, &minimum.theta);
            let known = minimum.at.sum_of_squares;
            let others = inside
                .into_iter()
                .filter_map(|theta| minimise(informed, theta, &estimator.search, Some(known), workspace));
            if let Some(lower) = others.min_by(|a, b| a.at.sum_of_squares.total_cmp(&b.at.sum_of_squares))
                && lower.at.sum_of_squares < known
            {
                start.push_str(", C drawn inside");
                minimum = lower;
            }
        }
        let exact = minimum.termination.reason == Reason::ExactFit;
        if let (Loss::Huber { threshold }, false) = (estimator.loss, exact) {
            let fit = estimator.fit_robustly(informed, self.sample_time, minimum, threshold, workspace)?;
            return Ok(Fit { start, ..fit });
        }
        let sum_of_squares = informed.without_prior(&minimum.theta, &minimum.at);
        let free = free_parameters(informed, &minimum.theta, &minimum.at.descent);
        let p = estimator.orders.parameters();
        let fit = estimator.result(
            informed.criterion,
            self.sample_time,
            minimum.theta,
            sum_of_squares,
            minimum.termination,
            held(&free, p),
        )?;
        let fit = Fit { start, ..fit };
        if exact {
            return Ok(fit);
        }
        let inverse = inverse_of_free(&minimum.at.gram, &free, &estimator.orders.parameter_names())?;
        let sigma2 = fit.innovation_variance;
        Ok(Fit {
            covariance: Some(inverse.iter().map(|g| sigma2 * g).collect()),
            ..fit
        })
    }
}

impl LinearisationClient for FitProblem<'_, '_> {
    fn criterion(&self) -> &Criterion<'_> {
        self.informed.criterion
    }

    fn asked(&self) -> Option<&[f64]> {
        self.searches.asked()
    }

    fn block(&self) -> Option<Block> {
        self.searches.block()
    }

    fn take(&mut self, there: Linearisation, workspace: &mut Workspace) {
        self.searches.take(there, workspace);
    }
}
