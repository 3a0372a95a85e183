//! A lower minimum than the one that the usual starts lead to, where there may be one.
//!
//! The starts that are tried are from all over the region of stability
//! ([`crate::initial_guess::broad`]). A few steps of the search from each tell which of them lead
//! down; the best go on to the end, unless they come close to the minimum that is known without a
//! promise to end lower. What is known stays as it is, to the last digit, where nothing lower is
//! found.
//!
//! **Where.** A record of some hundred samples has many minima, and a model with more coefficients
//! than the operator's (nb, nf > 2, nc > 0, nd > 4) has them in longer records too. There the first few
//! steps are taken on a part of the record, which costs the same however long the record is.
//!
//! **Many records** go side by side, a lane each, in all of that but the instrumental variables:
//! what is found differs from what one finds alone by rounding, and where a search does not come to
//! rest within its steps, by where it stands then.

use hoid_lanes::InstructionSet;

use super::{batched::lanes::search, constraints::ConstrainedCriterion, fit_settings::FitSettings};
use crate::{
    Reason, SearchOptions,
    criterion::{Criterion, Data, Workspace},
    initial_guess::broad::broad_starts,
    multistart::Descents,
    optimize::{Minimum, basin::lies_in_basin},
};

/// Residuals up to which every model is searched widely, and on which others take their first
/// steps.
const SPAN: usize = 1000;
/// Coefficients of D that the operator's models have at most.
const LARGEST_ND: usize = 4;
/// Starts that take a few steps, the best by their loss.
const TRIED: usize = 24;
/// Steps of each.
const STEPS: usize = 8;
/// Starts of which the search runs to its end, on the whole record.
const FINISHED: usize = 8;
/// The same two of a record that is longer than the span.
const OF_LONG: [usize; 2] = [12, 3];
/// Relative decrease of the loss from which on a minimum is another one.
const LOWER: f64 = 1e-7;

/// What is known of a fit: its criterion, and the lowest minimum from its usual starts.
pub(crate) type Known<'k> = (&'k ConstrainedCriterion<'k, 'k>, &'k Minimum);

/// True where others than the usual starts are tried. With a start that was given, or with a single
/// start, none is.
pub(crate) fn is_searched_widely(settings: &FitSettings, (constrained, minimum): Known<'_>) -> bool {
    let exact = minimum.termination.reason == Reason::ExactFit;
    settings.start.is_none() && settings.starts >= 2 && !exact && may_have_more_minima(constrained.criterion)
}

/// For each fit a lower minimum with the name of its start; none where nothing lower was found. The
/// searches of records of one length go side by side where registers are named, else alone; what
/// they find differs by rounding.
pub(crate) fn lower_minima(
    settings: &FitSettings,
    fits: &[Known<'_>],
    beside: Option<InstructionSet>,
    workspace: &mut Workspace,
) -> Vec<Option<(String, Minimum)>> {
    let parts: Vec<Criterion<'_>> = fits.iter().map(|(fit, _)| first_span(fit.criterion)).collect();
    let on_parts: Vec<_> = parts.iter().map(|part| settings.constrained(part)).collect();
    let few = SearchOptions {
        max_iterations: STEPS,
        ..settings.search
    };
    let known: Vec<_> = (parts.iter().zip(fits))
        .map(|(part, (_, minimum))| (part, minimum.theta.as_slice()))
        .collect();
    let starts = broad_starts(&known, beside, workspace);

    let is_whole = |part: &Criterion<'_>, fit: &Known<'_>| part.residuals() == fit.0.criterion.residuals();
    let mut first_steps: Vec<Descents<'_>> = (starts.into_iter().zip(&on_parts).zip(fits))
        .map(|((starts, on_part), fit)| {
            let whole = is_whole(on_part.criterion, fit);
            let rival = whole.then_some(fit.1.at.sum_of_squares);
            let tried = starts
                .into_iter()
                .filter(|start| !whole || !lies_in_basin(fit.1, &start.theta, start.value))
                .take(if whole { TRIED } else { OF_LONG[0] })
                .map(|start| (start.label, start.theta, 0))
                .collect();
            Descents::new(on_part.criterion, on_part, &few, rival, None, tried)
        })
        .collect();
    run_all(&mut first_steps, beside, workspace);

    let mut to_the_end: Vec<Descents<'_>> = (first_steps.into_iter().zip(&parts).zip(fits))
        .map(|((tried, part), fit)| {
            let mut best = tried.found;
            best.sort_by(|(_, a), (_, b)| a.at.sum_of_squares.total_cmp(&b.at.sum_of_squares));
            best.truncate(if is_whole(part, fit) { FINISHED } else { OF_LONG[1] });
            let near = best
                .into_iter()
                .map(|(label, near)| (label, near.theta, near.termination.iterations));
            let rival = Some(fit.1.at.sum_of_squares);
            Descents::new(
                fit.0.criterion,
                fit.0,
                &settings.search,
                rival,
                Some(LOWER),
                near.collect(),
            )
        })
        .collect();
    run_all(&mut to_the_end, beside, workspace);
    (to_the_end.into_iter())
        .map(|mut descents| descents.found.pop())
        .collect()
}

/// Runs all searches to their end.
fn run_all(all: &mut [Descents<'_>], beside: Option<InstructionSet>, workspace: &mut Workspace) {
    match beside {
        Some(path) => search(all.iter_mut().collect(), path, workspace),
        None => all.iter_mut().for_each(|descents| descents.run(workspace)),
    }
}

/// True for models with F and without A whose records are short, or which have more coefficients
/// than the operator's.
fn may_have_more_minima(criterion: &Criterion<'_>) -> bool {
    let o = criterion.orders;
    let larger = o.nb > 2 || o.nc > 0 || o.nd > LARGEST_ND || o.nf > 2;
    o.na == 0 && o.nb > 0 && o.nf > 0 && (larger || criterion.residuals() <= SPAN)
}

/// The criterion over the first samples, as many as [`SPAN`] residuals need: records from the first
/// one on, the last of them cut.
fn first_span<'a>(criterion: &Criterion<'a>) -> Criterion<'a> {
    let mut left = SPAN;
    let mut data = Vec::new();
    for d in &criterion.data {
        // A piece with fewer residuals than this says little more than its initial states.
        if left < SPAN / 10 {
            break;
        }
        let n = d.u.len().min(criterion.first + left);
        left -= n.saturating_sub(criterion.first).min(left);
        let e = &d.e[..n.min(d.e.len())];
        data.push(Data { e, u: &d.u[..n] });
    }
    Criterion {
        data,
        ..criterion.clone()
    }
}
