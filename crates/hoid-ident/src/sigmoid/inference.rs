//! What the two minima, with a change and without, say: covariance, which parameters have a
//! standard error, and whether there was a change.
//!
//! The covariance is `sigma^2 (psi' psi)^-1` of the parameters that were free, with the initial
//! states eliminated and the weights taken as known. The comparison is by the likelihood ratio
//! `n ln(V_0/V_1)` and the BIC.

use std::fmt;

use hoid_model::uncertainty::{Estimate, OperatorEstimate, variance_along};

use super::{
    layout::{DELAY, FASTEST, K_E, LOG_RATE, MIDPOINT, OF_THE_CHANGE, OMEGA, T_L, ZETA, names},
    objective::ChangeCriterion,
    profile_likelihood::is_change_point,
};
use crate::{
    IdentError, Reason,
    linalg::information::inverse_of_free,
    optimize::{Linearisation, Minimum, free_parameters},
};

/// Why a parameter has no standard error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Remark {
    /// It was fixed.
    Fixed,
    /// It rests at a bound.
    AtBound,
    /// G rests at its upper bound: the change takes no longer than two samples, and how fast it was
    /// cannot be told.
    Abrupt,
    /// The records show no change (BIC): t_M and G mean nothing, and gains on either side of it are
    /// chosen by chance.
    NoChange,
    /// The change is too fast for a normal error: the likelihood interval holds.
    ChangePoint,
    /// The data do not determine it.
    Undetermined,
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fixed => "fixed",
            Self::AtBound => "rests at a bound",
            Self::Abrupt => "at its upper bound: the change takes no longer than two samples, its rate cannot be told",
            Self::NoChange => "the records show no change: take the fit without one",
            Self::ChangePoint => "the change is too fast for a normal error: take the likelihood interval",
            Self::Undetermined => "not determined by the data",
        })
    }
}

/// The fit against the one without a change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Comparison {
    /// `n ln(V_0/V_1)`.
    pub likelihood_ratio: f64,
    /// Parameters that the change adds: those of K_e2, T_L2, t_M and G that were not fixed.
    pub extra_parameters: usize,
    /// BIC without the change minus BIC with it; positive where the change is worth its parameters.
    pub bic_difference: f64,
}

/// What the minimum with a change says beside theta.
pub(super) struct Inference {
    /// Variance of the innovations, weighted where the noise level changes.
    pub innovation_variance: f64,
    /// Covariance of theta by rows; `None` for an exact fit.
    pub covariance: Option<Vec<f64>>,
    /// Why an element of theta has no standard error, where it has none.
    pub remarks: Vec<Option<Remark>>,
    pub comparison: Comparison,
    /// True where the change is too fast for t_M to have a normal error.
    pub change_point: bool,
}

/// The inference from the minimum with a change and the one without, `constant`.
///
/// # Errors
/// [`IdentError::SingularInformation`].
pub(super) fn inference(
    criterion: &ChangeCriterion<'_>,
    minimum: &Minimum,
    constant: &Minimum,
) -> Result<Inference, IdentError> {
    let theta = &minimum.theta;
    let p = theta.len();
    let (n, states) = (criterion.residuals(), criterion.states());
    let sum_of_squares = minimum.at.sum_of_squares;
    let not_fixed = criterion.limits.iter().filter(|(low, high)| low < high).count();
    let innovation_variance = sum_of_squares / (n - not_fixed - states) as f64;
    let extra_parameters = OF_THE_CHANGE
        .iter()
        .filter(|&&i| criterion.limits[i].0 < criterion.limits[i].1)
        .count();
    // An exact fit without a change leaves two losses of rounding errors.
    let both_exact = constant.termination.reason == Reason::ExactFit;
    let ratio = (constant.at.sum_of_squares / sum_of_squares).ln();
    let likelihood_ratio = if both_exact { 0.0 } else { n as f64 * ratio };
    let comparison = Comparison {
        likelihood_ratio,
        extra_parameters,
        bic_difference: likelihood_ratio - extra_parameters as f64 * (n as f64).ln(),
    };
    let change_found = comparison.bic_difference > 0.0;

    let mut free = free_parameters(criterion, theta, &minimum.at.descent);
    let mut remarks: Vec<Option<Remark>> = (0..p)
        .map(|i| {
            let (low, high) = criterion.limits[i];
            match i {
                _ if low == high => Some(Remark::Fixed),
                _ if i <= LOG_RATE && !change_found => Some(Remark::NoChange),
                LOG_RATE if theta[i] >= fastest(criterion) => Some(Remark::Abrupt),
                _ if theta[i] <= low || theta[i] >= high => Some(Remark::AtBound),
                _ => None,
            }
        })
        .collect();
    // A rate at its bound is held even if the loss is flat there.
    free.retain(|&i| !matches!(remarks[i], Some(Remark::AtBound | Remark::Abrupt)));
    let exact = minimum.termination.reason == Reason::ExactFit;
    let covariance = if exact {
        None
    } else {
        let mut covariance = invert(&minimum.at, &mut free, &mut remarks, &names(criterion.nd))?;
        covariance.iter_mut().for_each(|c| *c *= innovation_variance);
        Some(covariance)
    };
    let of_midpoint = covariance
        .as_ref()
        .map(|c: &Vec<f64>| c[MIDPOINT * p + MIDPOINT].sqrt());
    let change_point = change_found && of_midpoint.is_some_and(|s| is_change_point(theta, s));
    if change_point {
        for place in [MIDPOINT, LOG_RATE] {
            remarks[place] = remarks[place].or(Some(Remark::ChangePoint));
        }
    }
    Ok(Inference {
        innovation_variance,
        covariance,
        remarks,
        comparison,
        change_point,
    })
}

/// ln G from which the change counts as abrupt, up to rounding.
fn fastest(criterion: &ChangeCriterion<'_>) -> f64 {
    (FASTEST / criterion.sample_time.s()).ln() - 1e-9
}

/// Inverse of the information of the free parameters. Time and rate of a change that leaves no
/// trace are taken out.
fn invert(
    at: &Linearisation,
    free: &mut Vec<usize>,
    remarks: &mut [Option<Remark>],
    names: &[String],
) -> Result<Vec<f64>, IdentError> {
    match inverse_of_free(&at.gram, free, names) {
        Err(IdentError::SingularInformation { .. }) if free.contains(&MIDPOINT) || free.contains(&LOG_RATE) => {
            free.retain(|i| ![MIDPOINT, LOG_RATE].contains(i));
            for i in [MIDPOINT, LOG_RATE] {
                remarks[i] = remarks[i].or(Some(Remark::Undetermined));
            }
            inverse_of_free(&at.gram, free, names)
        }
        other => other,
    }
}

/// The operator at the minimum without a change.
///
/// # Errors
/// [`IdentError::SingularInformation`].
pub(super) fn constant_operator(
    criterion: &ChangeCriterion<'_>,
    minimum: &Minimum,
) -> Result<OperatorEstimate, IdentError> {
    let theta = &minimum.theta;
    let mut constant = ChangeCriterion {
        changes: false,
        ..criterion.clone()
    };
    for place in OF_THE_CHANGE {
        constant.limits[place] = (theta[place], theta[place]);
    }
    let free = free_parameters(&constant, theta, &minimum.at.descent);
    let covariance = if minimum.termination.reason == Reason::ExactFit {
        None
    } else {
        let freedom = criterion.residuals() - free.len() - criterion.states();
        let variance = minimum.at.sum_of_squares / freedom as f64;
        let mut inverse = inverse_of_free(&minimum.at.gram, &free, &names(criterion.nd))?;
        inverse.iter_mut().for_each(|c| *c *= variance);
        Some(inverse)
    };
    Ok(operator(theta, covariance.as_deref(), 0))
}

/// The operator at one end.
pub(super) fn operator(theta: &[f64], covariance: Option<&[f64]>, end: usize) -> OperatorEstimate {
    let along = |value: f64, parts: &[(usize, f64)]| match covariance {
        None => Estimate::fixed(value),
        Some(covariance) => {
            let mut gradient = vec![0.0; theta.len()];
            for &(i, g) in parts {
                gradient[i] = g;
            }
            estimate(value, variance_along(&gradient, covariance))
        }
    };
    let single = |i: usize| along(theta[i], &[(i, 1.0)]);
    let (k_e, t_l) = (theta[K_E[end]], theta[T_L[end]]);
    OperatorEstimate {
        k_e: single(K_E[end]),
        t_l_s: single(T_L[end]),
        k_e_dot: along(k_e * t_l, &[(K_E[end], t_l), (T_L[end], k_e)]),
        omega_nm_rad_s: single(OMEGA),
        zeta_nm: single(ZETA),
        tau_e_s: single(DELAY),
    }
}

/// No variance, no standard error: what was held has none.
pub(super) fn estimate(value: f64, variance: f64) -> Estimate {
    if variance > 0.0 {
        Estimate::with_variance(value, variance)
    } else {
        Estimate::fixed(value)
    }
}
