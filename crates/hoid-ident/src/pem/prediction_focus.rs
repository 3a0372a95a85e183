//! Fits for prediction: in one step if the residual is linear in theta, otherwise by searches.

use hoid_model::Record;

use crate::{
    Fit, IdentError, criterion::Workspace, initial_guess::guesses::initial_guesses, multistart::LinearisationClient,
    optimize::Objective, pem::arx, pem::fit_problem::FitProblem, pem::fit_settings::FitSettings,
};

/// Fits one model to all records. In each record, residuals start at sample `first` or later.
///
/// # Errors
/// [`IdentError`] if no model can be fitted.
pub(crate) fn fit(settings: &FitSettings, records: &[Record], first: usize) -> Result<Fit, IdentError> {
    let (criterion, sample_time) = settings.criterion(records, first)?;
    if settings.is_linear() {
        return arx::fit(settings.structure, &criterion, sample_time);
    }
    let mut workspace = Workspace::borrow_from_thread();
    let constrained = settings.constrained_criterion(&criterion);
    let own_starts = || initial_guesses(&criterion, sample_time, &mut workspace);
    let mut problem = FitProblem::new(settings, &constrained, sample_time, own_starts)?;
    while let Some(theta) = problem.evaluation_point() {
        let there = match problem.block() {
            Some(block) => criterion.linearise_block(theta, block, &mut workspace),
            None => constrained.linearise(theta, &mut workspace),
        };
        problem.update(there, &mut workspace);
    }
    problem.fit(&mut workspace)
}
