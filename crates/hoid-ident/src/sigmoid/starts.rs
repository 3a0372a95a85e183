//! The starts of the search where none is given.
//!
//! Poles, delay and noise model come from Box-Jenkins fits to the first and the last third of the
//! records; where those give no operator, from a small grid of poles. With these and t_M and G
//! given the residual is linear in the gains at both ends (K_e_dot following the sigmoid, which it
//! does at both ends), so that pairs of t_M and G are ranked by least squares: a grid of t_M for a
//! slow, a middling and an abrupt change, then halved steps of t_M around the best of each.

use hoid_model::{OperatorParameters, Orders, Record, Structure};

use super::{
    layout::{DELAY, Instant, LOG_RATE, MIDPOINT, NOISE, OMEGA, ZETA},
    objective::{ChangeCriterion, UnitOperator},
};
use crate::{
    Estimator, Fit, SearchMethod, SearchOptions,
    linalg::least_squares::{add_scaled, dot, solve_symmetric},
};

/// Rates of the grid, 1/s.
const RATES: [f64; 3] = [0.5, 5.0, 100.0];
/// Times of the change in the grid.
const MIDPOINTS: usize = 12;
/// Time between the delays that are tried, s: the search finds its way from a distance of a tenth
/// of the period of the poles.
const DELAY_STEP_S: f64 = 0.06;
/// Searches in the windows: a start need not be exact.
const COARSE: SearchOptions = SearchOptions {
    method: SearchMethod::LevenbergMarquardt,
    max_iterations: 15,
    tolerance: 1e-6,
};
/// Poles where the windows give none: omega_nm in rad/s, zeta_nm.
const GRID: [(f64, f64); 3] = [(6.0, 0.4), (11.0, 0.4), (18.0, 0.4)];
/// d1 where the windows give none.
const GRID_D1: f64 = -0.8;
/// Time constants of the poles that pass before residuals are ranked.
const SETTLING: f64 = 4.0;

/// A start and the words for it.
#[derive(Debug, Clone)]
pub(crate) struct Start {
    pub label: String,
    pub theta: Vec<f64>,
    rank: f64,
}

/// Poles, delay and noise model.
#[derive(Debug, Clone)]
struct Frozen {
    label: String,
    theta: Vec<f64>,
}

/// Starts, the best first: one for each rate.
pub(crate) fn initial_guesses(criterion: &ChangeCriterion<'_>, records: &[Record]) -> Vec<Start> {
    let mut frozen = of_windows(criterion, records);
    if frozen.is_empty() {
        frozen = of_grid(criterion);
    }
    let (low, high) = criterion.limits[LOG_RATE];
    let mut rates: Vec<f64> = RATES.iter().map(|g| g.ln().clamp(low, high)).collect();
    rates.dedup();
    // The poles that do best with the middling rate serve all.
    let middling = rates[rates.len() / 2];
    let ranked = frozen
        .iter()
        .filter_map(|f| Some((f, on_grid(criterion, f, middling)?.0)));
    let Some((chosen, _)) = ranked.min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return Vec::new();
    };
    let mut starts: Vec<Start> = rates
        .into_iter()
        .filter_map(|rate| best_midpoint(criterion, chosen, rate))
        .collect();
    starts.sort_by(|a, b| a.rank.total_cmp(&b.rank));
    starts
}

/// The start of the model without a change, from the poles, the delay and the noise model of the
/// other.
pub(crate) fn without_change(criterion: &ChangeCriterion<'_>, theta: &[f64]) -> Vec<f64> {
    let mut theta = theta.to_vec();
    if let Some(ranking) = Ranking::new(criterion, &theta)
        && let Some((_, [k_e, _, k_e_dot, _])) = ranking.best_gains(None)
    {
        set_gains(&mut theta, [k_e, k_e, k_e_dot, k_e_dot]);
    }
    theta
}

fn of_windows(criterion: &ChangeCriterion<'_>, records: &[Record]) -> Vec<Frozen> {
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
        // Each delay goes on from the model of the one before.
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
            found.push(Frozen {
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
        nd: criterion.nd,
        nf: 2,
        nk,
        ..Orders::default()
    };
    let estimator = Estimator {
        starts: 1,
        search: COARSE,
        start,
        ..Estimator::new(Structure::BoxJenkins, orders)
    };
    // Only models that are operators have poles to give.
    estimator.fit(windows).ok().filter(|fit| fit.operator().is_ok())
}

fn of_grid(criterion: &ChangeCriterion<'_>) -> Vec<Frozen> {
    let ts = criterion.sample_time.s();
    let mut d = vec![0.0; criterion.nd];
    if let Some(d1) = d.first_mut() {
        *d1 = GRID_D1;
    }
    let mut all = Vec::new();
    for nk in delays(criterion) {
        for (omega, zeta) in GRID {
            let operator = OperatorParameters {
                k_e: 0.0,
                t_l_s: 0.0,
                omega_nm_rad_s: omega,
                zeta_nm: zeta,
                tau_e_s: (nk - 1) as f64 * ts,
            };
            all.push(Frozen {
                label: format!("grid, nk = {nk}, omega_nm = {omega} rad/s"),
                theta: frozen_theta(criterion, &operator, &d),
            });
        }
    }
    all
}

/// nk from the shortest to the longest delay.
fn delays(criterion: &ChangeCriterion<'_>) -> Vec<usize> {
    let ts = criterion.sample_time.s();
    let (low, high) = criterion.limits[DELAY];
    let nk = |tau: f64| (tau / ts).round() as usize + 1;
    let step = (DELAY_STEP_S / ts).round().max(1.0) as usize;
    (nk(low)..=nk(high)).step_by(step).collect()
}

fn frozen_theta(criterion: &ChangeCriterion<'_>, operator: &OperatorParameters, d: &[f64]) -> Vec<f64> {
    let mut theta = vec![0.0; NOISE + criterion.nd];
    theta[OMEGA] = operator.omega_nm_rad_s;
    theta[ZETA] = operator.zeta_nm;
    theta[DELAY] = operator.tau_e_s;
    theta[NOISE..].copy_from_slice(d);
    for (t, (low, high)) in theta.iter_mut().zip(&criterion.limits) {
        *t = t.max(*low).min(*high);
    }
    theta
}

/// Rank and theta for one change, the gains being best.
fn rank_at(ranking: &Ranking<'_, '_>, theta: &[f64], t_m: f64) -> Option<(f64, Vec<f64>)> {
    let mut there = theta.to_vec();
    there[MIDPOINT] = t_m;
    let (rank, gains) = ranking.best_gains(Some(&there))?;
    set_gains(&mut there, gains);
    Some((rank, there))
}

/// Time between two points of the grid of t_M.
fn grid_step(criterion: &ChangeCriterion<'_>) -> f64 {
    let (low, high) = criterion.limits[MIDPOINT];
    (high - low) / MIDPOINTS as f64
}

/// The best t_M of the grid for the given ln G.
fn on_grid<'c, 'a>(
    criterion: &'c ChangeCriterion<'a>,
    frozen: &Frozen,
    log_rate: f64,
) -> Option<(f64, Vec<f64>, Ranking<'c, 'a>)> {
    let mut theta = frozen.theta.clone();
    theta[LOG_RATE] = log_rate;
    let ranking = Ranking::new(criterion, &theta)?;
    let (low, high) = criterion.limits[MIDPOINT];
    let count = if low < high { MIDPOINTS } else { 1 };
    let grid = (0..count).filter_map(|i| rank_at(&ranking, &theta, low + (i as f64 + 0.5) * grid_step(criterion)));
    let (rank, best) = grid.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((rank, best, ranking))
}

/// The best t_M for the given ln G.
fn best_midpoint(criterion: &ChangeCriterion<'_>, frozen: &Frozen, log_rate: f64) -> Option<Start> {
    let (rank, theta, ranking) = on_grid(criterion, frozen, log_rate)?;
    let (low, high) = criterion.limits[MIDPOINT];
    let (mut best, mut step) = ((rank, theta), grid_step(criterion));
    // To a tenth of the width of the change, or a sample.
    let finest = (0.1 * (-log_rate).exp()).max(criterion.sample_time.s());
    while step > finest {
        step *= 0.5;
        let t_m = best.1[MIDPOINT];
        for there in [t_m - step, t_m + step] {
            if (low..=high).contains(&there)
                && let Some(found) = rank_at(&ranking, &best.1, there)
                && found.0 < best.0
            {
                best = found;
            }
        }
    }
    let (rank, theta) = best;
    Some(Start {
        label: format!(
            "{}; G = {:.3} 1/s, t_M = {:.2} s",
            frozen.label,
            log_rate.exp(),
            theta[MIDPOINT]
        ),
        theta,
        rank,
    })
}

/// Gains at both ends; a gain of zero has no lead time.
fn set_gains(theta: &mut [f64], [k_e1, k_e2, k_e_dot1, k_e_dot2]: [f64; 4]) {
    let lead = |rate: f64, gain: f64| if gain == 0.0 { 0.0 } else { rate / gain };
    theta[..4].copy_from_slice(&[k_e1, k_e2, lead(k_e_dot1, k_e1), lead(k_e_dot2, k_e2)]);
}

/// Responses for given poles, delay and noise model, from which the best gains follow for any
/// change.
struct Ranking<'c, 'a> {
    criterion: &'c ChangeCriterion<'a>,
    theta: Vec<f64>,
    /// For each record: first sample that counts, y1 and y2 and u from nd samples before it on.
    signals: Vec<(usize, [Vec<f64>; 3])>,
}

impl<'c, 'a> Ranking<'c, 'a> {
    fn new(criterion: &'c ChangeCriterion<'a>, theta: &[f64]) -> Option<Self> {
        let unit = UnitOperator::of(theta, None, criterion.sample_time)?;
        let (ts, decay) = (criterion.sample_time.s(), theta[OMEGA] * theta[ZETA]);
        let mut signals = Vec::with_capacity(criterion.data.len());
        for data in &criterion.data {
            let n = data.u.len();
            let settled = ((SETTLING / (decay * ts)) as usize).min(n / 8);
            let first = criterion.first + settled;
            if first >= n || unit.nk > first - criterion.nd {
                return None;
            }
            let from = first - criterion.nd;
            let y = |i: usize| unit.response(i, &data.e[..n - unit.nk])[from - unit.nk..].to_vec();
            signals.push((first, [y(0), y(1), data.u[from..].to_vec()]));
        }
        Some(Self {
            criterion,
            theta: theta.to_vec(),
            signals,
        })
    }

    /// Sum of squares and `[K_e1, K_e2, K_e_dot1, K_e_dot2]` of least squares for the change of
    /// `theta`; without one, the gains of either end are the same.
    fn best_gains(&self, change: Option<&[f64]>) -> Option<(f64, [f64; 4])> {
        let columns_count = if change.is_some() { 4 } else { 2 };
        let mut gram = vec![0.0; columns_count * columns_count];
        let mut rhs = vec![0.0; columns_count];
        let mut power = 0.0;
        for ((first, [y1, y2, u]), data) in self.signals.iter().zip(&self.criterion.data) {
            let columns: Vec<Vec<f64>> = match change {
                None => vec![self.whitened(y1), self.whitened(y2)],
                Some(theta) => {
                    let from = first - self.criterion.nd;
                    let ts = self.criterion.sample_time.s();
                    let share: Vec<f64> = (0..u.len())
                        .map(|k| Instant::at(theta, data.start_s + (from + k) as f64 * ts - theta[DELAY]).share)
                        .collect();
                    let split = |y: &[f64]| -> [Vec<f64>; 2] {
                        let last: Vec<f64> = y.iter().zip(&share).map(|(y, s)| s * y).collect();
                        let initial: Vec<f64> = y.iter().zip(&last).map(|(y, l)| y - l).collect();
                        [self.whitened(&initial), self.whitened(&last)]
                    };
                    split(y1).into_iter().chain(split(y2)).collect()
                }
            };
            let target = self.whitened(u);
            power += dot(&target, &target);
            for i in 0..columns_count {
                rhs[i] += dot(&columns[i], &target);
                for j in 0..=i {
                    let product = dot(&columns[i], &columns[j]);
                    gram[i * columns_count + j] += product;
                    if i != j {
                        gram[j * columns_count + i] += product;
                    }
                }
            }
        }
        let gains = solve_symmetric(&gram, &rhs)?;
        let rank = power - dot(&gains, &rhs);
        let all = match *gains.as_slice() {
            [k_e, k_e_dot] => [k_e, k_e, k_e_dot, k_e_dot],
            [k_e1, k_e2, k_e_dot1, k_e_dot2] => [k_e1, k_e2, k_e_dot1, k_e_dot2],
            _ => return None,
        };
        (rank.is_finite() && all.iter().all(|g| g.is_finite())).then_some((rank, all))
    }

    fn whitened(&self, x: &[f64]) -> Vec<f64> {
        let nd = self.criterion.nd;
        let mut y = x[nd..].to_vec();
        for (i, &d) in self.theta[NOISE..].iter().enumerate() {
            add_scaled(&mut y, d, &x[nd - 1 - i..x.len() - 1 - i]);
        }
        y
    }
}
