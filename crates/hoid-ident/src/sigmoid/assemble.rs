//! From the two minima to the fit: covariance, remarks, the comparison.
//!
//! The covariance is `sigma^2 (psi' psi)^-1` of the parameters that were free, with the initial states eliminated and the weights
//! taken as known.

use hoid_model::uncertainty::{Estimate, OperatorEstimate, variance_along};

use super::{
    interval::is_change_point,
    layout::{DELAY, FASTEST, K_E, LOG_RATE, MIDPOINT, OF_THE_CHANGE, OMEGA, T_L, ZETA, names},
    objective::ChangeCriterion,
    result::{Comparison, Remark, TimeVaryingFit},
};
use crate::{
    IdentError, Reason,
    linalg::information::inverse_of_free,
    optimize::Linearisation,
    optimize::{Minimum, free_parameters},
};

/// Everything from the two minima.
pub(super) fn assemble(
    criterion: &ChangeCriterion<'_>,
    minimum: &Minimum,
    start: String,
    constant: &Minimum,
    levels: Option<[f64; 2]>,
) -> Result<TimeVaryingFit, IdentError> {
    let theta = minimum.theta.clone();
    let p = theta.len();
    let (n, states) = (criterion.residuals(), criterion.states());
    let sum_of_squares = minimum.at.sum_of_squares;
    let not_fixed = criterion.limits.iter().filter(|(low, high)| low < high).count();
    let innovation_variance = sum_of_squares / (n - not_fixed - states) as f64;
    let extra_parameters = OF_THE_CHANGE
        .iter()
        .filter(|&&i| criterion.limits[i].0 < criterion.limits[i].1)
        .count();
    // An exact fit without a change leaves two losses of rounding errors, which say nothing.
    let both_exact = constant.termination.reason == Reason::ExactFit;
    let ratio = (constant.at.sum_of_squares / sum_of_squares).ln();
    let likelihood_ratio = if both_exact { 0.0 } else { n as f64 * ratio };
    let comparison = Comparison {
        likelihood_ratio,
        extra_parameters,
        bic_difference: likelihood_ratio - extra_parameters as f64 * (n as f64).ln(),
    };
    let change_found = comparison.bic_difference > 0.0;

    let mut free = free_parameters(criterion, &theta, &minimum.at.descent);
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
    let change_point = change_found && of_midpoint.is_some_and(|s| is_change_point(&theta, s));
    if change_point {
        for place in [MIDPOINT, LOG_RATE] {
            remarks[place] = remarks[place].or(Some(Remark::ChangePoint));
        }
    }
    let constant_operator = constant_operator(criterion, constant)?;
    Ok(TimeVaryingFit {
        nd: criterion.nd,
        sample_time: criterion.sample_time,
        first: criterion.first,
        loss: sum_of_squares / n as f64,
        innovation_variance,
        levels,
        residuals: n,
        states,
        termination: minimum.termination,
        start,
        comparison,
        constant: constant_operator,
        theta,
        covariance,
        remarks,
        midpoint_interval: None,
        rate_interval: None,
        change_point,
    })
}

/// ln G from which the change counts as abrupt, up to rounding.
fn fastest(criterion: &ChangeCriterion<'_>) -> f64 {
    (FASTEST / criterion.sample_time.s()).ln() - 1e-9
}

/// Inverse of the information of the free parameters. Time and rate of a change that leaves no trace are taken out.
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

fn constant_operator(criterion: &ChangeCriterion<'_>, minimum: &Minimum) -> Result<OperatorEstimate, IdentError> {
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
