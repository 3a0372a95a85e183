//! Starts of the Box-Jenkins search, so that no guess is asked of the user.
//!
//! Everything hangs on the poles: given F, the model is linear in B, and given B and F the noise model is a linear
//! autoregression. So each start is a proposal for F that is completed by linear least squares:
//!
//! 1. `arx`: A of an ARX fit. Badly biased where the noise poles are not those of the system (m0 = 1: a2 near 0), so never
//!    alone.
//! 2. `steiglitz-mcbride`: ARX again on input and output filtered by 1/F of the step before, a few times (K. Steiglitz and
//!    L. E. McBride, *IEEE Trans. Automatic Control* 10 (1965) 461-464).
//! 3. `pole grid`: for two poles and more, neuromuscular frequencies from 3 to 24 rad/s with damping 0.25 and 0.7, as people
//!    have them, through the exact zero-order hold.
//!
//! The proposals are ranked by their loss with the initial states eliminated; the search runs from the best of them, and the
//! best minimum wins.

use hoid_core::stability::roots_inside;
use hoid_model::{Complex64, Orders, SampleTime, polynomial, polynomial_model::monic};

use crate::{
    arx,
    least_squares::{dot, solve_symmetric},
    prediction_error::{Criterion, Data, InitialState, Workspace, first_residual},
    search::Objective,
};

/// A start of the search, with its name.
#[derive(Debug, Clone)]
pub(crate) struct Start {
    pub label: String,
    pub theta: Vec<f64>,
}

/// Neuromuscular frequencies of the pole grid, rad/s.
const GRID_OMEGA: [f64; 4] = [3.0, 6.0, 12.0, 24.0];
/// Damping ratios of the pole grid.
const GRID_ZETA: [f64; 2] = [0.25, 0.7];
/// Further poles of the grid for nf > 2: fast ones, which matter least.
const EXTRA_POLE: f64 = 0.3;

/// Proposals that are completed with a noise model of their own.
const COMPLETED: usize = 4;

/// The best starts, best first.
///
/// All proposals are ranked with the noise model of the first one, which costs one pass each; the best few get a noise model
/// of their own and are ranked again.
pub(crate) fn propose(criterion: &Criterion<'_>, sample_time: SampleTime, workspace: &mut Workspace) -> Vec<Start> {
    let proposals = pole_proposals(criterion, sample_time);
    let reference = proposals.iter().find_map(|(_, f)| complete(criterion, f, workspace));
    let Some((reference, _)) = reference else {
        return Vec::new();
    };
    let o = &criterion.orders;
    let mut ranked: Vec<(String, Vec<f64>, f64)> = proposals
        .into_iter()
        .filter_map(|(label, f)| {
            let mut theta = reference.clone();
            theta[o.parameters() - o.nf..].copy_from_slice(&f);
            let (_, value) = criterion.best_linear_part(&theta, workspace)?;
            Some((label, f, value))
        })
        .collect();
    ranked.sort_by(|a, b| a.2.total_cmp(&b.2));
    let mut starts: Vec<(Start, f64)> = ranked
        .into_iter()
        .take(COMPLETED)
        .filter_map(|(label, f, _)| {
            let (theta, value) = complete(criterion, &f, workspace)?;
            Some((Start { label, theta }, value))
        })
        .collect();
    starts.sort_by(|a, b| a.1.total_cmp(&b.1));
    starts.into_iter().map(|(start, _)| start).collect()
}

fn pole_proposals(criterion: &Criterion<'_>, sample_time: SampleTime) -> Vec<(String, Vec<f64>)> {
    let nf = criterion.orders.nf;
    if nf == 0 {
        return vec![("linear".to_owned(), Vec::new())];
    }
    let mut proposals = Vec::new();
    if let Some(f) = arx_poles(criterion, &criterion.data) {
        proposals.push(("arx".to_owned(), f.clone()));
        if let Some(f) = steiglitz_mcbride(criterion, f) {
            proposals.push(("steiglitz-mcbride".to_owned(), f));
        }
    }
    for omega in GRID_OMEGA {
        for zeta in GRID_ZETA {
            let poles = grid_poles(nf, omega, zeta, sample_time.s());
            let f = polynomial::from_roots(&poles)[1..].to_vec();
            proposals.push((format!("pole grid {omega} rad/s, damping {zeta}"), f));
            if nf == 1 {
                break;
            }
        }
    }
    proposals
}

fn grid_poles(nf: usize, omega: f64, zeta: f64, ts: f64) -> Vec<Complex64> {
    if nf == 1 {
        return vec![Complex64::new((-omega * ts).exp(), 0.0)];
    }
    let s = Complex64::new(-zeta, (1.0 - zeta * zeta).max(0.0).sqrt()) * omega * ts;
    let mut poles = vec![s.exp(), s.exp().conj()];
    poles.resize(nf, Complex64::new(EXTRA_POLE, 0.0));
    poles
}

/// A of an ARX fit with as many poles as F has, unstable ones reflected into the circle.
fn arx_poles(criterion: &Criterion<'_>, data: &[Data<'_>]) -> Option<Vec<f64>> {
    let orders = Orders {
        na: criterion.orders.nf,
        nb: criterion.orders.nb,
        nk: criterion.orders.nk,
        ..Orders::default()
    };
    let first = criterion.first.max(first_residual(&orders, InitialState::Estimate));
    if data.iter().any(|d| d.u.len() <= first) {
        return None;
    }
    let fitted = arx::regress(&orders, data, first).ok()?;
    reflected_inside(&fitted.theta[..orders.na])
}

fn steiglitz_mcbride(criterion: &Criterion<'_>, mut f: Vec<f64>) -> Option<Vec<f64>> {
    for _ in 0..4 {
        let filtered: Vec<(Vec<f64>, Vec<f64>)> = criterion
            .data
            .iter()
            .map(|d| {
                let (mut e, mut u) = (d.e.to_vec(), d.u.to_vec());
                hoid_core::filter::divide_in_place(&f, &mut e);
                hoid_core::filter::divide_in_place(&f, &mut u);
                (e, u)
            })
            .collect();
        let data: Vec<Data<'_>> = filtered.iter().map(|(e, u)| Data { e, u }).collect();
        f = arx_poles(criterion, &data)?;
    }
    Some(f)
}

/// The same polynomial with each root outside the circle replaced by the inverse of its conjugate.
pub(crate) fn reflected_inside(coefficients: &[f64]) -> Option<Vec<f64>> {
    if roots_inside(coefficients, 1.0) {
        return Some(coefficients.to_vec());
    }
    let roots: Vec<Complex64> = polynomial::roots(&monic(coefficients))?
        .into_iter()
        .map(|z| match z.norm() {
            r if r > 1.0 => 1.0 / z.conj(),
            // On the circle: pulled in a little, or the filter would never forget.
            r if r > 0.999 => z * (0.999 / r),
            _ => z,
        })
        .collect();
    let mut inside = polynomial::from_roots(&roots)[1..].to_vec();
    inside.resize(coefficients.len(), 0.0);
    roots_inside(&inside, 1.0).then_some(inside)
}

/// Theta and sum of squares for a given F: A and B by least squares, the noise model by autoregression of what is left, and A
/// and B once more with that noise model. With A in the model that is repeated: A and the noise model depend on each other
/// (generalised least squares; D. W. Clarke, *IFAC Symposium on Identification*, Prague 1967).
fn complete(criterion: &Criterion<'_>, f: &[f64], workspace: &mut Workspace) -> Option<(Vec<f64>, f64)> {
    let o = criterion.orders;
    if o.nb == 0 {
        return time_series(criterion, workspace);
    }
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

/// Start of a model of the output alone, `u = C/(A D) eps`, by Hannan and Rissanen: A takes the autoregression where it is
/// there, D starts at one.
fn time_series(criterion: &Criterion<'_>, workspace: &mut Workspace) -> Option<(Vec<f64>, f64)> {
    let o = criterion.orders;
    let outputs: Vec<Vec<f64>> = criterion.data.iter().map(|d| d.u.to_vec()).collect();
    let (c, mut a) = noise_model(&outputs, o.nc, o.na);
    if o.na > 0 {
        a = reflected_inside(&a)?;
    }
    let mut theta = a;
    theta.extend(c);
    theta.resize(o.parameters(), 0.0);
    let value = criterion.linearise(&theta, workspace).sum_of_squares;
    value.is_finite().then_some((theta, value))
}

/// C and D of `v = (C/D) eps` by Hannan and Rissanen (*Biometrika* 69 (1982) 81-94): with nc = 0 one autoregression, else a long
/// autoregression for eps first and then a regression on past v and past eps. Zeros where that is singular.
pub(crate) fn noise_model(v: &[Vec<f64>], nc: usize, nd: usize) -> (Vec<f64>, Vec<f64>) {
    let nothing = (vec![0.0; nc], vec![0.0; nd]);
    if nc == 0 {
        let lags: Vec<(usize, usize)> = (1..=nd).map(|i| (0, i)).collect();
        let signals: Vec<[&[f64]; 1]> = v.iter().map(|v| [v.as_slice()]).collect();
        return match lagged_regression(&signals, &lags, nd) {
            Some(theta) => (Vec::new(), theta.iter().map(|t| -t).collect()),
            None => nothing,
        };
    }
    let long = 10 + 2 * (nc + nd);
    let (_, whitening) = noise_model(v, 0, long);
    let eps: Vec<Vec<f64>> = v
        .iter()
        .map(|v| {
            let mut eps = vec![0.0; v.len()];
            hoid_core::filter::multiply(&whitening, v, &mut eps);
            eps
        })
        .collect();
    let signals: Vec<[&[f64]; 2]> = v.iter().zip(&eps).map(|(v, e)| [v.as_slice(), e.as_slice()]).collect();
    let lags: Vec<(usize, usize)> = (1..=nc).map(|j| (1, j)).chain((1..=nd).map(|i| (0, i))).collect();
    let Some(theta) = lagged_regression(&signals, &lags, long + nc.max(nd)) else {
        return nothing;
    };
    match reflected_inside(&theta[..nc]) {
        Some(c) => (c, theta[nc..].iter().map(|t| -t).collect()),
        None => nothing,
    }
}

/// Coefficients of the regression of the first signal on lagged signals (index of signal, lag), rows from `first` on.
fn lagged_regression<const K: usize>(
    records: &[[&[f64]; K]],
    lags: &[(usize, usize)],
    first: usize,
) -> Option<Vec<f64>> {
    let p = lags.len();
    let mut gram = vec![0.0; p * p];
    let mut rhs = vec![0.0; p];
    for signals in records {
        let n = signals[0].len();
        if n <= first {
            continue;
        }
        let column = |&(signal, lag): &(usize, usize)| &signals[signal][first - lag..n - lag];
        for (i, lag) in lags.iter().enumerate() {
            rhs[i] += dot(column(lag), &signals[0][first..]);
            for (j, other) in lags.iter().enumerate() {
                gram[i * p + j] += dot(column(lag), column(other));
            }
        }
    }
    solve_symmetric(&gram, &rhs)
}
