//! Fit with different noise levels before and after the change. The fit and the levels are estimated alternately until
//! the ratio of the levels converges. The residuals are weighted by the inverse of the noise level at their time
//! ([`super::noise_level`]).

use super::{
    noise_level::{noise_levels, weights},
    objective::{ChangeCriterion, Data},
    search::search,
    sigmoid_point::SigmoidPoint,
};
use crate::{
    IdentError, Reason, SearchOptions,
    linalg::vectors::dot,
    optimize::{Minimum, Objective},
};

/// Largest number of rounds of fit and noise levels.
const MAX_ROUNDS: usize = 20;
/// The rounds end when the relative change in the ratio of the levels is below this limit; the standard error of the
/// ratio is about `1/sqrt n`, i.e. 1 % for 10000 residuals.
const CONVERGENCE_TOLERANCE: f64 = 1e-6;
/// Negligible relative change in the loss: it changes the log-likelihood of 10000 residuals by 0.005.
const NEGLIGIBLE_CHANGE: f64 = 1e-6;

/// Estimates the fit and the noise levels alternately and returns the minimum and the levels. The levels are `None` if
/// they cannot be determined, such as for residuals that are only rounding errors.
///
/// # Errors
/// [`IdentError::NoFiniteLoss`] if a search fails.
pub(super) fn reweight(
    criterion: &mut ChangeCriterion<'_>,
    mut minimum: Minimum,
    options: &SearchOptions,
) -> Result<(Minimum, Option<[f64; 2]>), IdentError> {
    let mut levels = None;
    let mut iterations = minimum.termination.iterations;
    for round in 0..MAX_ROUNDS {
        let Some(found) = levels_at(criterion, &minimum.theta) else {
            break;
        };
        let before = levels.replace(found);
        let ratio = |s: [f64; 2]| s[1] / s[0];
        if before.is_some_and(|b: [f64; 2]| (ratio(found) / ratio(b) - 1.0).abs() < CONVERGENCE_TOLERANCE) {
            break;
        }
        let weights = weights(found, &change_shares(criterion, &minimum.theta));
        let kept = criterion.weights.replace(weights);
        let next = search(criterion, minimum.theta.clone(), options, None).ok_or(IdentError::NoFiniteLoss)?;
        iterations += next.termination.iterations;
        let change = next.linearisation.sum_of_squares / minimum.linearisation.sum_of_squares - 1.0;
        if round > 0 && change > NEGLIGIBLE_CHANGE {
            // Each of the last two fits has the higher loss with the noise levels of the other; the more likely fit is
            // kept.
            (criterion.weights, levels) = (kept, before);
            break;
        }
        minimum = next;
        if round + 1 == MAX_ROUNDS && change < -NEGLIGIBLE_CHANGE && minimum.termination.converged() {
            minimum.termination.reason = Reason::IterationLimit;
        }
    }
    minimum.termination.iterations = iterations;
    Ok((minimum, levels))
}

/// Returns the share of the change at the time of each residual. The delay is not subtracted, because the remnant is
/// not delayed.
fn change_shares(criterion: &ChangeCriterion<'_>, theta: &[f64]) -> Vec<Vec<f64>> {
    let ts = criterion.sample_time.s();
    let of = |d: &Data<'_>| {
        (criterion.first..d.u.len())
            .map(|t| SigmoidPoint::at(&criterion.layout, theta, d.start_s + t as f64 * ts).share)
            .collect()
    };
    criterion.data.iter().map(of).collect()
}

fn levels_at(criterion: &ChangeCriterion<'_>, theta: &[f64]) -> Option<[f64; 2]> {
    let residuals: Option<Vec<Vec<f64>>> = (0..criterion.data.len())
        .map(|record| criterion.residuals_of(theta, record))
        .collect();
    let residuals = residuals?;
    let size: f64 = residuals.iter().map(|r| dot(r, r)).sum();
    let power = criterion.output_power();
    // Residuals that are only rounding errors have no noise level.
    (size > 1e-24 * power).then(|| noise_levels(&residuals, &change_shares(criterion, theta)))?
}
