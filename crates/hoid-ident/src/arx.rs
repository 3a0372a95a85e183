//! ARX by linear least squares.
//!
//! `u(t) = phi(t)' theta + eps(t)` with `phi = [-u(t-1) .. -u(t-na), e(t-nk) .. e(t-nk-nb+1)]` (eq. 5.31), from the first sample
//! at which phi lies inside the record (eq. 5.33) in each record, or with zeros for what lies before it; solved by QR with
//! column pivoting, not by the inverse of eq. 5.36.

use hoid_model::Orders;

use crate::{IdentError, least_squares::LeastSquares, prediction_error::Data};

/// Solution of the regression with what its uncertainty needs.
#[derive(Debug)]
pub(crate) struct Regression {
    pub theta: Vec<f64>,
    pub sum_of_squares: f64,
    /// `(Phi' Phi)^-1` by rows.
    pub inverse_gram: Vec<f64>,
}

/// Fits over all records, residuals from sample `first` on.
pub(crate) fn regress(orders: &Orders, data: &[Data<'_>], first: usize) -> Result<Regression, IdentError> {
    let rows: usize = data.iter().map(|d| d.u.len() - first).sum();
    let mut columns = Vec::with_capacity(orders.parameters() * rows);
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
    let mut y: Vec<f64> = data.iter().flat_map(|d| &d.u[first..]).copied().collect();
    let solved = LeastSquares::factor(&mut columns, &mut y);
    if !solved.has_full_rank() {
        return Err(IdentError::SingularRegressors {
            columns: solved.describe_dependence(&orders.parameter_names()),
        });
    }
    Ok(Regression {
        theta: solved.solution(),
        sum_of_squares: solved.residual_sum_of_squares,
        inverse_gram: solved.inverse_gram(),
    })
}
