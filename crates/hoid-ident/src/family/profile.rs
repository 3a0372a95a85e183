//! Intervals by profile likelihood.
//!
//! Let `S(x)` be the minimum of the criterion over all other elements at the coordinate x. The 95 % interval is the set
//! with `S(x) - S_min <= kappa sigma^2 t^2`, where t is the quantile of Student's distribution and kappa the inflation
//! of variances (D. M. Bates and D. G. Watts, *Nonlinear Regression Analysis and Its Applications*, 1988, section 6.1).
//! If the criterion is nearly parabolic, this interval equals the one from the standard error. Otherwise, as for a lag
//! that is nearly an integration, only the profile interval is valid.

use super::prediction_fit::PredictionFit;
use crate::{SearchOptions, criterion::Workspace};

/// Number of bisection steps for each end of an interval.
const BISECTION_STEPS: usize = 7;
/// Maximum number of doublings of the step towards an end.
const MAX_DOUBLINGS: usize = 8;
/// Maximum number of steps and tolerance of the searches, which need only the accuracy of an interval.
const SEARCH_LIMITS: (usize, f64) = (15, 1e-7);

/// Returns the 95 % interval of one element of eta by profile likelihood, limited to the search range; `None` if a
/// search fails.
pub(super) fn profile_interval(
    fit: &PredictionFit<'_>,
    place: usize,
    step: f64,
    quantile: f64,
    workspace: &mut Workspace,
) -> Option<(f64, f64)> {
    // Increase of the criterion at the ends of the interval: t^2 times the inflated innovation variance.
    let level = fit.inflation * fit.innovation_variance * quantile * quantile;
    let least = fit.minimum.linearisation.sum_of_squares;
    let search = SearchOptions {
        max_iterations: SEARCH_LIMITS.0,
        tolerance: SEARCH_LIMITS.1,
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
            // The next search starts from the conditional minimum at this point, which takes few iterations and stays
            // in the same valley.
            eta.copy_from_slice(&found.theta);
            Some(found.linearisation.sum_of_squares - least > level)
        };
        let (mut inside, mut reach) = (x, step);
        let mut outside = None;
        for _ in 0..MAX_DOUBLINGS {
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
        for _ in 0..BISECTION_STEPS {
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
