//! Searches for the minimum of the loss. The loss has kinks where the delay is an integer number of samples and, for an
//! operator with a direct part, also halfway between these delays ([`super::layout`], pieces).

use super::{objective::ChangeCriterion, starts};
use crate::{
    IdentError, SearchOptions,
    criterion::Workspace,
    optimize::{Minimum, minimise},
};

/// Number of steps of the short search from each start, after which only the best search is continued.
const SHORT_SEARCH_STEPS: usize = 30;
/// Distance of the delay from the border of a piece of the sampling interval, relative to the length of the piece,
/// below which the neighbouring piece is tried.
const BORDER_DISTANCE: f64 = 1e-6;

/// Returns the lowest minimum found from these starts and the name of its start. A short search is made from each
/// start; only the best is completed.
///
/// # Errors
/// [`IdentError::NoFiniteLoss`] if no search is successful.
pub(super) fn best_minimum(
    starts: Vec<(String, Vec<f64>)>,
    criterion: &ChangeCriterion<'_>,
    options: &SearchOptions,
) -> Result<(String, Minimum), IdentError> {
    let look = SearchOptions {
        max_iterations: options.max_iterations.min(SHORT_SEARCH_STEPS),
        ..*options
    };
    let mut best: Option<(String, Minimum)> = None;
    for (label, theta) in starts {
        let known = best.as_ref().map(|(_, b)| b.linearisation.sum_of_squares);
        let Some(minimum) = minimise(criterion, theta, &look, known, &mut Workspace::borrow_from_thread()) else {
            continue;
        };
        if known.is_none_or(|known| minimum.linearisation.sum_of_squares < known) {
            best = Some((label, minimum));
        }
    }
    let (label, seen) = best.ok_or(IdentError::NoFiniteLoss)?;
    if seen.termination.converged() {
        return Ok((label, seen));
    }
    let mut minimum = search(criterion, seen.theta, options, None).ok_or(IdentError::NoFiniteLoss)?;
    minimum.termination.iterations += seen.termination.iterations;
    Ok((label, minimum))
}

/// Returns the minimum of the model without a change, with the weights of the model with a change.
///
/// # Errors
/// [`IdentError::NoFiniteLoss`] if the search fails.
pub(super) fn minimum_without_change(
    criterion: &ChangeCriterion<'_>,
    theta: &[f64],
    options: &SearchOptions,
) -> Result<Minimum, IdentError> {
    let mut constant = ChangeCriterion {
        changes: false,
        ..criterion.clone()
    };
    let start = starts::start_without_change(&constant, theta);
    for index in constant.layout.change_indices() {
        constant.limits[index] = (start[index], start[index]);
    }
    search(&constant, start, options, None).ok_or(IdentError::NoFiniteLoss)
}

/// Searches for a minimum, starting from theta. The loss has kinks where tau_e is an integer number of samples. If the
/// search does not converge, it continues within single pieces of the sampling interval ([`super::layout`], pieces).
pub(super) fn search(
    criterion: &ChangeCriterion<'_>,
    theta: Vec<f64>,
    options: &SearchOptions,
    rival: Option<f64>,
) -> Option<Minimum> {
    let mut workspace = Workspace::borrow_from_thread();
    let minimum = minimise(criterion, theta, options, rival, &mut workspace)?;
    let delay = criterion.layout.delay;
    let (low, high) = criterion.limits[delay];
    if minimum.termination.converged() || low == high {
        return Some(minimum);
    }
    let length = criterion.sample_time.s() / criterion.layout.piece_count() as f64;
    let mut inside = |piece: usize, theta: &[f64]| {
        let mut within = criterion.clone();
        within.piece = Some(piece);
        within.limits[delay] = (
            (piece as f64 * length).clamp(low, high),
            ((piece + 1) as f64 * length).clamp(low, high),
        );
        minimise(&within, theta.to_vec(), options, None, &mut workspace)
    };
    let mut piece = (minimum.theta[delay] / length + BORDER_DISTANCE).floor() as usize;
    let mut iterations = minimum.termination.iterations;
    let mut best = inside(piece, &minimum.theta)?;
    iterations += best.termination.iterations;
    // Each change of piece decreases the loss; the limit on the number of changes only guards against rounding.
    for _ in 0..100 {
        let position = best.theta[delay] / length;
        let neighbours = [
            (position <= piece as f64 + BORDER_DISTANCE)
                .then(|| piece.checked_sub(1))
                .flatten(),
            (position >= (piece + 1) as f64 - BORDER_DISTANCE).then_some(piece + 1),
        ];
        let better = neighbours.into_iter().flatten().find_map(|there| {
            if (there + 1) as f64 * length <= low || there as f64 * length >= high {
                return None;
            }
            let found = inside(there, &best.theta)?;
            let lower =
                found.linearisation.sum_of_squares < best.linearisation.sum_of_squares * (1.0 - options.tolerance);
            lower.then_some((there, found))
        });
        let Some((there, found)) = better else { break };
        iterations += found.termination.iterations;
        (piece, best) = (there, found);
    }
    best.termination.iterations = iterations;
    Some(best)
}
