//! Assembly of a fit at a minimum: loss, innovation variance and covariance from the sum of squares.
//!
//! With n residuals, p free parameters and s initial states, `V = sum eps^2 / n` and
//! `sigma^2 = sum eps^2 / (n - p - s)`. The covariance of the free parameters is `sigma^2 (psi' psi)^-1` with
//! `psi = -d eps/d theta` (L. Ljung, *System Identification*, 1999, eq. 9.19 and 9.42).

use hoid_model::{PolynomialModel, SampleTime, Structure};

use crate::{
    Fit, IdentError, Termination,
    criterion::{Criterion, output_variance},
};

/// The minimum found by a search.
pub(crate) struct Solution {
    pub theta: Vec<f64>,
    pub sum_of_squares: f64,
    pub termination: Termination,
    /// True for each parameter that is fixed or at a bound.
    pub is_fixed_or_bounded: Vec<bool>,
    /// Name of the start that led to the minimum.
    pub start: String,
}

/// Returns the fit at the minimum, without a covariance.
///
/// # Errors
/// The errors of [`PolynomialModel::new`].
pub(crate) fn assemble_fit(
    criterion: &Criterion<'_>,
    structure: Structure,
    sample_time: SampleTime,
    solution: Solution,
) -> Result<Fit, IdentError> {
    let Solution {
        theta,
        sum_of_squares,
        termination,
        is_fixed_or_bounded,
        start,
    } = solution;
    let n = criterion.residual_count();
    let free = is_fixed_or_bounded.iter().filter(|held| !**held).count();
    let freedom = n - free - criterion.state_count();
    Ok(Fit {
        is_fixed_or_bounded,
        model: PolynomialModel::new(structure, criterion.orders, sample_time, theta)?,
        covariance: None,
        loss: sum_of_squares / n as f64,
        innovation_variance: sum_of_squares / freedom as f64,
        residuals: n,
        states: criterion.state_count(),
        initial_state: criterion.initial,
        termination,
        start,
        output_variance: output_variance(&criterion.data, criterion.first),
        robust: false,
        instrumented: false,
        physical: None,
        searched_delay: None,
    })
}

impl Fit {
    /// Returns the fit with its covariance set to `variance (psi' psi)^-1`; `inverse_gram` is `(psi' psi)^-1` by rows.
    pub(crate) fn with_covariance(self, variance: f64, inverse_gram: &[f64]) -> Self {
        Self {
            covariance: Some(inverse_gram.iter().map(|g| variance * g).collect()),
            ..self
        }
    }
}

/// Returns, for each of the p parameters, whether it is fixed or at a bound, i.e. whether its index is missing from
/// `free`.
pub(crate) fn fixed_or_bounded_flags(free: &[usize], p: usize) -> Vec<bool> {
    (0..p).map(|i| !free.contains(&i)).collect()
}
