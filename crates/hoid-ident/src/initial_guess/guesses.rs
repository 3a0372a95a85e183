//! Automatic starts of the Box-Jenkins search.
//!
//! The poles are decisive: given F, the model is linear in B, and given B and F, the noise model is a linear
//! autoregression. Each start is therefore a candidate for F that is completed by linear least squares:
//!
//! 1. `low-pass continuation`: the minimum on the averaged records ([`crate::initial_guess::continuation`]), searched
//!    from the pole grid.
//! 2. `pole grid`, if the records are too short for the continuation: for two or more poles, neuromuscular frequencies
//!    from 3 to 24 rad/s with damping ratios 0.25 and 0.7, the range of human operators, converted with the exact
//!    zero-order hold.
//! 3. `steiglitz-mcbride`: ARX fits to input and output filtered by 1/F of the previous step, repeated a few times (K.
//!    Steiglitz and L. E. McBride, *IEEE Trans. Automatic Control* 10 (1965) 461-464). The `arx` poles themselves are
//!    strongly biased if the noise poles differ from the system poles (with a first-order remnant filter, a2 is
//!    estimated near 0); they are used only if the iteration fails.
//! 4. `high-order arx`: an ARX model with additional poles for the noise; F is fitted to its noise-free response by the
//!    Steiglitz-McBride iteration (B. Wahlberg, *Automatica* 25 (1989) 829-841, in its simplest form).
//! 5. `instruments`: ARX, two estimates with instrumental variables, and C and D from the residual ([`crate::iv`]).
//!
//! The last three are used only if the low-pass continuation has a pole that is not slow compared with the averaging;
//! otherwise the averaged records determine the poles nearly as well as the original records do. The candidates are
//! ranked by their loss with the initial states eliminated. Searches start from the best candidates, and the best
//! minimum is used. Short records and larger models have more minima than these starts find; for them, other starts are
//! tried afterwards ([`crate::initial_guess::broad_starts`]).

use hoid_model::{Orders, SampleTime, polynomial::reflect_roots_inside};

use super::{
    arx_poles::{arx_poles, reduced_arx, steiglitz_mcbride},
    continuation::{self, SlowPoles},
    instrument_chain::instrument_chain,
    pole_grid::pole_grid,
    shared_poles,
};
use crate::{
    criterion::{Criterion, InitialState, Workspace},
    multistart::Start,
    noise_model::noise_model,
    optimize::Objective,
};

/// Number of candidates that are completed with their own noise model.
const COMPLETED_CANDIDATE_COUNT: usize = 4;

/// Returns the starts, each with the polynomials that are still unknown.
pub(crate) fn initial_guesses(
    criterion: &Criterion<'_>,
    sample_time: SampleTime,
    workspace: &mut Workspace,
) -> Vec<Start> {
    let slow = continuation::slow_poles(criterion, sample_time, workspace);
    initial_guesses_with_poles(slow, criterion, sample_time, workspace)
}

/// Returns the starts, like [`initial_guesses`], for known poles from the averaged records.
pub(crate) fn initial_guesses_with_poles(
    slow: SlowPoles,
    criterion: &Criterion<'_>,
    sample_time: SampleTime,
    workspace: &mut Workspace,
) -> Vec<Start> {
    let starts = starts_from_poles(slow, criterion, sample_time, workspace);
    if shared_poles::may_share_poles(&criterion.orders) {
        return shared_poles::initial_guesses(criterion, starts, workspace);
    }
    starts
}

/// Returns the starts from all candidates for F, or for a model without F.
fn starts_from_poles(
    slow: SlowPoles,
    criterion: &Criterion<'_>,
    sample_time: SampleTime,
    workspace: &mut Workspace,
) -> Vec<Start> {
    if criterion.orders.nb == 0 {
        return time_series_starts(criterion, workspace);
    }
    if criterion.orders.nf == 0 {
        return completed_starts(criterion, vec![("linear".to_owned(), Vec::new())], workspace);
    }
    let mut proposals: Vec<(String, Vec<f64>)> = slow
        .f
        .into_iter()
        .map(|f| ("low-pass continuation".to_owned(), f))
        .collect();
    if proposals.is_empty() {
        proposals = ranked_grid(criterion, sample_time, COMPLETED_CANDIDATE_COUNT, workspace);
    }
    if !slow.complete
        && let Some(f) = arx_poles(criterion, &criterion.data, workspace)
    {
        match steiglitz_mcbride(criterion, f.clone(), workspace) {
            Some(better) => proposals.push(("steiglitz-mcbride".to_owned(), better)),
            None => proposals.push(("arx".to_owned(), f)),
        }
        if let Some(f) = reduced_arx(criterion, workspace) {
            proposals.push(("high-order arx".to_owned(), f));
        }
    }
    let mut starts = completed_starts(criterion, proposals, workspace);
    if !slow.complete
        && let Some(mut theta) = instrument_chain(criterion).filter(|theta| criterion.is_feasible(theta))
        && let Some((linear, value)) = criterion.best_linear_part(&theta, workspace)
    {
        theta[..linear.len()].copy_from_slice(&linear);
        starts.push(Start::complete("instruments", theta, value));
    }
    starts
}

/// Returns one start for each candidate for F. If the model has A or C, or if the initial state is backcast, A, B and
/// the noise model of each start are computed here; otherwise they are still unknown.
fn completed_starts(
    criterion: &Criterion<'_>,
    proposals: Vec<(String, Vec<f64>)>,
    workspace: &mut Workspace,
) -> Vec<Start> {
    let o = &criterion.orders;
    let in_steps = o.na + o.nc == 0 && criterion.initial != InitialState::Backcast;
    proposals
        .into_iter()
        .filter_map(|(label, f)| {
            if in_steps {
                return Some(Start::from_poles(&label, o, &f));
            }
            let (theta, value) = complete(criterion, &f, workspace)?;
            Some(Start::complete(&label, theta, value))
        })
        .collect()
}

/// Returns the points of the pole grid, best first. All points are ranked with the noise model of the first point,
/// which takes one pass over the data for each point.
fn ranked_grid(
    criterion: &Criterion<'_>,
    sample_time: SampleTime,
    count: usize,
    workspace: &mut Workspace,
) -> Vec<(String, Vec<f64>)> {
    let o = &criterion.orders;
    let grid = pole_grid(o.nf, sample_time);
    let Some((reference, _)) = grid.iter().find_map(|(_, f)| complete(criterion, f, workspace)) else {
        return Vec::new();
    };
    let mut ranked: Vec<(String, Vec<f64>, f64)> = grid
        .into_iter()
        .filter_map(|(label, f)| {
            let mut theta = reference.clone();
            theta[o.parameter_count() - o.nf..].copy_from_slice(&f);
            let (_, value) = criterion.best_linear_part(&theta, workspace)?;
            Some((label, f, value))
        })
        .collect();
    ranked.sort_by(|a, b| a.2.total_cmp(&b.2));
    ranked.into_iter().take(count).map(|(label, f, _)| (label, f)).collect()
}

/// Returns theta and the sum of squares for a given F: A and B by least squares, the noise model by an autoregression
/// of the residual, and A and B again with this noise model. If the model has A, the last two steps are repeated, since
/// A and the noise model depend on each other (generalised least squares; D. W. Clarke, *IFAC Symposium on
/// Identification*, Prague 1967).
fn complete(criterion: &Criterion<'_>, f: &[f64], workspace: &mut Workspace) -> Option<(Vec<f64>, f64)> {
    let o = criterion.orders;
    let linear = o.na + o.nb;
    let white = Criterion {
        orders: Orders { nc: 0, nd: 0, ..o },
        ..criterion.clone()
    };
    let mut start = vec![0.0; linear];
    start.extend_from_slice(f);
    let (mut best, mut value) = white.best_linear_part(&start, workspace)?;
    if o.nc + o.nd == 0 {
        best.extend_from_slice(f);
        return Some((best, value));
    }
    let mut theta = Vec::new();
    let rounds = if o.na == 0 { 1 } else { 4 };
    for _ in 0..rounds {
        start[..linear].copy_from_slice(&best);
        let left: Vec<Vec<f64>> = white
            .data
            .iter()
            .enumerate()
            .map(|(index, _)| white.residuals_of(&start, index, workspace))
            .collect();
        let (c, d) = noise_model(&left, o.nc, o.nd);
        theta.clone_from(&best);
        theta.extend(c);
        theta.extend(d);
        theta.extend_from_slice(f);
        (best, value) = criterion.best_linear_part(&theta, workspace)?;
        theta[..linear].copy_from_slice(&best);
    }
    Some((theta, value))
}

/// Returns starts for a model of the output alone, `u = (C/A) eps`. The first start has A and C from the
/// Hannan-Rissanen method; A and C partly cancel if roots of C are near the unit circle and the long autoregression is
/// too short. The other starts have A from an autoregression, with the same C and with C = 1.
fn time_series_starts(criterion: &Criterion<'_>, workspace: &mut Workspace) -> Vec<Start> {
    let o = criterion.orders;
    let outputs: Vec<Vec<f64>> = criterion.data.iter().map(|d| d.u.to_vec()).collect();
    let (c, a) = noise_model(&outputs, o.nc, o.na);
    let mut proposals = vec![("hannan-rissanen", a, c.clone())];
    if o.na > 0 && o.nc > 0 {
        let (_, alone) = noise_model(&outputs, 0, o.na);
        proposals.push(("autoregression", alone.clone(), c));
        proposals.push(("autoregression, C = 1", alone, vec![0.0; o.nc]));
    }
    let start = |(label, a, c): (&str, Vec<f64>, Vec<f64>)| {
        let mut theta = if o.na > 0 { reflect_roots_inside(&a)? } else { a };
        theta.extend(c);
        let value = criterion.linearise(&theta, workspace).sum_of_squares;
        Some(Start::complete(label, theta, value))
    };
    proposals.into_iter().filter_map(start).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::criterion::{Data, first_residual};

    /// Returns white e, and `u = (B/F) q^-1 e + v`, where v is noise with separate poles.
    fn record(n: usize, noise: f64) -> (Vec<f64>, Vec<f64>) {
        let mut state = 11_u64;
        let mut draw = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let e: Vec<f64> = (0..n).map(|_| draw()).collect();
        let (mut w, mut v) = (vec![0.0; 3], 0.0);
        let mut u = vec![0.0; 3];
        for t in 3..n {
            w.push(1.5 * w[t - 1] - 0.7 * w[t - 2] + e[t - 1] + 0.5 * e[t - 2]);
            v = 0.9 * v + noise * draw();
            u.push(w[t] + v);
        }
        (e, u)
    }

    #[test]
    fn reduced_high_order_model_finds_the_poles() {
        let (e, u) = record(4000, 0.5);
        let orders = Orders {
            nb: 2,
            nd: 1,
            nf: 2,
            nk: 1,
            ..Orders::default()
        };
        let criterion = Criterion {
            orders,
            data: vec![Data::new(&e, &u)],
            initial: InitialState::Estimate,
            first: first_residual(&orders, InitialState::Estimate),
            weights: None,
            further: Vec::new(),
        };
        let mut workspace = Workspace::default();
        let arx = arx_poles(&criterion, &criterion.data, &mut workspace).unwrap();
        let refined = steiglitz_mcbride(&criterion, arx.clone(), &mut workspace).unwrap();
        let reduced = reduced_arx(&criterion, &mut workspace).unwrap();
        let off = |f: &[f64]| (f[0] + 1.5).abs().max((f[1] - 0.7).abs());
        // The equation error assumes the noise spectrum of 1/A, and Steiglitz and McBride assume white noise; coloured
        // noise biases both. A model with additional poles for the noise is not biased.
        assert!(off(&arx) > 0.05 && off(&refined) > 0.05, "{arx:?} {refined:?}");
        assert!(off(&reduced) < 0.02, "{reduced:?}");
        let starts = initial_guesses(&criterion, SampleTime::AT_100_HZ, &mut workspace);
        for label in ["steiglitz-mcbride", "high-order arx", "instruments"] {
            assert!(starts.iter().any(|s| s.label == label), "{label}");
        }
    }

    #[test]
    fn short_record_has_no_high_order_start() {
        let (e, u) = record(25, 0.1);
        let orders = Orders {
            nb: 1,
            nf: 1,
            nk: 1,
            ..Orders::default()
        };
        let criterion = Criterion {
            orders,
            data: vec![Data::new(&e, &u)],
            initial: InitialState::Zero,
            first: 0,
            weights: None,
            further: Vec::new(),
        };
        assert!(reduced_arx(&criterion, &mut Workspace::default()).is_none());
    }
}
