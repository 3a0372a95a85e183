//! Starts from all over the region of stability, for records that have many minima: short ones, and
//! models with more coefficients than the operator's.
//!
//! Given F, C and D the residual is affine in B; given F, C and B it is affine in D. So two grids
//! that know nothing of the data, one of F and one of C, and least squares for the rest, reach every
//! kind of minimum: slow real poles beside each other, a resonance, C and D that nearly cancel each
//! other at any frequency.
//!
//! **Systems**, B and F: that of the minimum that is known; those of refined instrumental variables
//! with autoregressive noise of two orders ([`crate::iv::refined_system`]); and the best places of
//! a grid of poles ([`super::pole_grid::anywhere`]), ranked with an autoregression for their noise.
//!
//! **Noise models** of each system: C from a grid of its roots, D by least squares, and B once more
//! with them. Those with the smallest loss are starts.

use hoid_lanes::InstructionSet;
use hoid_model::Orders;

use super::pole_grid::{anywhere, noise_zeros};
use crate::{
    InitialState,
    criterion::{Block, Criterion, Workspace, first_residual},
    iv::refined_system,
    multistart::{Completion, Start},
    optimize::Objective,
    pem::batched::lanes::search,
};

/// Places of the grid of poles that are taken.
const PLACES: usize = 8;
/// Noise models of a system that is fitted, and of one of the grid.
const NOISE_MODELS: (usize, usize) = (4, 1);
/// Orders of the autoregression of the instrumental variables.
const IV_NOISE: [usize; 2] = [2, 6];
/// Coefficients of the autoregression that ranks the grid, beyond those of the noise model.
const MORE_NOISE: usize = 1;

/// A proposal for B and F.
struct System {
    label: &'static str,
    b: Vec<f64>,
    f: Vec<f64>,
    noise_models: usize,
}

/// The starts of each criterion, each start complete, the best first; beside it stands a minimum
/// that is known. What is to be found of them is found side by side where registers are named: the
/// criteria are then of one model, and their records of one length.
pub(crate) fn broad_starts(
    criteria: &[(&Criterion<'_>, &[f64])],
    beside: Option<InstructionSet>,
    workspace: &mut Workspace,
) -> Vec<Vec<Start>> {
    let places = best_places(criteria, beside, workspace);
    let systems: Vec<Vec<System>> = (criteria.iter().zip(places))
        .map(|(&(criterion, known), places)| {
            let o = criterion.orders;
            let fitted = |label, b: &[f64], f: &[f64]| System {
                label,
                b: b.to_vec(),
                f: f.to_vec(),
                noise_models: NOISE_MODELS.0,
            };
            let mut systems = vec![fitted("known system", &known[..o.nb], &known[o.parameters() - o.nf..])];
            for nd in IV_NOISE {
                if let Some(system) = refined_system(criterion, nd) {
                    systems.push(fitted("refined instruments", &system[o.nf..], &system[..o.nf]));
                }
            }
            systems.extend(places);
            systems
        })
        .collect();
    let candidates: Vec<Vec<Vec<Start>>> = (criteria.iter().zip(&systems))
        .map(|((criterion, _), systems)| systems.iter().map(|system| noise_models(criterion, system)).collect())
        .collect();
    let mut completions: Vec<Completion<'_>> = (criteria.iter().zip(&candidates))
        .map(|((criterion, _), candidates)| Completion::new(criterion, candidates.iter().flatten().cloned().collect()))
        .collect();
    complete_all(&mut completions, beside, workspace);
    (criteria.iter().zip(systems).zip(candidates).zip(completions))
        .map(|((((criterion, _), systems), candidates), completion)| {
            let mut completed = completion.starts.into_iter();
            let mut starts = Vec::new();
            for (system, of_system) in systems.iter().zip(&candidates) {
                let mut best: Vec<Start> = (completed.by_ref().take(of_system.len()))
                    .filter(|start| start.value.is_finite() && criterion.is_feasible(&start.theta))
                    .collect();
                best.sort_by(|a, b| a.value.total_cmp(&b.value));
                best.truncate(system.noise_models);
                starts.extend(best);
            }
            starts.sort_by(|a, b| a.value.total_cmp(&b.value));
            starts
        })
        .collect()
}

/// Of each criterion the places of the grid of poles with the smallest loss, each with an
/// autoregression of its own.
fn best_places(
    criteria: &[(&Criterion<'_>, &[f64])],
    beside: Option<InstructionSet>,
    workspace: &mut Workspace,
) -> Vec<Vec<System>> {
    let rankings: Vec<Criterion<'_>> = criteria.iter().map(|(criterion, _)| ranking(criterion)).collect();
    let mut completions: Vec<Completion<'_>> = (rankings.iter())
        .map(|ranking| {
            let needed = ranking.first + ranking.orders.parameters();
            let short = ranking.data.iter().any(|d| d.u.len() <= needed);
            let places = if short { Vec::new() } else { anywhere(ranking.orders.nf) };
            let of_poles = |f: &Vec<f64>| Start::of_poles("pole grid", &ranking.orders, f);
            Completion::new(ranking, places.iter().map(of_poles).collect())
        })
        .collect();
    complete_all(&mut completions, beside, workspace);
    let of_criterion = |(completion, ranking): (Completion<'_>, &Criterion<'_>)| {
        let o = ranking.orders;
        let mut places = completion.starts;
        places.retain(|place| place.value.is_finite());
        places.sort_by(|a, b| a.value.total_cmp(&b.value));
        let system = |place: &Start| System {
            label: "slow and fast poles",
            b: place.theta[..o.nb].to_vec(),
            f: place.theta[o.parameters() - o.nf..].to_vec(),
            noise_models: NOISE_MODELS.1,
        };
        places.iter().take(PLACES).map(system).collect()
    };
    completions.into_iter().zip(&rankings).map(of_criterion).collect()
}

/// The criterion by which the places of the grid are ranked.
fn ranking<'a>(criterion: &Criterion<'a>) -> Criterion<'a> {
    let o = criterion.orders;
    let coloured = o.nc + o.nd > 0;
    let orders = Orders {
        nc: 0,
        nd: if coloured { o.nc + o.nd + MORE_NOISE } else { 0 },
        ..o
    };
    Criterion {
        orders,
        initial: InitialState::Estimate,
        first: criterion.first.max(first_residual(&orders, InitialState::Estimate)),
        ..criterion.clone()
    }
}

/// A system with each noise model of the grid, D and B still to be found.
fn noise_models(criterion: &Criterion<'_>, system: &System) -> Vec<Start> {
    let o = criterion.orders;
    let left = if o.nd > 0 {
        vec![Block::B, Block::D]
    } else {
        vec![Block::B]
    };
    (noise_zeros(o.nc).iter())
        .map(|c| [&system.b[..], c, &vec![0.0; o.nd], &system.f].concat())
        .filter(|theta| criterion.is_feasible(theta))
        .map(|theta| Start::to_be_found(system.label, theta, left.clone()))
        .collect()
}

/// Finds what is to be found of all starts.
fn complete_all(all: &mut [Completion<'_>], beside: Option<InstructionSet>, workspace: &mut Workspace) {
    match beside {
        Some(path) => search(all.iter_mut().collect(), path, workspace),
        None => all.iter_mut().for_each(|completion| completion.run(workspace)),
    }
}
