//! Searches for the minimum of the loss, which has kinks where the delay is a whole number of
//! samples.

use super::{
    layout::{DELAY, OF_THE_CHANGE},
    objective::ChangeCriterion,
    starts,
};
use crate::{
    IdentError, SearchOptions,
    criterion::Workspace,
    optimize::{Minimum, minimise},
};

/// Steps from each start before the best of them is followed to its end.
const LOOK: usize = 30;
/// Distance to the border of a sample, in samples, below which the next sample is tried.
const NEAR_BORDER: f64 = 1e-6;

/// The lowest of the minima from these starts, with the name of its start: a look at each, then the
/// best to its end.
///
/// # Errors
/// [`IdentError::NoFiniteLoss`].
pub(super) fn best_minimum(
    starts: Vec<(String, Vec<f64>)>,
    criterion: &ChangeCriterion<'_>,
    options: &SearchOptions,
) -> Result<(String, Minimum), IdentError> {
    let look = SearchOptions {
        max_iterations: options.max_iterations.min(LOOK),
        ..*options
    };
    let mut best: Option<(String, Minimum)> = None;
    for (label, theta) in starts {
        let known = best.as_ref().map(|(_, b)| b.at.sum_of_squares);
        let Some(minimum) = minimise(criterion, theta, &look, known, &mut Workspace::of_thread()) else {
            continue;
        };
        if known.is_none_or(|known| minimum.at.sum_of_squares < known) {
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

/// The minimum of the model without a change, with the weights of the other.
///
/// # Errors
/// [`IdentError::NoFiniteLoss`].
pub(super) fn without_change(
    criterion: &ChangeCriterion<'_>,
    theta: &[f64],
    options: &SearchOptions,
) -> Result<Minimum, IdentError> {
    let mut constant = ChangeCriterion {
        changes: false,
        ..criterion.clone()
    };
    let start = starts::without_change(&constant, theta);
    for place in OF_THE_CHANGE {
        constant.limits[place] = (start[place], start[place]);
    }
    search(&constant, start, options, None).ok_or(IdentError::NoFiniteLoss)
}

/// Searches from theta. The loss has kinks where tau_e is a whole number of samples, and a search
/// may end in one; it is then finished inside each of the samples that meet there.
pub(super) fn search(
    criterion: &ChangeCriterion<'_>,
    theta: Vec<f64>,
    options: &SearchOptions,
    rival: Option<f64>,
) -> Option<Minimum> {
    let mut workspace = Workspace::of_thread();
    let minimum = minimise(criterion, theta, options, rival, &mut workspace)?;
    let (low, high) = criterion.limits[DELAY];
    if minimum.termination.converged() || low == high {
        return Some(minimum);
    }
    let ts = criterion.sample_time.s();
    let mut inside = |sample: usize, theta: &[f64]| {
        let mut within = criterion.clone();
        within.sample = Some(sample);
        within.limits[DELAY] = (
            (sample as f64 * ts).clamp(low, high),
            ((sample + 1) as f64 * ts).clamp(low, high),
        );
        minimise(&within, theta.to_vec(), options, None, &mut workspace)
    };
    let mut sample = (minimum.theta[DELAY] / ts + NEAR_BORDER).floor() as usize;
    let mut iterations = minimum.termination.iterations;
    let mut best = inside(sample, &minimum.theta)?;
    iterations += best.termination.iterations;
    // Each move lowers the loss; the limit only guards against rounding.
    for _ in 0..100 {
        let position = best.theta[DELAY] / ts;
        let neighbours = [
            (position <= sample as f64 + NEAR_BORDER)
                .then(|| sample.checked_sub(1))
                .flatten(),
            (position >= (sample + 1) as f64 - NEAR_BORDER).then_some(sample + 1),
        ];
        let better = neighbours.into_iter().flatten().find_map(|there| {
            if (there + 1) as f64 * ts <= low || there as f64 * ts >= high {
                return None;
            }
            let found = inside(there, &best.theta)?;
            let lower = found.at.sum_of_squares < best.at.sum_of_squares * (1.0 - options.tolerance);
            lower.then_some((there, found))
        });
        let Some((there, found)) = better else { break };
        iterations += found.termination.iterations;
        (sample, best) = (there, found);
    }
    best.termination.iterations = iterations;
    Some(best)
}
