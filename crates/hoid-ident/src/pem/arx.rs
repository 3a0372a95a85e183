//! ARX by linear least squares.
//!
//! `u(t) = phi(t)' theta + eps(t)` with `phi = [-u(t-1) .. -u(t-na), e(t-nk) .. e(t-nk-nb+1)]` (eq. 5.31), from the
//! first sample at which phi lies inside the record (eq. 5.33) in each record, or with zeros for anything before it.
//!
//! **How it is solved.** The columns are shifts of two signals, so that `Phi' Phi` costs a few passes over the record,
//! a tenth of an orthogonal factorisation. A solution of the normal equations has an error of `cond(Phi' Phi) eps`; one
//! step of refinement from the residuals themselves, `theta + (Phi' Phi)^-1 Phi' (y - Phi theta)`, squares that factor
//! (A. Bjorck, *Numerical Methods for Least Squares Problems*, 1996, sec. 2.9.3). If the regressors are too nearly
//! dependent for this, the fit is exact, u has a level, or zeros precede the record, QR with column pivoting determines
//! the rank and the solution.

use hoid_model::{Orders, SampleTime, Structure};
use nalgebra::{DMatrix, DVector};

use crate::{
    Fit, IdentError, Reason, Termination,
    assembled_fit::{Solution, assembled_fit},
    criterion::{Criterion, Data},
    linalg::least_squares::{LeastSquares, add_scaled},
    linalg::products::{Lagged, ResidualProducts, gram},
};

/// Condition of the scaled normal matrix (an upper bound, `p tr(G^-1)`) up to which it is used:
/// refined, the solution keeps all digits but three, the covariance nine.
const WELL_CONDITIONED: f64 = 1e7;

/// Share of the residuals in the power of the output below which the fit counts as exact.
const EXACT: f64 = 1e-12;

/// Solution of the regression with the data for its uncertainty.
#[derive(Debug)]
struct Regression {
    pub theta: Vec<f64>,
    pub sum_of_squares: f64,
    /// `(Phi' Phi)^-1` by rows.
    pub inverse_gram: Vec<f64>,
}

/// Fits a criterion whose residual is linear in theta.
///
/// # Errors
/// [`IdentError::SingularRegressors`].
pub(crate) fn fit(structure: Structure, criterion: &Criterion<'_>, sample_time: SampleTime) -> Result<Fit, IdentError> {
    let solved = regress(&criterion.orders, &criterion.data, criterion.first)?;
    let solution = Solution {
        held: vec![false; solved.theta.len()],
        theta: solved.theta,
        sum_of_squares: solved.sum_of_squares,
        termination: Termination {
            reason: Reason::Direct,
            iterations: 0,
        },
        start: "none needed".to_owned(),
    };
    let fit = assembled_fit(criterion, structure, sample_time, solution)?;
    let sigma2 = fit.innovation_variance;
    Ok(fit.with_covariance(sigma2, &solved.inverse_gram))
}

/// Least squares over all records, residuals from sample `first` on.
fn regress(orders: &Orders, data: &[Data<'_>], first: usize) -> Result<Regression, IdentError> {
    let levels: Vec<usize> = (0..data.len()).filter(|k| data[*k].level).collect();
    if levels.is_empty()
        && let Some(solved) = by_normal_equations(orders, data, first)
    {
        return Ok(solved);
    }
    let rows: usize = data.iter().map(|d| d.u.len() - first).sum();
    let mut columns = Vec::with_capacity((orders.parameters() + levels.len()) * rows);
    let mut lagged = |signal: &[f64], lag: usize, sign: f64| {
        columns.extend(std::iter::repeat_n(
            0.0,
            lag.saturating_sub(first).min(signal.len() - first),
        ));
        if lag < signal.len() {
            let from = first.max(lag) - lag;
            columns.extend(signal[from..signal.len() - lag].iter().map(|x| sign * x));
        }
    };
    for lag in 1..=orders.na {
        data.iter().for_each(|d| lagged(d.u, lag, -1.0));
    }
    for j in 0..orders.nb {
        data.iter().for_each(|d| lagged(d.e, orders.nk + j, 1.0));
    }
    // A level is a column of ones over its record.
    for level in &levels {
        for (k, d) in data.iter().enumerate() {
            let one = if k == *level { 1.0 } else { 0.0 };
            columns.extend(std::iter::repeat_n(one, d.u.len() - first));
        }
    }
    let mut y: Vec<f64> = data.iter().flat_map(|d| &d.u[first..]).copied().collect();
    let solved = LeastSquares::factor(&mut columns, &mut y);
    if !solved.has_full_rank() {
        let mut names = orders.parameter_names();
        names.extend(levels.iter().map(|k| format!("level of record {}", k + 1)));
        return Err(IdentError::SingularRegressors {
            columns: solved.describe_dependence(&names),
        });
    }
    let (p, all) = (orders.na + orders.nb, orders.na + orders.nb + levels.len());
    let mut theta = solved.solution();
    theta.truncate(p);
    let inverse = solved.inverse_gram();
    Ok(Regression {
        theta,
        sum_of_squares: solved.residual_sum_of_squares,
        inverse_gram: (0..p * p).map(|k| inverse[k / p * all + k % p]).collect(),
    })
}

/// Returns the output, and the columns of Phi: u(t-1) .. u(t-na) without their sign, e(t-nk) ...
fn columns<'a>(orders: &Orders, data: &Data<'a>, first: usize) -> Vec<Lagged<'a>> {
    let n = data.u.len();
    let outputs = (0..=orders.na).map(|lag| Lagged {
        values: &data.u[first - lag..n - lag],
        follows: lag > 0,
    });
    let inputs = (0..orders.nb).map(|j| Lagged {
        values: &data.e[first - orders.nk - j..n - orders.nk - j],
        follows: j > 0,
    });
    outputs.chain(inputs).collect()
}

/// Returns `None` if QR has to decide.
fn by_normal_equations(orders: &Orders, data: &[Data<'_>], first: usize) -> Option<Regression> {
    let p = orders.na + orders.nb;
    if p == 0 || first < orders.first_regressed_sample() {
        return None;
    }
    let q = p + 1;
    let mut all = vec![0.0; q * q];
    for d in data {
        add_scaled(&mut all, 1.0, &gram(&columns(orders, d, first)));
    }
    let sign = |i: usize| if i < orders.na { -1.0 } else { 1.0 };
    let power = all[0];
    let scale: Vec<f64> = (1..q).map(|i| all[i * q + i].sqrt()).collect();
    if !scale.iter().all(|s| s.is_normal()) {
        return None;
    }
    let scaled = DMatrix::from_fn(p, p, |i, j| {
        sign(i) * sign(j) * all[(i + 1) * q + j + 1] / (scale[i] * scale[j])
    });
    let factor = scaled.cholesky()?;
    let inverse = factor.inverse();
    // Not <=: NaN is not a valid condition either.
    let well_conditioned = p as f64 * inverse.trace() < WELL_CONDITIONED;
    if !well_conditioned {
        return None;
    }
    let solve = |rhs: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let x = factor.solve(&DVector::from_fn(p, |i, _| rhs(i) / scale[i]));
        x.iter().zip(&scale).map(|(x, s)| x / s).collect()
    };
    let mut theta = solve(&|i| sign(i) * all[i + 1]);
    // Residuals, their power, and their products with the regressors.
    let factors: Vec<f64> = (0..p).map(|i| sign(i) * theta[i]).collect();
    let mut residuals = ResidualProducts::new(p);
    for d in data {
        residuals.add(&columns(orders, d, first), &factors);
    }
    let mut squares = residuals.squares;
    let correction = solve(&|i| sign(i) * residuals.products[i]);
    for i in 0..p {
        theta[i] += correction[i];
        squares -= correction[i] * sign(i) * residuals.products[i];
    }
    // An exact fit leaves the rounding of the residuals, which is more accurate by QR.
    if !squares.is_finite() || squares < EXACT * power {
        return None;
    }
    let inverse_gram = (0..p * p)
        .map(|k| inverse[(k / p, k % p)] / (scale[k / p] * scale[k % p]))
        .collect();
    Some(Regression {
        theta,
        sum_of_squares: squares,
        inverse_gram,
    })
}

#[cfg(test)]
mod tests;
