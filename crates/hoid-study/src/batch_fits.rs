//! The batch fits that the estimators of a cell need; each is computed once for a batch of runs.
//!
//! If a recursion starts from the fit of a span and an estimator makes the same fit, they share this fit. The fits of
//! one estimator to the single runs of a batch are searched in one call ([`Estimator::fit_each`]). Neither measure
//! affects the results.

use std::borrow::Cow;

use hoid_ident::{Estimator, Fit};
use hoid_model::Record;

use crate::{
    plan::{EstimatorCell, Task},
    prepared_record::Preparation,
};

/// A requested fit: the estimator and the preparation of the record.
type FitRequest = (Estimator, Preparation);

/// Batch fits of some runs of a block.
pub(crate) struct BatchFits {
    /// For each estimator, the index of the fit that it requests; `None` if it requests none.
    requested: Vec<Option<usize>>,
    /// For each requested fit, its result for each run.
    fits: Vec<Vec<Result<Fit, String>>>,
}

impl BatchFits {
    /// Computes all fits that these estimators need for these runs. Returns `None` if `should_continue` returns false
    /// before one of the fits.
    pub fn of(
        estimators: &[(&EstimatorCell, Task)],
        runs: &[&Record],
        should_continue: &(dyn Fn() -> bool + Sync),
    ) -> Option<Self> {
        let mut requests: Vec<FitRequest> = Vec::new();
        let (mut requested, mut fits) = (Vec::with_capacity(estimators.len()), Vec::new());
        for (estimator, task) in estimators {
            let Some(request) = runs.first().and_then(|run| fit_request(estimator, task, run)) else {
                requested.push(None);
                continue;
            };
            let known = requests.iter().position(|known| *known == request);
            requested.push(Some(known.unwrap_or(requests.len())));
            if known.is_some() {
                continue;
            }
            if !should_continue() {
                return None;
            }
            fits.push(fit_all(&request, runs));
            requests.push(request);
        }
        Some(Self { requested, fits })
    }

    /// Returns the fit of a run that an estimator uses, both given by index; `None` if the estimator uses no fit.
    pub fn fit_of(&self, estimator: usize, run: usize) -> Option<&Result<Fit, String>> {
        let request = (*self.requested.get(estimator)?)?;
        self.fits.get(request)?.get(run)
    }
}

fn fit_request(estimator: &EstimatorCell, task: &Task, record: &Record) -> Option<FitRequest> {
    let preparation = Preparation::of(estimator);
    match task {
        Task::Fit(options) => Some(((**options).clone(), preparation)),
        // The start span refers to the prepared record, so the fit is shared only if the record is not prepared.
        Task::Track(options) if preparation.is_none() => {
            let span_s = Some(options.start_span(record)?);
            Some((options.start_estimator(), Preparation { span_s, ..preparation }))
        }
        _ => None,
    }
}

fn fit_all((estimator, preparation): &FitRequest, runs: &[&Record]) -> Vec<Result<Fit, String>> {
    let prepared: Vec<Result<Cow<'_, Record>, String>> = runs.iter().map(|run| preparation.apply(run)).collect();
    let records: Vec<&Record> = prepared.iter().flatten().map(Cow::as_ref).collect();
    let mut fits = estimator.fit_each(&records).into_iter();
    prepared
        .iter()
        .map(|record| {
            record.as_ref().map_err(Clone::clone)?;
            fits.next().ok_or("no fit")?.map_err(|error| error.to_string())
        })
        .collect()
}
