//! ARX by linear least squares.
//!
//! The model is `u(t) = phi(t)' theta + eps(t)` with `phi = [-u(t-1) .. -u(t-na), e(t-nk) .. e(t-nk-nb+1)]` (eq. 5.31).
//! In each record, the residuals start at the first sample for which phi lies inside the record (eq. 5.33), or zeros
//! replace the samples before the record.
//!
//! **Solution.** The columns are shifts of two signals, so `Phi' Phi` takes a few passes over the record, a tenth of
//! the cost of an orthogonal factorisation. The solution of the normal equations has an error of `cond(Phi' Phi) eps`;
//! one step of refinement with the residuals themselves, `theta + (Phi' Phi)^-1 Phi' (y - Phi theta)`, squares this
//! factor (A. Bjorck, *Numerical Methods for Least Squares Problems*, 1996, sec. 2.9.3). If the regressors are too
//! close to linear dependence for this, if the fit is exact, if u has a level, or if zeros precede the record, QR with
//! column pivoting determines the rank and the solution.

use hoid_model::{Orders, SampleTime, Structure};
use nalgebra::{DMatrix, DVector};

use crate::{
    Fit, IdentError, Reason, Termination,
    assembled_fit::{Solution, assemble_fit},
    criterion::{Criterion, Data},
    linalg::products::{LaggedColumn, ResidualProducts, gram},
    linalg::{least_squares::LeastSquares, vectors::add_scaled},
};

/// Largest condition number (an upper bound, `p tr(G^-1)`) for which the scaled normal matrix is used. At this limit
/// the refined solution loses three digits, and the covariance keeps nine.
const MAX_CONDITION_NUMBER: f64 = 1e7;

/// A fit is exact if the power of the residuals is below this share of the power of the output.
const EXACT_FIT_SHARE: f64 = 1e-12;

/// Solution of the regression, with the matrix from which its covariance is computed.
#[derive(Debug)]
struct Regression {
    pub theta: Vec<f64>,
    pub sum_of_squares: f64,
    /// `(Phi' Phi)^-1` by rows.
    pub inverse_gram: Vec<f64>,
}

/// Fits the model of a criterion whose residual is linear in theta.
///
/// # Errors
/// [`IdentError::SingularRegressors`] if the columns of Phi are linearly dependent.
pub(crate) fn fit(structure: Structure, criterion: &Criterion<'_>, sample_time: SampleTime) -> Result<Fit, IdentError> {
    let solved = regress(&criterion.orders, &criterion.data, criterion.first)?;
    let solution = Solution {
        is_fixed_or_bounded: vec![false; solved.theta.len()],
        theta: solved.theta,
        sum_of_squares: solved.sum_of_squares,
        termination: Termination {
            reason: Reason::Direct,
            iterations: 0,
        },
        start: "none needed".to_owned(),
    };
    let fit = assemble_fit(criterion, structure, sample_time, solution)?;
    let sigma2 = fit.innovation_variance;
    Ok(fit.with_covariance(sigma2, &solved.inverse_gram))
}

/// Solves the least-squares problem over all records, with residuals from sample `first` on.
fn regress(orders: &Orders, data: &[Data<'_>], first: usize) -> Result<Regression, IdentError> {
    let levels: Vec<usize> = (0..data.len()).filter(|k| data[*k].level).collect();
    if levels.is_empty()
        && let Some(solved) = solve_normal_equations(orders, data, first)
    {
        return Ok(solved);
    }
    let rows: usize = data.iter().map(|d| d.u.len() - first).sum();
    let mut columns = Vec::with_capacity((orders.parameter_count() + levels.len()) * rows);
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
    // A level is a column of ones in its own record and zeros in all other records.
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

/// Returns the columns of one record: the output u(t), then u(t-1) .. u(t-na) without their sign and e(t-nk) ...
fn columns<'a>(orders: &Orders, data: &Data<'a>, first: usize) -> Vec<LaggedColumn<'a>> {
    let n = data.u.len();
    let outputs = (0..=orders.na).map(|lag| LaggedColumn {
        values: &data.u[first - lag..n - lag],
        is_shift_of_previous: lag > 0,
    });
    let inputs = (0..orders.nb).map(|j| LaggedColumn {
        values: &data.e[first - orders.nk - j..n - orders.nk - j],
        is_shift_of_previous: j > 0,
    });
    outputs.chain(inputs).collect()
}

/// Solves the regression by refined normal equations; `None` if QR is required instead.
fn solve_normal_equations(orders: &Orders, data: &[Data<'_>], first: usize) -> Option<Regression> {
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
    // The comparison also rejects `NaN`.
    let well_conditioned = p as f64 * inverse.trace() < MAX_CONDITION_NUMBER;
    if !well_conditioned {
        return None;
    }
    let solve = |rhs: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let x = factor.solve(&DVector::from_fn(p, |i, _| rhs(i) / scale[i]));
        x.iter().zip(&scale).map(|(x, s)| x / s).collect()
    };
    let mut theta = solve(&|i| sign(i) * all[i + 1]);
    // Computes the residuals, their sum of squares, and their products with the regressors.
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
    // In an exact fit only rounding errors remain in the residuals; QR computes them more accurately.
    if !squares.is_finite() || squares < EXACT_FIT_SHARE * power {
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
