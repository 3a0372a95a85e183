//! Inference from the minima with and without a change: covariance, remarks on parameters, and the test for a change.
//!
//! The covariance is `sigma^2 (psi' psi)^-1` for the free parameters, with the initial states eliminated and the
//! weights treated as known. The fits are compared by the likelihood ratio `n ln(V_0/V_1)` and the BIC.

use std::fmt;

use super::{
    bounds::MAX_DEFAULT_RATE_TIMES_TS,
    layout::Layout,
    objective::ChangeCriterion,
    operator_states::{ChangedOperator, ThetaEstimate},
    prior,
    profile_likelihood::is_change_point,
};
use crate::{
    IdentError, Reason,
    linalg::information::inverse_information_of_free,
    optimize::{Linearisation, Minimum, free_parameters},
};

/// Reason why a parameter has no standard error, or a standard error that does not come from the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum Remark {
    /// The parameter was fixed.
    Fixed,
    /// The parameter is at a bound.
    AtBound,
    /// G is at its upper bound: the change takes no longer than two samples, and its rate cannot be determined.
    Abrupt,
    /// The BIC does not justify a change: t_M and G have no meaning, and the differences between the gains are not
    /// significant.
    NoChange,
    /// The change is too fast for a normally distributed error of t_M: only its likelihood interval is valid.
    ChangePoint,
    /// The data do not determine the parameter.
    Undetermined,
    /// More than half of the prior variance of the parameter remains: its standard error comes mainly from the prior.
    PriorAlone,
}

/// Largest ratio of posterior to prior variance for which a parameter counts as determined by the data.
const MAX_PRIOR_SHARE: f64 = 0.5;

impl Remark {
    /// True if a parameter with this remark still has a standard error.
    pub(super) fn has_standard_error(self) -> bool {
        self == Self::PriorAlone
    }
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fixed => "fixed",
            Self::AtBound => "is at a bound",
            Self::Abrupt => {
                "at its upper bound: the change takes two samples or less, so its rate cannot be determined"
            }
            Self::NoChange => "the records show no change: use the fit without a change",
            Self::ChangePoint => "the change is too fast for a normally distributed error: use the likelihood interval",
            Self::Undetermined => "not determined by the data",
            Self::PriorAlone => "determined by the prior alone",
        })
    }
}

/// Comparison with the fit without a change.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Comparison {
    /// `n ln(V_0/V_1)`.
    pub likelihood_ratio: f64,
    /// Number of parameters that the change adds: the parameters after the change (K_e2, T_L2 ...), t_M and G, without
    /// fixed parameters.
    pub extra_parameters: usize,
    /// BIC without the change minus BIC with it; positive if the change justifies its parameters.
    pub bic_difference: f64,
}

/// Results of the inference at the minimum with a change.
pub(super) struct Inference {
    /// Innovation variance, computed with weighted residuals if the noise level changes.
    pub innovation_variance: f64,
    /// Covariance of theta by rows; `None` for an exact fit.
    pub covariance: Option<Vec<f64>>,
    /// Remark on each element of theta that has no standard error, or a standard error that does not come from the
    /// data.
    pub remarks: Vec<Option<Remark>>,
    pub comparison: Comparison,
    /// True if the change is too fast for a normally distributed error of t_M.
    pub is_change_point: bool,
}

/// Computes the inference from the minimum with a change; `constant` is the minimum without a change.
///
/// # Errors
/// [`IdentError::SingularInformation`] if the data do not determine all parameters.
pub(super) fn infer(
    criterion: &ChangeCriterion<'_>,
    minimum: &Minimum,
    constant: &Minimum,
) -> Result<Inference, IdentError> {
    let theta = &minimum.theta;
    let p = theta.len();
    let layout = &criterion.layout;
    let (midpoint, log_rate) = (layout.midpoint, layout.log_rate);
    let n = criterion.residual_count();
    let sum_of_squares = minimum.linearisation.sum_of_squares;
    let innovation_variance = prior::innovation_variance(criterion, minimum);
    let of_the_change = layout.change_indices().into_iter();
    let extra_parameters = of_the_change
        .filter(|&i| criterion.limits[i].0 < criterion.limits[i].1)
        .count();
    // If the fit without a change is also exact, both losses are only rounding errors.
    let both_exact = constant.termination.reason == Reason::ExactFit;
    let ratio = (constant.linearisation.sum_of_squares / sum_of_squares).ln();
    let likelihood_ratio = if both_exact { 0.0 } else { n as f64 * ratio };
    let comparison = Comparison {
        likelihood_ratio,
        extra_parameters,
        bic_difference: likelihood_ratio - extra_parameters as f64 * (n as f64).ln(),
    };
    let change_found = comparison.bic_difference > 0.0;

    let mut free = free_parameters(criterion, theta, &minimum.linearisation.descent);
    let mut remarks: Vec<Option<Remark>> = (0..p)
        .map(|i| {
            let (low, high) = criterion.limits[i];
            match i {
                _ if low == high => Some(Remark::Fixed),
                _ if i <= log_rate && !change_found => Some(Remark::NoChange),
                _ if i == log_rate && theta[i] >= fastest_log_rate(criterion) => Some(Remark::Abrupt),
                _ if theta[i] <= low || theta[i] >= high => Some(Remark::AtBound),
                _ => None,
            }
        })
        .collect();
    // A parameter at its bound has no variance, even if the loss does not depend on it there.
    free.retain(|&i| !matches!(remarks[i], Some(Remark::AtBound | Remark::Abrupt)));
    let exact = minimum.termination.reason == Reason::ExactFit;
    let covariance = if exact {
        None
    } else {
        let mut covariance = invert(layout, &minimum.linearisation, &mut free, &mut remarks)?;
        covariance.iter_mut().for_each(|c| *c *= innovation_variance);
        Some(covariance)
    };
    let of_midpoint = covariance
        .as_ref()
        .map(|c: &Vec<f64>| c[midpoint * p + midpoint].sqrt());
    let change_point = change_found && of_midpoint.is_some_and(|s| is_change_point(layout, theta, s));
    if change_point {
        for position in [midpoint, log_rate] {
            remarks[position] = remarks[position].or(Some(Remark::ChangePoint));
        }
    }
    if let Some(covariance) = &covariance {
        for penalty in &criterion.penalty {
            let i = penalty.index;
            let share = covariance[i * p + i] * penalty.curvature(theta) / innovation_variance;
            if share > MAX_PRIOR_SHARE {
                remarks[i] = remarks[i].or(Some(Remark::PriorAlone));
            }
        }
    }
    Ok(Inference {
        innovation_variance,
        covariance,
        remarks,
        comparison,
        is_change_point: change_point,
    })
}

/// Returns the smallest ln G at which the change counts as abrupt: the upper bound less a margin for rounding.
fn fastest_log_rate(criterion: &ChangeCriterion<'_>) -> f64 {
    (MAX_DEFAULT_RATE_TIMES_TS / criterion.sample_time.s()).ln() - 1e-9
}

/// Inverts the information matrix of the free parameters. If the matrix is singular, t_M and G are removed first, since
/// they are undetermined if the change has no effect.
fn invert(
    layout: &Layout,
    at: &Linearisation,
    free: &mut Vec<usize>,
    remarks: &mut [Option<Remark>],
) -> Result<Vec<f64>, IdentError> {
    let names = layout.names();
    let of_time = [layout.midpoint, layout.log_rate];
    match inverse_information_of_free(&at.gram, free, &names) {
        Err(IdentError::SingularInformation { .. }) if of_time.iter().any(|i| free.contains(i)) => {
            free.retain(|i| !of_time.contains(i));
            for i in of_time {
                remarks[i] = remarks[i].or(Some(Remark::Undetermined));
            }
            inverse_information_of_free(&at.gram, free, &names)
        }
        other => other,
    }
}

/// Returns the operator at the minimum without a change.
///
/// # Errors
/// [`IdentError::SingularInformation`] if the data do not determine all parameters.
pub(super) fn constant_operator(
    criterion: &ChangeCriterion<'_>,
    minimum: &Minimum,
) -> Result<ChangedOperator, IdentError> {
    let theta = &minimum.theta;
    let layout = &criterion.layout;
    let mut constant = ChangeCriterion {
        changes: false,
        ..criterion.clone()
    };
    for position in layout.change_indices() {
        constant.limits[position] = (theta[position], theta[position]);
    }
    let free = free_parameters(&constant, theta, &minimum.linearisation.descent);
    let covariance = if minimum.termination.reason == Reason::ExactFit {
        None
    } else {
        let freedom = criterion.residual_count() - free.len() - criterion.state_count();
        let squares = minimum.linearisation.sum_of_squares - constant.penalty_at(theta);
        let variance = squares / freedom as f64;
        let mut inverse = inverse_information_of_free(&minimum.linearisation.gram, &free, &layout.names())?;
        inverse.iter_mut().for_each(|c| *c *= variance);
        Some(inverse)
    };
    let known = ThetaEstimate {
        layout,
        theta,
        covariance: covariance.as_deref(),
        change_point: None,
    };
    Ok(known.operator_at_end(0)?)
}
