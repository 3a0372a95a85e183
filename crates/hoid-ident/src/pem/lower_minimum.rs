//! Search for a minimum lower than the best minimum from the default starts, for models and records that may have such
//! a minimum.
//!
//! The starts cover the whole region of stability ([`crate::initial_guess::broad_starts`]). A few search steps from
//! each start show which starts decrease the loss. The best searches are completed, unless they come close to the known
//! minimum and are not predicted to end lower. If nothing lower is found, the known result remains bitwise unchanged.
//!
//! **Conditions.** With records of a few hundred samples, the loss has many local minima. With more coefficients than
//! the operator has (nb, nf > 2, nc > 0, nd > 4), it has many minima for longer records too; in this case the first few
//! steps use only a part of the record, so their cost does not depend on its length.

use super::{constraints::ConstrainedCriterion, fit_settings::FitSettings};
use crate::{
    Reason, SearchOptions,
    criterion::{Criterion, Data, Workspace},
    initial_guess::broad_starts::broad_starts,
    optimize::{Minimum, basin::lies_in_basin, minimise},
};

/// Largest number of residuals for which a lower minimum is searched for with every model. Longer records use this
/// number of residuals for the first steps.
const MAX_SPAN_RESIDUALS: usize = 1000;
/// Largest order of D that does not make a model larger than the operator.
const MAX_OPERATOR_ND: usize = 4;
/// Number of starts with the smallest loss from which a few steps are made.
const RANKED_START_COUNT: usize = 24;
/// Number of steps from each start before the best searches are completed.
const STEP_COUNT: usize = 8;
/// Largest number of searches that are completed on the whole record.
const MAX_COMPLETED_SEARCHES: usize = 8;
/// Values that replace [`RANKED_START_COUNT`] and [`MAX_COMPLETED_SEARCHES`] for a record longer than
/// [`MAX_SPAN_RESIDUALS`].
const COUNTS_FOR_LONG_RECORD: [usize; 2] = [12, 3];
/// Minimum relative decrease in the loss for which a minimum counts as lower.
const MIN_DECREASE: f64 = 1e-7;

/// Returns a lower minimum with the label of its start, if one is found. No search is made if the start was given, if
/// the number of starts is one, or if the known fit is exact.
pub(crate) fn lower_minimum(
    settings: &FitSettings,
    constrained: &ConstrainedCriterion<'_, '_>,
    known: &Minimum,
    workspace: &mut Workspace,
) -> Option<(String, Minimum)> {
    let criterion = constrained.criterion;
    let exact = known.termination.reason == Reason::ExactFit;
    if settings.start.is_some() || settings.starts < 2 || exact || !may_have_more_minima(criterion) {
        return None;
    }
    let part = first_span(criterion);
    let on_part = settings.constrained_criterion(&part);
    let whole = part.residual_count() == criterion.residual_count();
    let few = SearchOptions {
        max_iterations: STEP_COUNT,
        ..settings.search
    };
    let [most_tried, most_finished] = if whole {
        [RANKED_START_COUNT, MAX_COMPLETED_SEARCHES]
    } else {
        COUNTS_FOR_LONG_RECORD
    };
    let rival = whole.then_some(known.linearisation.sum_of_squares);
    let mut tried: Vec<(String, Minimum)> = broad_starts(&part, &known.theta, workspace)
        .into_iter()
        .filter(|start| !whole || !lies_in_basin(known, &start.theta, start.value))
        .take(most_tried)
        .filter_map(|start| Some((start.label, minimise(&on_part, start.theta, &few, rival, workspace)?)))
        .collect();
    tried.sort_by(|(_, a), (_, b)| {
        a.linearisation
            .sum_of_squares
            .total_cmp(&b.linearisation.sum_of_squares)
    });
    tried.truncate(most_finished);
    let mut lowest: Option<(String, Minimum)> = None;
    for (label, near) in tried {
        let rival = lowest
            .as_ref()
            .map_or(known, |(_, minimum)| minimum)
            .linearisation
            .sum_of_squares;
        if let Some(mut end) = minimise(constrained, near.theta, &settings.search, Some(rival), workspace)
            && end.linearisation.sum_of_squares < rival * (1.0 - MIN_DECREASE)
        {
            end.termination.iterations += near.termination.iterations;
            lowest = Some((label, end));
        }
    }
    lowest
}

/// True for models with F and without A, if the records are short or the model has more coefficients than the operator.
fn may_have_more_minima(criterion: &Criterion<'_>) -> bool {
    let o = criterion.orders;
    let larger = o.nb > 2 || o.nc > 0 || o.nd > MAX_OPERATOR_ND || o.nf > 2;
    o.na == 0 && o.nb > 0 && o.nf > 0 && (larger || criterion.residual_count() <= MAX_SPAN_RESIDUALS)
}

/// Returns the criterion for about the first [`MAX_SPAN_RESIDUALS`] residuals: records in their order, with the last of
/// them truncated.
fn first_span<'a>(criterion: &Criterion<'a>) -> Criterion<'a> {
    let mut left = MAX_SPAN_RESIDUALS;
    let mut data = Vec::new();
    for d in &criterion.data {
        // A part of a record shorter than this carries little information in addition to its initial states.
        if left < MAX_SPAN_RESIDUALS / 10 {
            break;
        }
        let n = d.u.len().min(criterion.first + left);
        left -= n.saturating_sub(criterion.first).min(left);
        let e = &d.e[..n.min(d.e.len())];
        data.push(Data { e, u: &d.u[..n], ..*d });
    }
    Criterion {
        data,
        ..criterion.clone()
    }
}
