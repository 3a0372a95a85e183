//! Poles, delay and noise model for the starts of searches.
//!
//! For every form, one candidate is a single operator fitted to the response of a high-order ARX model for all records.
//! For a gain and a lead, further candidates come from Box-Jenkins fits to the first and the last third of the records;
//! if there is no candidate at all, a small grid of poles is used. Other forms always use a grid as well.

use hoid_model::{OperatorParameters, Orders, Record, Structure, operator_family::Coordinate};

use super::{layout::Layout, objective::ChangeCriterion};
use crate::{Estimator, Fit, SearchMethod, SearchOptions};

/// Step between the delays that are tried, s. A search converges if its initial delay is off by no more than a tenth of
/// the period of the poles.
const DELAY_STEP_S: f64 = 0.06;
/// Limits of the searches in the first and the last third of the records, whose results need not be exact.
const COARSE_SEARCH: SearchOptions = SearchOptions {
    method: SearchMethod::LevenbergMarquardt,
    max_iterations: 15,
    tolerance: 1e-6,
};
/// Poles of the grid: omega_nm in rad/s, zeta_nm.
const POLE_GRID: [(f64, f64); 3] = [(6.0, 0.4), (11.0, 0.4), (18.0, 0.4)];
/// Values of 1/T_I in the grid, 1/s.
const LAG_RATES: [f64; 3] = [0.05, 0.25, 1.2];
/// Coefficient d1 of candidates that do not come from a third of the records.
const GRID_D1: f64 = -0.8;

/// Poles, delay and noise model, stored in a theta without numerators and change.
#[derive(Debug, Clone)]
pub(super) struct PoleCandidate {
    pub label: String,
    pub theta: Vec<f64>,
}

/// Returns the candidates of the grid for a form of the operator family.
pub(super) fn family_grid_candidates(criterion: &ChangeCriterion<'_>) -> Vec<PoleCandidate> {
    let (layout, ts) = (&criterion.layout, criterion.sample_time.s());
    let muscles: &[(f64, f64)] = if layout.neuromuscular_indices.is_some() {
        &POLE_GRID
    } else {
        &[(0.0, 0.0)]
    };
    let rates: &[f64] = if layout.lag.is_some() { &LAG_RATES } else { &[0.0] };
    let mut all = Vec::new();
    for nk in delays(criterion) {
        for (omega, zeta) in muscles {
            for rate in rates {
                let mut theta = vec![0.0; layout.len()];
                if let Some(index) = layout.lag {
                    theta[index] = *rate;
                }
                if let Some([of_omega, of_zeta]) = layout.neuromuscular_indices {
                    (theta[of_omega], theta[of_zeta]) = (*omega, *zeta);
                }
                theta[layout.delay] = (nk - 1) as f64 * ts;
                if layout.nd > 0 {
                    theta[layout.noise] = GRID_D1;
                }
                clamp_to_limits(criterion, &mut theta);
                all.push(PoleCandidate {
                    label: format!("grid, tau_e = {:.3} s", theta[layout.delay]),
                    theta,
                });
            }
        }
    }
    all
}

/// Returns the candidate with the poles and the delay of one operator for all records, given by its coordinates.
pub(super) fn guess_candidate(criterion: &ChangeCriterion<'_>, coordinates: &[f64]) -> PoleCandidate {
    let layout = &criterion.layout;
    let mut theta = vec![0.0; layout.len()];
    let of_form = layout.form.coordinates(layout.neuromuscular);
    for (coordinate, value) in of_form.iter().zip(coordinates) {
        match coordinate {
            Coordinate::LagRate => layout.lag.into_iter().for_each(|index| theta[index] = *value),
            Coordinate::LogOmega => layout
                .neuromuscular_indices
                .into_iter()
                .for_each(|[omega, _]| theta[omega] = value.exp()),
            Coordinate::LogZeta => layout
                .neuromuscular_indices
                .into_iter()
                .for_each(|[_, zeta]| theta[zeta] = value.exp()),
            Coordinate::Delay => theta[layout.delay] = *value,
            _ => {}
        }
    }
    if layout.nd > 0 {
        theta[layout.noise] = GRID_D1;
    }
    clamp_to_limits(criterion, &mut theta);
    PoleCandidate {
        label: format!("one operator, tau_e = {:.3} s", theta[layout.delay]),
        theta,
    }
}

/// Returns the candidates from the first and the last third of the records.
pub(super) fn window_candidates(criterion: &ChangeCriterion<'_>, records: &[Record]) -> Vec<PoleCandidate> {
    let third = |record: &Record, part: usize| {
        let (from, to) = (record.time_s(0), record.time_s(record.len()));
        let length = (to - from) / 3.0;
        record
            .span(from + part as f64 * length, from + (part + 1) as f64 * length)
            .ok()
    };
    let mut found = Vec::new();
    for (part, name) in [(0, "first"), (2, "last")] {
        let windows: Option<Vec<Record>> = records.iter().map(|r| third(r, part)).collect();
        let Some(windows) = windows else { continue };
        // Each fit starts from the model for the previous delay.
        let mut fits: Vec<Fit> = Vec::new();
        for nk in delays(criterion) {
            let before = fits.last().map(|f| f.model().theta().to_vec());
            fits.extend(fit(criterion, &windows, nk, before));
        }
        let Some(best) = fits.into_iter().min_by(|a, b| a.loss().total_cmp(&b.loss())) else {
            continue;
        };
        if let Ok(operator) = best.operator() {
            let (orders, theta) = (best.orders(), best.model().theta());
            found.push(PoleCandidate {
                label: format!("{name} third, nk = {}", orders.nk),
                theta: frozen_theta(
                    criterion,
                    &operator.parameters(),
                    &theta[orders.nb..orders.nb + orders.nd],
                ),
            });
        }
    }
    found
}

fn fit(criterion: &ChangeCriterion<'_>, windows: &[Record], nk: usize, start: Option<Vec<f64>>) -> Option<Fit> {
    let orders = Orders {
        nb: 2,
        nd: criterion.layout.nd,
        nf: 2,
        nk,
        ..Orders::default()
    };
    let estimator = Estimator {
        starts: 1,
        search: COARSE_SEARCH,
        start,
        ..Estimator::new(Structure::BoxJenkins, orders)
    };
    // Only a model that corresponds to an operator gives poles.
    estimator.fit(windows).ok().filter(|fit| fit.operator().is_ok())
}

/// Returns the candidates of the grid for a gain and a lead.
pub(super) fn grid_candidates(criterion: &ChangeCriterion<'_>) -> Vec<PoleCandidate> {
    let ts = criterion.sample_time.s();
    let mut d = vec![0.0; criterion.layout.nd];
    if let Some(d1) = d.first_mut() {
        *d1 = GRID_D1;
    }
    let mut all = Vec::new();
    for nk in delays(criterion) {
        for (omega, zeta) in POLE_GRID {
            let operator = OperatorParameters {
                k_e: 0.0,
                t_l_s: 0.0,
                omega_nm_rad_s: omega,
                zeta_nm: zeta,
                tau_e_s: (nk - 1) as f64 * ts,
            };
            all.push(PoleCandidate {
                label: format!("grid, nk = {nk}, omega_nm = {omega} rad/s"),
                theta: frozen_theta(criterion, &operator, &d),
            });
        }
    }
    all
}

/// Returns the values of nk to be tried, from the shortest to the longest delay.
fn delays(criterion: &ChangeCriterion<'_>) -> Vec<usize> {
    let ts = criterion.sample_time.s();
    let (low, high) = criterion.limits[criterion.layout.delay];
    let nk = |tau: f64| (tau / ts).round() as usize + 1;
    let step = (DELAY_STEP_S / ts).round().max(1.0) as usize;
    (nk(low)..=nk(high)).step_by(step).collect()
}

fn frozen_theta(criterion: &ChangeCriterion<'_>, operator: &OperatorParameters, d: &[f64]) -> Vec<f64> {
    let layout: &Layout = &criterion.layout;
    let mut theta = vec![0.0; layout.len()];
    if let Some([omega, zeta]) = layout.neuromuscular_indices {
        (theta[omega], theta[zeta]) = (operator.omega_nm_rad_s, operator.zeta_nm);
    }
    theta[layout.delay] = operator.tau_e_s;
    theta[layout.noise..].copy_from_slice(d);
    clamp_to_limits(criterion, &mut theta);
    theta
}

fn clamp_to_limits(criterion: &ChangeCriterion<'_>, theta: &mut [f64]) {
    for (t, (low, high)) in theta.iter_mut().zip(&criterion.limits) {
        *t = t.max(*low).min(*high);
    }
}
