//! ARX by linear least squares.
//!
//! `u(t) = phi(t)' theta + eps(t)` with `phi = [-u(t-1) .. -u(t-na), e(t-nk) .. e(t-nk-nb+1)]` (eq. 5.31), from the first sample
//! at which phi lies inside the record (eq. 5.33) in each record; solved by QR with column pivoting, not by the inverse of
//! eq. 5.36.

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
    for lag in 1..=orders.na {
        for d in data {
            columns.extend(d.u[first - lag..d.u.len() - lag].iter().map(|u| -u));
        }
    }
    for j in 0..orders.nb {
        let lag = orders.nk + j;
        for d in data {
            columns.extend_from_slice(&d.e[first - lag..d.e.len() - lag]);
        }
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
