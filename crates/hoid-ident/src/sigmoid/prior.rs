//! Prior knowledge about the person in the criterion of a change.
//!
//! A prior of a positive parameter x, `ln x ~ N(m, s^2)`, is added to the squared residuals as
//! `sigma^2 (ln x - m)^2/s^2` ([`crate::family::OperatorPrior`]); the prior of T_L applies before and after the change.
//! sigma^2 is the innovation variance of the fit; the fit and sigma^2 are computed alternately.

use super::{
    layout::{Layout, ThetaElement},
    objective::ChangeCriterion,
    reweighting::reweight,
    search::search,
};
use crate::{
    IdentError, NoiseLevel, SearchOptions,
    family::OperatorPrior,
    grey_box::objective::Penalty,
    optimize::{Minimum, Objective},
};

/// Largest number of rounds in which sigma^2 of the prior is updated.
const MAX_ROUNDS: usize = 3;
/// Relative change in sigma^2 below which no further round is necessary.
const CONVERGENCE_TOLERANCE: f64 = 0.05;

/// Returns the penalties of all elements of theta that have a prior, for the innovation variance 1.
pub(super) fn penalties(layout: &Layout, prior: &OperatorPrior) -> Vec<Penalty> {
    let all = layout.coordinates();
    let elements = layout.elements();
    let places = |penalty: Penalty| {
        let coordinate = all[penalty.index];
        let is_own = move |element: &ThetaElement| match element {
            ThetaElement::Varying(own, _) | ThetaElement::Constant(own) => *own == coordinate,
            _ => false,
        };
        // theta contains omega_nm and zeta_nm, whereas the family uses their logarithms.
        let own = elements.iter().enumerate().filter(move |(_, e)| is_own(e));
        own.map(move |(place, _)| Penalty {
            index: place,
            logarithmic: true,
            ..penalty
        })
        .collect::<Vec<_>>()
    };
    let unit = prior.penalties(layout.form, layout.neuromuscular);
    unit.into_iter().flat_map(places).collect()
}

/// Returns the penalties for this innovation variance.
pub(super) fn scaled_penalties(unit: &[Penalty], variance: f64) -> Vec<Penalty> {
    unit.iter().map(|p| p.weighted(variance)).collect()
}

/// Returns the innovation variance at a minimum.
pub(super) fn innovation_variance(criterion: &ChangeCriterion<'_>, minimum: &Minimum) -> f64 {
    let not_fixed = criterion.limits.iter().filter(|(low, high)| low < high).count();
    let squares = minimum.linearisation.sum_of_squares - criterion.penalty_at(&minimum.theta);
    squares / (criterion.residual_count() - not_fixed - criterion.state_count()) as f64
}

/// Returns the minimum and its noise levels, with the prior scaled by the innovation variance at this minimum.
///
/// # Errors
/// [`IdentError::NoFiniteLoss`] if a search fails.
pub(super) fn minimum_with_scaled_prior(
    criterion: &mut ChangeCriterion<'_>,
    unit: &[Penalty],
    found: Minimum,
    noise_level: NoiseLevel,
    options: &SearchOptions,
) -> Result<(Minimum, Option<[f64; 2]>), IdentError> {
    let levelled = |criterion: &mut ChangeCriterion<'_>, minimum| match noise_level {
        NoiseLevel::Constant => Ok((minimum, None)),
        NoiseLevel::Changing => reweight(criterion, minimum, options),
    };
    let (mut minimum, mut levels) = levelled(criterion, found)?;
    for _ in 1..MAX_ROUNDS {
        let Some(now) = criterion.penalty.first() else { break };
        let variance = innovation_variance(criterion, &minimum);
        if (variance / now.variance - 1.0).abs() < CONVERGENCE_TOLERANCE || variance <= 0.0 {
            break;
        }
        criterion.penalty = scaled_penalties(unit, variance);
        let next = search(criterion, minimum.theta.clone(), options, None).ok_or(IdentError::NoFiniteLoss)?;
        let before = minimum.termination.iterations;
        (minimum, levels) = levelled(criterion, next)?;
        minimum.termination.iterations += before;
    }
    Ok((minimum, levels))
}

/// Returns the prior scaled with the innovation variance at a start.
pub(super) fn penalties_at_start(criterion: &ChangeCriterion<'_>, unit: &[Penalty], theta: &[f64]) -> Vec<Penalty> {
    if unit.is_empty() {
        return Vec::new();
    }
    let mut workspace = crate::criterion::Workspace::default();
    let squares = criterion.linearise(theta, &mut workspace).sum_of_squares;
    let variance = squares / criterion.residual_count() as f64;
    if variance.is_finite() {
        scaled_penalties(unit, variance)
    } else {
        Vec::new()
    }
}
