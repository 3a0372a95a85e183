//! Starts from the whole region of stability, for cases with many minima: short records, and models with more
//! coefficients than the operator.
//!
//! Given F, C and D the residual is affine in B; given F, C and B it is affine in D. Therefore two grids that do not
//! depend on the data, one for F and one for C, with least squares for the remaining coefficients, reach every kind of
//! minimum: adjacent slow real poles, a resonance, and a C and D that nearly cancel at any frequency.
//!
//! **Systems**, B and F: the system of the known minimum; the systems from refined instrumental variables with
//! autoregressive noise of two orders ([`crate::iv::refined_system`]); and the best points of a pole grid
//! ([`super::pole_grid::unit_disc_grid`]), which are ranked with an autoregressive noise model.
//!
//! **Noise models** of each system: C is taken from a grid of roots, D follows by least squares, and B is estimated
//! again with C and D. The noise models with the smallest loss give the starts.

use hoid_model::Orders;

use super::pole_grid::{noise_zero_grid, unit_disc_grid};
use crate::{
    InitialState,
    criterion::{Block, Criterion, Workspace, first_residual},
    iv::refined_system,
    multistart::Start,
    optimize::Objective,
};

/// Number of points of the pole grid that are used as systems.
const GRID_SYSTEM_COUNT: usize = 8;
/// Number of noise models for a fitted system, and for a system of the grid.
const NOISE_MODEL_COUNTS: (usize, usize) = (4, 1);
/// Orders of the autoregressive noise models for the instrumental variables.
const IV_NOISE_ORDERS: [usize; 2] = [2, 6];
/// Number of coefficients by which the autoregression that ranks the grid exceeds the noise model.
const EXTRA_NOISE_COEFFICIENTS: usize = 1;

/// A candidate for B and F.
struct SystemCandidate {
    label: &'static str,
    b: Vec<f64>,
    f: Vec<f64>,
    noise_models: usize,
}

/// Returns complete starts in order of their loss; `known` is the theta of a minimum that was found before.
pub(crate) fn broad_starts(criterion: &Criterion<'_>, known: &[f64], workspace: &mut Workspace) -> Vec<Start> {
    let o = criterion.orders;
    let fitted = |label, b: &[f64], f: &[f64]| SystemCandidate {
        label,
        b: b.to_vec(),
        f: f.to_vec(),
        noise_models: NOISE_MODEL_COUNTS.0,
    };
    let mut systems = vec![fitted(
        "known system",
        &known[..o.nb],
        &known[o.parameter_count() - o.nf..],
    )];
    for nd in IV_NOISE_ORDERS {
        if let Some(system) = refined_system(criterion, nd) {
            systems.push(fitted("refined instruments", &system[o.nf..], &system[..o.nf]));
        }
    }
    systems.extend(best_grid_systems(criterion, workspace));
    let mut starts: Vec<Start> = (systems.iter())
        .flat_map(|system| starts_with_noise_models(criterion, system, workspace))
        .collect();
    starts.sort_by(|a, b| a.value.total_cmp(&b.value));
    starts
}

/// Returns the points of the pole grid with the smallest loss; each point has its own autoregression.
fn best_grid_systems(criterion: &Criterion<'_>, workspace: &mut Workspace) -> Vec<SystemCandidate> {
    let o = criterion.orders;
    let coloured = o.nc + o.nd > 0;
    let orders = Orders {
        nc: 0,
        nd: if coloured {
            o.nc + o.nd + EXTRA_NOISE_COEFFICIENTS
        } else {
            0
        },
        ..o
    };
    let ranking = Criterion {
        orders,
        initial: InitialState::Estimate,
        first: criterion.first.max(first_residual(&orders, InitialState::Estimate)),
        ..criterion.clone()
    };
    if ranking
        .data
        .iter()
        .any(|d| d.u.len() <= ranking.first + orders.parameter_count())
    {
        return Vec::new();
    }
    let mut places: Vec<Start> = (unit_disc_grid(o.nf).iter())
        .map(|f| {
            let mut place = Start::from_poles("pole grid", &orders, f);
            while let Some(block) = place.next_block() {
                let there = ranking.linearise_block(&place.theta, block, workspace);
                place.update(&orders, &there);
            }
            place
        })
        .filter(|place| place.value.is_finite())
        .collect();
    places.sort_by(|a, b| a.value.total_cmp(&b.value));
    let system = |place: &Start| SystemCandidate {
        label: "slow and fast poles",
        b: place.theta[..o.nb].to_vec(),
        f: place.theta[orders.parameter_count() - o.nf..].to_vec(),
        noise_models: NOISE_MODEL_COUNTS.1,
    };
    places.iter().take(GRID_SYSTEM_COUNT).map(system).collect()
}

/// Returns the best starts for a system, each with another noise model.
fn starts_with_noise_models(
    criterion: &Criterion<'_>,
    system: &SystemCandidate,
    workspace: &mut Workspace,
) -> Vec<Start> {
    let o = criterion.orders;
    let mut starts = Vec::new();
    for c in noise_zero_grid(o.nc) {
        let theta = [&system.b[..], &c, &vec![0.0; o.nd], &system.f].concat();
        if !criterion.is_feasible(&theta) {
            continue;
        }
        let left = if o.nd > 0 {
            vec![Block::B, Block::D]
        } else {
            vec![Block::B]
        };
        let mut start = Start::with_unknown(system.label, theta, left);
        while let Some(block) = start.next_block().filter(|_| criterion.is_feasible(&start.theta)) {
            let there = criterion.linearise_block(&start.theta, block, workspace);
            start.update(&o, &there);
        }
        if start.value.is_finite() && criterion.is_feasible(&start.theta) {
            starts.push(start);
        }
    }
    starts.sort_by(|a, b| a.value.total_cmp(&b.value));
    starts.truncate(system.noise_models);
    starts
}
