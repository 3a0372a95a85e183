//! Automatic starts of the search.
//!
//! Poles, delay and noise model come from [`super::start_dynamics`]. If these, t_M and G are given, the residual is
//! linear in the coefficients of the numerator before and after the change, provided that each coefficient follows the
//! sigmoid. Pairs of t_M and G are therefore ranked by least squares ([`super::ranking`]): first a grid of t_M for a
//! slow, a moderate and an abrupt change, then successively halved steps of t_M around the best point of each.

use hoid_model::{Form, Record};

use super::{
    objective::ChangeCriterion,
    ranking::Ranking,
    start_dynamics::{PoleCandidate, family_grid_candidates, grid_candidates, guess_candidate, window_candidates},
};
use crate::family::noise::NoiseProducts;

/// Rates G of the grid, 1/s.
const RATES: [f64; 3] = [0.5, 5.0, 100.0];
/// Number of times t_M in the grid.
const MIDPOINT_COUNT: usize = 12;
/// Largest number of delays of the grid for which starts are made, each with its best poles: a search corrects poles
/// more easily than delays.
const MAX_DELAYS: usize = 4;

/// A start with its label.
#[derive(Debug, Clone)]
pub(crate) struct Start {
    pub label: String,
    pub theta: Vec<f64>,
    rank: f64,
}

/// Returns the starts, best first: one for each rate or, for forms other than a gain and a lead, one for each rate and
/// each of the best delays. `guess` contains the coordinates of one operator for all records.
pub(crate) fn initial_guesses(
    criterion: &ChangeCriterion<'_>,
    records: &[Record],
    guess: Option<&[f64]>,
) -> Vec<Start> {
    let (low, high) = criterion.limits[criterion.layout.log_rate];
    let mut rates: Vec<f64> = RATES.iter().map(|g| g.ln().clamp(low, high)).collect();
    rates.dedup();
    // The best poles for the medium rate are used for all rates.
    let middling = rates[rates.len() / 2];
    let guessed = guess.map(|guess| guess_candidate(criterion, guess));
    let frozen = match criterion.layout.form {
        Form::Lead => {
            let mut frozen = window_candidates(criterion, records);
            frozen.extend(guessed.and_then(|guess| with_noise(criterion, guess, middling)));
            if frozen.is_empty() {
                frozen = grid_candidates(criterion);
            }
            let ranked = frozen
                .into_iter()
                .filter_map(|f| Some((best_on_grid(criterion, &f, middling)?.0, f)));
            ranked.min_by(|a, b| a.0.total_cmp(&b.0)).into_iter().collect()
        }
        _ => best_family_candidates(criterion, guessed, middling),
    };
    let mut starts: Vec<Start> = frozen
        .iter()
        .flat_map(|(_, chosen)| {
            let starts = rates.iter().map(|rate| best_midpoint(criterion, chosen, *rate));
            starts.flatten().collect::<Vec<_>>()
        })
        .collect();
    starts.sort_by(|a, b| a.rank.total_cmp(&b.rank));
    starts
}

/// Returns the best candidate for each of the best delays, from a grid and a guess, each with the noise model of its
/// residuals.
fn best_family_candidates(
    criterion: &ChangeCriterion<'_>,
    guessed: Option<PoleCandidate>,
    log_rate: f64,
) -> Vec<(f64, PoleCandidate)> {
    let ranked = |frozen: PoleCandidate| Some((best_on_grid(criterion, &frozen, log_rate)?.0, frozen));
    let grid = family_grid_candidates(criterion).into_iter().chain(guessed);
    let mut all: Vec<(f64, PoleCandidate)> = grid.filter_map(ranked).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let delay = |frozen: &PoleCandidate| frozen.theta[criterion.layout.delay];
    let mut tried: Vec<f64> = Vec::new();
    all.retain(|(_, frozen)| {
        let is_new = !tried.contains(&delay(frozen));
        tried.push(delay(frozen));
        is_new
    });
    all.truncate(MAX_DELAYS);
    let noise = |(rank, frozen): (f64, PoleCandidate)| Some((rank, with_noise(criterion, frozen, log_rate)?));
    all.into_iter().filter_map(noise).collect()
}

/// Adds the noise model of the part of u that the best operator with these poles does not explain; `None` if no
/// numerator can be computed for these poles.
fn with_noise(criterion: &ChangeCriterion<'_>, mut frozen: PoleCandidate, log_rate: f64) -> Option<PoleCandidate> {
    let (nd, noise) = (criterion.layout.nd, criterion.layout.noise);
    let (_, theta, ranking) = best_on_grid(criterion, &frozen, log_rate)?;
    let series = ranking.unexplained_output(&theta)?;
    if let Some(found) = NoiseProducts::new(&series, nd).fit(nd) {
        frozen.theta[noise..].copy_from_slice(&found.d);
    }
    Some(frozen)
}

/// Returns a start for the model without a change, with the poles, the delay and the noise model of the model with a
/// change.
pub(crate) fn start_without_change(criterion: &ChangeCriterion<'_>, theta: &[f64]) -> Vec<f64> {
    let mut theta = theta.to_vec();
    if let Some(ranking) = Ranking::new(criterion, &theta)
        && let Some((_, values)) = ranking.best_gains(None)
    {
        theta[..values.len()].copy_from_slice(&values);
    }
    theta
}

/// Returns the sum of squares and theta at this t_M, with the best numerators before and after the change.
fn rank_at(ranking: &Ranking<'_, '_>, theta: &[f64], t_m: f64) -> Option<(f64, Vec<f64>)> {
    let mut there = theta.to_vec();
    there[ranking.criterion.layout.midpoint] = t_m;
    let (rank, values) = ranking.best_gains(Some(&there))?;
    there[..values.len()].copy_from_slice(&values);
    Some((rank, there))
}

/// Returns the distance between neighbouring t_M of the grid, s.
fn grid_step(criterion: &ChangeCriterion<'_>) -> f64 {
    let (low, high) = criterion.limits[criterion.layout.midpoint];
    (high - low) / MIDPOINT_COUNT as f64
}

/// Returns the sum of squares and theta at the best t_M of the grid for the given ln G, and the ranking used.
fn best_on_grid<'c, 'a>(
    criterion: &'c ChangeCriterion<'a>,
    frozen: &PoleCandidate,
    log_rate: f64,
) -> Option<(f64, Vec<f64>, Ranking<'c, 'a>)> {
    let mut theta = frozen.theta.clone();
    theta[criterion.layout.log_rate] = log_rate;
    let ranking = Ranking::new(criterion, &theta)?;
    let (low, high) = criterion.limits[criterion.layout.midpoint];
    let count = if low < high { MIDPOINT_COUNT } else { 1 };
    let grid = (0..count).filter_map(|i| rank_at(&ranking, &theta, low + (i as f64 + 0.5) * grid_step(criterion)));
    let (rank, best) = grid.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((rank, best, ranking))
}

/// Returns the start with the best t_M for the given ln G.
fn best_midpoint(criterion: &ChangeCriterion<'_>, frozen: &PoleCandidate, log_rate: f64) -> Option<Start> {
    let (rank, theta, ranking) = best_on_grid(criterion, frozen, log_rate)?;
    let (low, high) = criterion.limits[criterion.layout.midpoint];
    let (mut best, mut step) = ((rank, theta), grid_step(criterion));
    // t_M is refined to a tenth of the width of the change, or to one sample if that is longer.
    let finest = (0.1 * (-log_rate).exp()).max(criterion.sample_time.s());
    while step > finest {
        step *= 0.5;
        let t_m = best.1[criterion.layout.midpoint];
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
            theta[criterion.layout.midpoint]
        ),
        theta,
        rank,
    })
}
