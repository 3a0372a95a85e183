//! Search for a lower minimum than that of the default starts, for models and records that may have one.
//!
//! The starts cover the whole region of stability ([`crate::initial_guess::broad`]). A few steps of the search from
//! each show which of them decrease the loss; the best are continued to the end, unless they come close to the known
//! minimum without a predicted lower end. If nothing lower is found, the known result is unchanged to the last digit.
//!
//! **Conditions.** A record of some hundred samples has many minima, and a model with more coefficients than the
//! operator's (nb, nf > 2, nc > 0, nd > 4) has them in longer records too. There the first few steps use a part of the
//! record, whose cost does not depend on the length of the record.

use super::{constraints::ConstrainedCriterion, fit_settings::FitSettings};
use crate::{
    Reason, SearchOptions,
    criterion::{Criterion, Data, Workspace},
    initial_guess::broad::broad_starts,
    optimize::{Minimum, basin::lies_in_basin, minimise},
};

/// Number of residuals up to which every model is searched widely, and of the part for the first steps of other models.
const SPAN: usize = 1000;
/// Largest number of coefficients of D of the operator's models.
const LARGEST_ND: usize = 4;
/// Number of starts for a few steps, the best by their loss.
const TRIED: usize = 24;
/// Number of steps from each of them.
const STEPS: usize = 8;
/// Number of starts whose search runs to completion, on the whole record.
const FINISHED: usize = 8;
/// The same two numbers for a record that is longer than the span.
const OF_LONG: [usize; 2] = [12, 3];
/// Relative decrease of the loss above which a minimum counts as another one.
const LOWER: f64 = 1e-7;

/// Returns a lower minimum with the name of its start. With a given start, or with a single start, no other is searched
/// for.
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
    let on_part = settings.constrained(&part);
    let whole = part.residuals() == criterion.residuals();
    let few = SearchOptions {
        max_iterations: STEPS,
        ..settings.search
    };
    let [most_tried, most_finished] = if whole { [TRIED, FINISHED] } else { OF_LONG };
    let rival = whole.then_some(known.at.sum_of_squares);
    let mut tried: Vec<(String, Minimum)> = broad_starts(&part, &known.theta, workspace)
        .into_iter()
        .filter(|start| !whole || !lies_in_basin(known, &start.theta, start.value))
        .take(most_tried)
        .filter_map(|start| Some((start.label, minimise(&on_part, start.theta, &few, rival, workspace)?)))
        .collect();
    tried.sort_by(|(_, a), (_, b)| a.at.sum_of_squares.total_cmp(&b.at.sum_of_squares));
    tried.truncate(most_finished);
    let mut lowest: Option<(String, Minimum)> = None;
    for (label, near) in tried {
        let rival = lowest.as_ref().map_or(known, |(_, minimum)| minimum).at.sum_of_squares;
        if let Some(mut end) = minimise(constrained, near.theta, &settings.search, Some(rival), workspace)
            && end.at.sum_of_squares < rival * (1.0 - LOWER)
        {
            end.termination.iterations += near.termination.iterations;
            lowest = Some((label, end));
        }
    }
    lowest
}

/// True for models with F and without A whose records are short, or which have more coefficients
/// than the operator's.
fn may_have_more_minima(criterion: &Criterion<'_>) -> bool {
    let o = criterion.orders;
    let larger = o.nb > 2 || o.nc > 0 || o.nd > LARGEST_ND || o.nf > 2;
    o.na == 0 && o.nb > 0 && o.nf > 0 && (larger || criterion.residuals() <= SPAN)
}

/// Returns the criterion over the first samples, enough for [`SPAN`] residuals: the records in order, the last one
/// truncated.
fn first_span<'a>(criterion: &Criterion<'a>) -> Criterion<'a> {
    let mut left = SPAN;
    let mut data = Vec::new();
    for d in &criterion.data {
        // A piece with fewer residuals than this carries little information beyond its initial states.
        if left < SPAN / 10 {
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
