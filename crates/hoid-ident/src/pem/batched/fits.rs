//! The fit of each record, with its search in a lane.

use hoid_lanes::InstructionSet;
use hoid_model::{Record, SampleTime, Structure};

use super::lanes::search;
use crate::{
    Fit, IdentError, InitialState,
    criterion::{Criterion, Workspace},
    initial_guess::continuation::{AveragedRecords, Continuation, SlowPoles},
    initial_guess::guesses::initial_guesses_with_poles,
    pem::constraints::ConstrainedCriterion,
    pem::fit_problem::FitProblem,
    pem::fit_settings::FitSettings,
};

/// Fits each record in a lane; `None` if the fits cannot run in lanes. Lanes require Box-Jenkins models without C,
/// estimated initial states, no constraints, priors or robust loss, records of equal length, and a processor with
/// suitable registers.
pub(crate) fn fit_each(
    settings: &FitSettings,
    records: &[&Record],
    path: InstructionSet,
) -> Option<Vec<Result<Fit, IdentError>>> {
    let o = &settings.orders;
    let plain = settings.structure == Structure::BoxJenkins
        && (o.nb > 0 && o.nc == 0 && o.nf > 0)
        && settings.initial_state == InitialState::Estimate
        && settings.is_unconstrained()
        && !settings.level;
    let n = records.first()?.len();
    if !plain || records.iter().any(|record| record.len() != n) {
        return None;
    }
    path.lane_count()?;
    let mut workspace = Workspace::borrow_from_thread();
    let criteria: Vec<_> = (records.iter())
        .map(|record| settings.criterion(std::slice::from_ref(*record), 0))
        .collect();
    let constrained: Vec<_> = (criteria.iter())
        .map(|found| {
            found
                .as_ref()
                .map(|(criterion, ts)| (settings.constrained_criterion(criterion), *ts))
        })
        .collect();
    let mut slow = if settings.start.is_none() {
        poles_of_averages(&constrained, path, &mut workspace)
    } else {
        Vec::new()
    }
    .into_iter();
    let mut problems: Vec<Result<FitProblem<'_, '_>, IdentError>> = (constrained.iter())
        .map(|found| {
            let slow = slow.next().unwrap_or_default();
            let (constrained, sample_time) = found.as_ref().map_err(|error| (*error).clone())?;
            let own_starts = || initial_guesses_with_poles(slow, constrained.criterion, *sample_time, &mut workspace);
            FitProblem::new(settings, constrained, *sample_time, own_starts)
        })
        .collect();
    search(problems.iter_mut().flatten().collect(), path, &mut workspace);
    Some(
        problems
            .into_iter()
            .map(|problem| problem?.fit(&mut workspace))
            .collect(),
    )
}

/// Returns, for each record, the poles estimated from its averaged samples.
fn poles_of_averages(
    constrained: &[Result<(ConstrainedCriterion<'_, '_>, SampleTime), &IdentError>],
    path: InstructionSet,
    workspace: &mut Workspace,
) -> Vec<SlowPoles> {
    let averaged: Vec<Option<AveragedRecords>> = (constrained.iter())
        .map(|found| {
            (found.as_ref().ok()).and_then(|(constrained, ts)| AveragedRecords::of(constrained.criterion, *ts))
        })
        .collect();
    let low: Vec<Option<Criterion<'_>>> = (averaged.iter())
        .map(|averaged| averaged.as_ref().map(AveragedRecords::criterion))
        .collect();
    let mut all: Vec<Option<Continuation<'_>>> = (averaged.iter().zip(&low))
        .map(|(averaged, low)| Some(Continuation::new(averaged.as_ref()?, low.as_ref()?)))
        .collect();
    search(all.iter_mut().flatten().collect(), path, workspace);
    (all.into_iter())
        .map(|continuation| continuation.map(Continuation::into_slow_poles).unwrap_or_default())
        .collect()
}
