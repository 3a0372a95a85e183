//! Prior knowledge of the person in the criterion of a change.
//!
//! A prior of a positive parameter x, `ln x ~ N(m, s)`, is added to the squared residuals as `sigma^2 (ln x - m)^2/s^2`
//! ([`crate::family::OperatorPrior`]); that of T_L is used before and after the change. The innovation variance sigma^2
//! is that of the fit; both are computed in turn.

use super::{
    layout::{Element, Layout},
    objective::ChangeCriterion,
    reweighting::with_levels,
    search::search,
};
use crate::{
    IdentError, NoiseLevel, SearchOptions,
    family::OperatorPrior,
    grey_box::objective::Penalty,
    optimize::{Minimum, Objective},
};

/// Rounds in which sigma^2 of the prior is updated.
const ROUNDS: usize = 3;
/// Relative change of sigma^2 below which no further round is necessary.
const SETTLED: f64 = 0.05;

/// Returns the prior for each element of theta, in units of one standard deviation.
pub(super) fn penalties(layout: &Layout, prior: &OperatorPrior) -> Vec<Penalty> {
    let all = layout.coordinates();
    let elements = layout.elements();
    let places = |penalty: Penalty| {
        let coordinate = all[penalty.place];
        let is_own = move |element: &Element| match element {
            Element::Varying(own, _) | Element::Constant(own) => *own == coordinate,
            _ => false,
        };
        // omega_nm and zeta_nm are parameters here, in the family by their logarithms.
        let own = elements.iter().enumerate().filter(move |(_, e)| is_own(e));
        own.map(move |(place, _)| Penalty {
            place,
            logarithmic: true,
            ..penalty
        })
        .collect::<Vec<_>>()
    };
    let unit = prior.penalties(layout.form, layout.neuromuscular);
    unit.into_iter().flat_map(places).collect()
}

/// Returns the penalties with the variance of the innovations as their unit.
pub(super) fn weighted(unit: &[Penalty], variance: f64) -> Vec<Penalty> {
    unit.iter().map(|p| p.weighted(variance)).collect()
}

/// Variance of the innovations at a minimum.
pub(super) fn innovation_variance(criterion: &ChangeCriterion<'_>, minimum: &Minimum) -> f64 {
    let not_fixed = criterion.limits.iter().filter(|(low, high)| low < high).count();
    let squares = minimum.at.sum_of_squares - criterion.penalty_at(&minimum.theta);
    squares / (criterion.residuals() - not_fixed - criterion.states()) as f64
}

/// Returns the minimum with noise levels, and with the prior in units of the variance that belongs to it.
///
/// # Errors
/// [`IdentError::NoFiniteLoss`].
pub(super) fn settled(
    criterion: &mut ChangeCriterion<'_>,
    unit: &[Penalty],
    found: Minimum,
    noise_level: NoiseLevel,
    options: &SearchOptions,
) -> Result<(Minimum, Option<[f64; 2]>), IdentError> {
    let levelled = |criterion: &mut ChangeCriterion<'_>, minimum| match noise_level {
        NoiseLevel::Constant => Ok((minimum, None)),
        NoiseLevel::Changing => with_levels(criterion, minimum, options),
    };
    let (mut minimum, mut levels) = levelled(criterion, found)?;
    for _ in 1..ROUNDS {
        let Some(now) = criterion.penalty.first() else { break };
        let variance = innovation_variance(criterion, &minimum);
        if (variance / now.variance - 1.0).abs() < SETTLED || variance <= 0.0 {
            break;
        }
        criterion.penalty = weighted(unit, variance);
        let next = search(criterion, minimum.theta.clone(), options, None).ok_or(IdentError::NoFiniteLoss)?;
        let before = minimum.termination.iterations;
        (minimum, levels) = levelled(criterion, next)?;
        minimum.termination.iterations += before;
    }
    Ok((minimum, levels))
}

/// Returns the prior in units of the variance at a start.
pub(super) fn begun(criterion: &ChangeCriterion<'_>, unit: &[Penalty], theta: &[f64]) -> Vec<Penalty> {
    if unit.is_empty() {
        return Vec::new();
    }
    let mut workspace = crate::criterion::Workspace::default();
    let squares = criterion.linearise(theta, &mut workspace).sum_of_squares;
    let variance = squares / criterion.residuals() as f64;
    if variance.is_finite() {
        weighted(unit, variance)
    } else {
        Vec::new()
    }
}
