//! The batch fits that the estimators of a cell ask for, each made once for all runs of a block.
//!
//! A recursion that starts from a fit of a span and an estimator that makes the same fit share it, and the fits of the runs are searched
//! side by side ([`Estimator::fit_each`]). What comes out does not depend on who shares it.

use std::borrow::Cow;

use hoid_ident::{Estimator, Fit};
use hoid_model::Record;

use crate::{
    plan::{EstimatorCell, Task},
    prepared::Preparation,
};

/// A fit that is asked for: the estimator, and what it is fitted to.
type Question = (Estimator, Preparation);

/// The fits of some runs.
pub(crate) struct BatchFits {
    questions: Vec<Question>,
    /// For each question, the fit of each run.
    fits: Vec<Vec<Result<Fit, String>>>,
}

impl BatchFits {
    /// All fits that these estimators ask for of these runs. Nothing when `go_on` says no: it is asked before each.
    pub fn of(
        estimators: &[(&EstimatorCell, Task)],
        runs: &[&Record],
        go_on: &(dyn Fn() -> bool + Sync),
    ) -> Option<Self> {
        let mut all = Self {
            questions: Vec::new(),
            fits: Vec::new(),
        };
        for (estimator, task) in estimators {
            let Some(question) = runs.first().and_then(|run| question(estimator, task, run)) else {
                continue;
            };
            if all.questions.contains(&question) {
                continue;
            }
            if !go_on() {
                return None;
            }
            all.fits.push(answers(&question, runs));
            all.questions.push(question);
        }
        Some(all)
    }

    /// The fit of a run that an estimator asks for; none where it asks for none.
    pub fn of_run(
        &self,
        estimator: &EstimatorCell,
        task: &Task,
        run: usize,
        record: &Record,
    ) -> Option<&Result<Fit, String>> {
        let question = question(estimator, task, record)?;
        let at = self.questions.iter().position(|known| *known == question)?;
        self.fits[at].get(run)
    }
}

fn question(estimator: &EstimatorCell, task: &Task, record: &Record) -> Option<Question> {
    let preparation = Preparation::of(estimator);
    match task {
        Task::Fit(options) => Some(((**options).clone(), preparation)),
        // The start span is one of the record as it was prepared.
        Task::Track(options) if preparation.is_none() => {
            let span_s = Some(options.start_span(record)?);
            Some((options.start_estimator(), Preparation { span_s, ..preparation }))
        }
        _ => None,
    }
}

fn answers((estimator, preparation): &Question, runs: &[&Record]) -> Vec<Result<Fit, String>> {
    let prepared: Vec<Result<Cow<'_, Record>, String>> = runs.iter().map(|run| preparation.of_record(run)).collect();
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
