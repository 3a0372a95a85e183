//! The search for the lowest minimum from all starts of one fit, one linearisation after the other.
//!
//! It asks for the criterion at one theta and is told, so that the quests of several records can go on side by side
//! ([`crate::side_by_side`]). A start in the basin of a minimum that is known is left out, and a search that comes close to one without
//! a promise to end lower is stopped.

use hoid_model::SampleTime;

use crate::{
    Estimator, Fit, IdentError, Loss, Reason,
    estimator::held,
    information::inverse_of_free,
    objective::Informed,
    prediction_error::{Criterion, Linearisation, Workspace},
    search::{Descent, Minimum, Progress, free_parameters, leads_to, minimise},
    starts,
};

/// All that is under way for one fit.
pub(crate) struct Quest<'q, 'a> {
    estimator: &'q Estimator,
    informed: &'q Informed<'q, 'a>,
    sample_time: SampleTime,
    /// Starts that are left.
    candidates: std::vec::IntoIter<(String, Vec<f64>)>,
    /// The start of the search that is under way, and the search.
    searching: Option<(String, Descent<'q, Informed<'q, 'a>>)>,
    best: Option<(String, Minimum)>,
}

impl<'q, 'a> Quest<'q, 'a> {
    /// Makes the starts and begins at the best of them.
    ///
    /// # Errors
    /// [`IdentError::BadStart`].
    pub fn new(
        estimator: &'q Estimator,
        informed: &'q Informed<'q, 'a>,
        sample_time: SampleTime,
        workspace: &mut Workspace,
    ) -> Result<Self, IdentError> {
        let candidates: Vec<(String, Vec<f64>)> = match &estimator.start {
            Some(theta) => vec![("given".to_owned(), estimator.check_start(theta, informed)?)],
            None => starts::propose(informed.criterion, sample_time, workspace)
                .into_iter()
                .take(estimator.starts.max(1))
                .filter_map(|s| Some((s.label, estimator.stabilised(s.theta)?)))
                .collect(),
        };
        let mut quest = Self {
            estimator,
            informed,
            sample_time,
            candidates: candidates.into_iter(),
            searching: None,
            best: None,
        };
        quest.begin(workspace);
        Ok(quest)
    }

    /// The criterion that is searched.
    pub fn criterion(&self) -> &'q Criterion<'a> {
        self.informed.criterion
    }

    /// Where the criterion and its derivatives are wanted next; nowhere when all searches have ended.
    pub fn asked(&self) -> Option<&[f64]> {
        self.searching.as_ref().map(|(_, descent)| descent.asked())
    }

    /// Takes what was found there.
    pub fn take(&mut self, there: Linearisation, workspace: &mut Workspace) {
        let Some((label, mut descent)) = self.searching.take() else {
            return;
        };
        match descent.take(there) {
            Progress::GoesOn => self.searching = Some((label, descent)),
            Progress::Ended(reason) => {
                if let Some(minimum) = reason.and_then(|reason| descent.finish(reason, workspace))
                    && self.known().is_none_or(|known| minimum.at.sum_of_squares < known)
                {
                    self.best = Some((label, minimum));
                }
                self.begin(workspace);
            }
        }
    }

    /// Begins at the next start that promises something.
    fn begin(&mut self, workspace: &mut Workspace) {
        while let Some((label, theta)) = self.candidates.next() {
            if let Some((_, known)) = &self.best
                && leads_to(known, self.informed, &theta, workspace)
            {
                continue;
            }
            if let Some(descent) = Descent::new(self.informed, theta, &self.estimator.search, self.known()) {
                self.searching = Some((label, descent));
                return;
            }
        }
    }

    /// Sum of squares of the best minimum so far.
    fn known(&self) -> Option<f64> {
        self.best.as_ref().map(|(_, minimum)| minimum.at.sum_of_squares)
    }

    /// The fit at the lowest minimum, once all searches have ended.
    ///
    /// # Errors
    /// [`IdentError::NoFiniteLoss`] where no search came anywhere, [`IdentError::SingularInformation`].
    pub fn fit(self, workspace: &mut Workspace) -> Result<Fit, IdentError> {
        let Self {
            estimator, informed, ..
        } = self;
        let (mut start, mut minimum) = self.best.ok_or(IdentError::NoFiniteLoss)?;
        if estimator.start.is_none() && matches!(minimum.termination.reason, Reason::Border | Reason::NoDescent) {
            // The loss often has a minimum on the border besides a lower one inside.
            let inside = starts::with_c_drawn_inside(&estimator.orders, &minimum.theta);
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
