//! Starts of the search in physical parameters.
//!
//! 1. `grid`: first, delays every 0.04 s over their range with a typical neuromuscular system; then, at the best of
//!    these delays, frequencies and damping ratios in the range of human operators. The residual is affine in K_e and
//!    K_e_dot, so these are eliminated at each point; the noise model has a single fixed T_n. The points with the
//!    smallest loss are starts.
//! 2. `box-jenkins`: the operator that corresponds to a Box-Jenkins fit at the delay of the best grid point, if such an
//!    operator exists.
//! 3. `order m - 1`: the minimum for the previous order, if several orders are tried.
//!
//! For each order, T_n of a start is the best of a few values.

use hoid_model::{Record, Structure};

use crate::{Estimator, criterion::Workspace};

use super::{
    layout::{DELAY_SLOT, LEAD_SLOT, Layout, Lead, SLOT_COUNT, TIME_CONSTANT_SLOT},
    objective::PhysicalCriterion,
};

/// Spacing of the delays, s: a fraction of the period of the highest frequencies to which people respond.
const GRID_DELAY_S: f64 = 0.04;
/// Neuromuscular frequency for the ranking of the delays, rad/s.
const DEFAULT_OMEGA: f64 = 11.0;
/// Damping ratio for the ranking of the delays.
const DEFAULT_ZETA: f64 = 0.4;
/// Number of delays at which several frequencies and damping ratios are tried.
const BEST_DELAY_COUNT: usize = 2;
/// Neuromuscular frequencies of the grid, rad/s.
const GRID_OMEGA: [f64; 3] = [6.0, 11.0, 20.0];
/// Damping ratios of the grid.
const GRID_ZETA: [f64; 3] = [0.25, 0.7, 1.3];
/// Time constants of the remnant that are tried, s. The first is used for ranking the grid. A third-order filter has
/// another minimum below half a sample.
pub(crate) const GRID_TIME_CONSTANT_S: [f64; 6] = [0.1, 0.004, 0.012, 0.03, 0.06, 0.3];
/// Minimum number of delays if the range of delays is not a single value.
const MIN_DELAYS: usize = 3;

/// A start with a name, which is the same for all records: `[K_e, K_e_dot, omega_nm, zeta_nm, tau_e, T_n]`.
#[derive(Debug, Clone)]
pub(crate) struct Start {
    pub label: String,
    pub slots: [f64; SLOT_COUNT],
}

/// Returns a criterion for the same data in which all records have the same parameters, with K_e_dot as a coordinate.
pub(crate) fn common_parameter_criterion<'a>(
    criterion: &PhysicalCriterion<'a, Layout>,
    order: usize,
) -> PhysicalCriterion<'a, Layout> {
    let of_slot = |slot: usize| {
        let bounds = criterion
            .layout
            .slots
            .iter()
            .zip(&criterion.limits)
            .filter(|(s, _)| **s == slot);
        bounds.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, b)| {
            (low.min(b.0), high.max(b.1))
        })
    };
    let used = if order == 0 { TIME_CONSTANT_SLOT } else { SLOT_COUNT };
    let limits: Vec<(f64, f64)> = (0..used)
        .map(|slot| match slot {
            0 | LEAD_SLOT => (f64::NEG_INFINITY, f64::INFINITY),
            _ => of_slot(slot),
        })
        .collect();
    let layout = Layout {
        order,
        lead: Lead::RateGain,
        sample_time: criterion.layout.sample_time,
        positions: vec![std::array::from_fn(|slot| slot); criterion.data.len()],
        names: Vec::new(),
        limits,
        slots: (0..used).collect(),
    };
    PhysicalCriterion::new(layout, criterion.data.clone(), criterion.initial, criterion.first)
}

/// Returns the best grid points with their optimal gains: `starts` points with a positive lead and, if it is better
/// than all of them, the best point with a negative lead.
pub(crate) fn grid(criterion: &PhysicalCriterion<'_, Layout>, starts: usize, workspace: &mut Workspace) -> Vec<Start> {
    let scout = common_parameter_criterion(criterion, criterion.layout.order.min(1));
    let bounded = |slot: usize, value: f64| value.clamp(scout.limits[slot].0, scout.limits[slot].1);
    let (low, high) = scout.limits[DELAY_SLOT];
    let intervals = match high - low {
        width if width > 0.0 => ((width / GRID_DELAY_S).ceil() as usize).max(MIN_DELAYS - 1),
        _ => 0,
    };
    let t_n = if scout.layout.order == 0 {
        0.0
    } else {
        bounded(TIME_CONSTANT_SLOT, GRID_TIME_CONSTANT_S[0])
    };
    let delays: Vec<f64> = (0..=intervals)
        .map(|i| low + (high - low) * i as f64 / intervals.max(1) as f64)
        .collect();
    let mut ranked = |tau: f64, omega: f64, zeta: f64| {
        let (omega, zeta) = (bounded(2, omega), bounded(3, zeta));
        let mut slots = [0.0, 0.0, omega, zeta, tau, t_n];
        let value = scout.optimise_gains(&mut slots[..scout.limits.len()], workspace)?;
        let label = format!("grid tau_e {tau:.3} s, omega_nm {omega} rad/s, zeta_nm {zeta}");
        Some((Start { label, slots }, value))
    };
    let by_loss = |points: &mut Vec<(Start, f64)>| points.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut points: Vec<(Start, f64)> = delays
        .into_iter()
        .filter_map(|tau| ranked(tau, DEFAULT_OMEGA, DEFAULT_ZETA))
        .collect();
    by_loss(&mut points);
    let best: Vec<f64> = (select_starts(&points, BEST_DELAY_COUNT).iter())
        .map(|s| s.slots[DELAY_SLOT])
        .collect();
    for tau in best {
        for omega in GRID_OMEGA {
            points.extend(GRID_ZETA.iter().filter_map(|&zeta| ranked(tau, omega, zeta)));
        }
    }
    by_loss(&mut points);
    points.dedup_by(|a, b| a.0.label == b.0.label);
    select_starts(&points, starts)
}

/// Returns the first n points with a positive lead, and the first point of all if its lead is negative. A negative lead
/// with a shorter delay imitates the phase of an operator with a positive lead and causes a local minimum.
fn select_starts(points: &[(Start, f64)], n: usize) -> Vec<Start> {
    let has_lead = |s: &Start| s.slots[0] * s.slots[LEAD_SLOT] >= 0.0;
    let mut chosen: Vec<Start> = points
        .iter()
        .map(|(s, _)| s)
        .filter(|s| has_lead(s))
        .take(n)
        .cloned()
        .collect();
    chosen.extend(points.first().map(|(s, _)| s).filter(|s| !has_lead(s)).cloned());
    chosen
}

/// Returns the operator of a Box-Jenkins fit at the delay of `nearest`; `None` if the fit does not correspond to an
/// operator.
pub(crate) fn box_jenkins_start(
    records: &[Record],
    nearest: &Start,
    criterion: &PhysicalCriterion<'_, Layout>,
) -> Option<Start> {
    let ts = criterion.layout.sample_time.s();
    let nk = (nearest.slots[DELAY_SLOT] / ts).round() as usize + 1;
    let mut estimator = Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(nk));
    estimator.initial_state = Some(criterion.initial);
    estimator.search.tolerance = 1e-6;
    estimator.starts = 1;
    let o = estimator.fit(records).ok()?.operator().ok()?;
    let slots = [
        o.k_e.value,
        o.k_e_dot.value,
        o.omega_nm_rad_s.value,
        o.zeta_nm.value,
        nearest.slots[DELAY_SLOT],
        nearest.slots[TIME_CONSTANT_SLOT],
    ];
    (o.zeta_nm.value > 0.0).then(|| Start {
        label: format!("box-jenkins nk {nk}"),
        slots,
    })
}

/// Returns the start as an eta of this criterion, with the best of the given values of T_n.
pub(crate) fn complete(
    criterion: &PhysicalCriterion<'_, Layout>,
    start: &Start,
    time_constants_s: &[f64],
    workspace: &mut Workspace,
) -> Vec<f64> {
    let layout = &criterion.layout;
    let mut slots = start.slots;
    if layout.order > 0 {
        let scout = common_parameter_criterion(criterion, layout.order);
        let (low, high) = scout.limits[TIME_CONSTANT_SLOT];
        let tried = time_constants_s.iter().map(|&t| {
            let mut eta = start.slots.to_vec();
            eta[TIME_CONSTANT_SLOT] = t.clamp(low, high);
            let value = scout.optimise_gains(&mut eta, workspace);
            (eta, value.unwrap_or(f64::INFINITY))
        });
        if let Some((eta, value)) = tried.min_by(|a, b| a.1.total_cmp(&b.1))
            && value.is_finite()
        {
            slots.copy_from_slice(&eta);
        }
    }
    if layout.lead == Lead::Time {
        // If K_e is zero the lead time constant is not defined; one second is used.
        slots[LEAD_SLOT] = if slots[0] == 0.0 {
            1.0
        } else {
            slots[LEAD_SLOT] / slots[0]
        };
    }
    layout.common_eta(&slots)
}
