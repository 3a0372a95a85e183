//! Intervals by profile likelihood.
//!
//! With `S(x) = min over all else of the criterion at coordinate x`, the 95 % interval is the set with
//! `S(x) - S_min <= kappa sigma^2 t^2`, t the quantile, kappa the inflation of variances (D. M. Bates and D. G. Watts,
//! *Nonlinear Regression Analysis and Its Applications*, 1988, section 6.1). Near the estimate it equals the interval
//! of the standard error; if the criterion is not a parabola (a lag that is nearly an integration), only the profile
//! interval is valid.

use super::prediction_fit::PredictionFit;
use crate::{SearchOptions, criterion::Workspace};

/// Halvings of the bracket of an end.
const HALVINGS: usize = 7;
/// Doublings of the step towards an end.
const DOUBLINGS: usize = 8;
/// Limits of the search: the profile need not be more accurate than the interval.
const SEARCH: (usize, f64) = (15, 1e-7);

/// Returns the interval of one element of eta, within the search range; `None` if a search fails.
pub(super) fn profile_interval(
    fit: &PredictionFit<'_>,
    place: usize,
    step: f64,
    quantile: f64,
    workspace: &mut Workspace,
) -> Option<(f64, f64)> {
    // Rise of the criterion at the ends of the interval: t^2 in units of the inflated innovation variance.
    let level = fit.inflation * fit.innovation_variance * quantile * quantile;
    let least = fit.minimum.at.sum_of_squares;
    let search = SearchOptions {
        max_iterations: SEARCH.0,
        tolerance: SEARCH.1,
        ..SearchOptions::default()
    };
    let x = fit.eta()[place];
    let (low, high) = fit.criterion.limits[place];
    let mut end = |direction: f64| -> Option<f64> {
        let bound = if direction > 0.0 { high } else { low };
        let mut eta = fit.eta().to_vec();
        let mut above = |at: f64| -> Option<bool> {
            let mut held = fit.criterion.clone();
            held.limits[place] = (at, at);
            eta[place] = at;
            let found = held.search(eta.clone(), &search, None, workspace)?;
            // The next point starts from the conditional minimum of this one: few iterations, and the same valley.
            eta.copy_from_slice(&found.theta);
            Some(found.at.sum_of_squares - least > level)
        };
        let (mut inside, mut reach) = (x, step);
        let mut outside = None;
        for _ in 0..DOUBLINGS {
            let at = (x + direction * reach).clamp(low, high);
            if above(at)? {
                outside = Some(at);
                break;
            }
            inside = at;
            if at == bound {
                return Some(bound);
            }
            reach *= 2.0;
        }
        let Some(mut outside) = outside else {
            return Some(bound);
        };
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inside + outside);
            if above(middle)? {
                outside = middle;
            } else {
                inside = middle;
            }
        }
        Some(0.5 * (inside + outside))
    };
    Some((end(-1.0)?, end(1.0)?))
}
