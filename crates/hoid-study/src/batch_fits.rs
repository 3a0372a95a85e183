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
    /// For each estimator, the number of its question.
    asked: Vec<Option<usize>>,
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
        let mut questions: Vec<Question> = Vec::new();
        let (mut asked, mut fits) = (Vec::with_capacity(estimators.len()), Vec::new());
        for (estimator, task) in estimators {
            let Some(question) = runs.first().and_then(|run| question(estimator, task, run)) else {
                asked.push(None);
                continue;
            };
            let known = questions.iter().position(|known| *known == question);
            asked.push(Some(known.unwrap_or(questions.len())));
            if known.is_some() {
                continue;
            }
            if !go_on() {
                return None;
            }
            fits.push(answers(&question, runs));
            questions.push(question);
        }
        Some(Self { asked, fits })
    }

    /// The fit of a run that an estimator (by its place) asks for; none where it asks for none.
    pub fn of_run(&self, estimator: usize, run: usize) -> Option<&Result<Fit, String>> {
        let question = (*self.asked.get(estimator)?)?;
        self.fits.get(question)?.get(run)
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
