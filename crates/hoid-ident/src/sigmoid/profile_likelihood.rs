//! Profile likelihood intervals of t_M and G.
//!
//! An interval contains the values at which the loss, minimised over the other parameters, is only slightly larger than
//! at the minimum: `n ln(V(x)/V) <= q`. The loss need not be a parabola. For G, and for t_M if the change is resolved
//! (two standard errors are less than the width 1/G of the change), this statistic is chi-square with one degree of
//! freedom: q = 3.84 for 95 %. If the change is abrupt, t_M is a change point instead: at the true t_M the statistic is
//! distributed as the larger of two exponential variables, `P(loss <= q) = (1 - e^{-q/2})^2`, q = 7.35 for 95 % (B. E.
//! Hansen, *Econometrica* 68 (2000) 575-603, theorem 2).

use super::{layout::Layout, objective::ChangeCriterion, search::search};
use crate::optimize::{Minimum, SearchMethod, SearchOptions};

/// 95 % quantile of chi-square with one degree of freedom.
const CHI_SQUARE_95: f64 = 3.841;
/// 95 % quantile of the larger of two exponential variables with mean 2.
const CHANGE_POINT_QUANTILE_95: f64 = 7.352;
/// The walk continues up to this multiple of the quantile, since the loss need not increase monotonically.
const WALK_LIMIT_FACTOR: f64 = 2.0;
/// Growth factor of the steps along the profile.
const STEP_GROWTH: f64 = 1.5;
/// First step along the profile, in standard errors.
const FIRST_STEP: f64 = 0.5;
/// Largest number of points on each side of the minimum; the largest step can be hundreds of times the first.
const MAX_POINTS: usize = 40;
/// Number of halvings of the last step, which determine the end of the interval to a sixteenth of this step.
const HALVING_COUNT: usize = 4;

/// Ends of a 95 % interval; an open end is the bound of the parameter, or infinity for a rate.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Interval {
    pub low: f64,
    pub high: f64,
}

/// Result of a walk along the profile likelihood.
#[derive(Debug)]
pub(crate) enum ProfileEnd {
    /// The interval of the parameter.
    Interval(Interval),
    /// A theta with a lower loss than at the given minimum.
    Lower(Vec<f64>),
}

/// True if t_M is a change point. `standard_error` is the standard error that t_M would have as a regular parameter.
pub(crate) fn is_change_point(layout: &Layout, theta: &[f64], standard_error: f64) -> bool {
    // Derivatives at one t_M carry no information about a t_M that is further away than the width of the change, such
    // as an end of a 95 % interval.
    2.0 * standard_error >= (-theta[layout.log_rate]).exp()
}

/// Returns the 95 % interval of t_M or ln G around a minimum. `standard_error` is the standard error of the parameter,
/// `None` if it has no standard error. If `stay` is true, points with a lower loss than the minimum count as inside the
/// interval.
pub(crate) fn profile_likelihood_interval(
    criterion: &ChangeCriterion<'_>,
    minimum: &Minimum,
    place: usize,
    standard_error: Option<f64>,
    change_point: bool,
    stay: bool,
) -> ProfileEnd {
    let quantile = if change_point && place == criterion.layout.midpoint {
        CHANGE_POINT_QUANTILE_95
    } else {
        CHI_SQUARE_95
    };
    let n = criterion.residual_count() as f64;
    let options = SearchOptions {
        method: SearchMethod::LevenbergMarquardt,
        max_iterations: 30,
        // The statistic is n times the relative change in the loss, so it is accurate to a thousandth of the quantile.
        tolerance: 1e-3 * quantile / n,
    };
    let (low, high) = criterion.limits[place];
    let at = |value: f64, from: &[f64]| {
        let mut held = criterion.clone();
        held.limits[place] = (value, value);
        let found = search(&held, from.to_vec(), &options, None)?;
        Some((
            n * (found.linearisation.sum_of_squares / minimum.linearisation.sum_of_squares).ln(),
            found.theta,
        ))
    };
    let finest = if place == criterion.layout.midpoint {
        criterion.sample_time.s()
    } else {
        0.05
    };
    let first_step = FIRST_STEP * standard_error.unwrap_or(finest).max(finest).min(0.1 * (high - low));
    let mut ends = [low, high];
    let (mut lowest, mut lower) = (-0.1 * quantile, None);
    for (end, sign) in ends.iter_mut().zip([-1.0, 1.0]) {
        let bound = *end;
        let (mut inside, mut outside) = (minimum.theta.clone(), None);
        let mut from = minimum.theta.clone();
        let mut step = first_step;
        for _ in 0..MAX_POINTS {
            let value = (from[place] + sign * step).clamp(low, high);
            step *= STEP_GROWTH;
            let Some((loss, theta)) = at(value, &from) else { break };
            // If the loss is lower than at the given minimum, by more than a tenth of the quantile in the statistic,
            // the walk continues, and its lowest point is returned.
            if loss < lowest && !stay {
                lowest = loss;
                lower = Some(theta.clone());
            }
            if loss <= quantile {
                (inside, outside) = (theta.clone(), None);
            } else if outside.is_none() {
                outside = Some(value);
            }
            if loss > WALK_LIMIT_FACTOR * quantile || value == bound {
                break;
            }
            from = theta;
        }
        if lower.is_some() {
            continue;
        }
        let Some(mut beyond) = outside else { continue };
        for _ in 0..HALVING_COUNT {
            let middle = 0.5 * (inside[place] + beyond);
            match at(middle, &inside) {
                Some((loss, theta)) if loss <= quantile => inside = theta,
                _ => beyond = middle,
            }
        }
        *end = 0.5 * (inside[place] + beyond);
    }
    if let Some(theta) = lower {
        return ProfileEnd::Lower(theta);
    }
    let [low_end, high_end] = ends;
    ProfileEnd::Interval(if place == criterion.layout.log_rate {
        Interval {
            low: low_end.exp(),
            high: if high_end >= high {
                f64::INFINITY
            } else {
                high_end.exp()
            },
        }
    } else {
        Interval {
            low: low_end,
            high: high_end,
        }
    })
}
