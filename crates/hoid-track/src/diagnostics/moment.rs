//! Reliability of the estimate of one sample.

use hoid_ident::diagnostics::{gain_findings, is_undetermined, neuromuscular_finding};
use hoid_model::{
    NotConvertible, SampleTime, Severity, VerdictLevel,
    uncertainty::{Estimate, OperatorEstimate},
};

use super::operators::has_other_form;
use crate::tracker::Tracker;

/// Time after a restart for which the estimate is doubtful, s.
const SETTLING_S: f64 = 10.0;

impl Tracker {
    /// Returns the reliability of the current estimate; `operator` is the result of [`Tracker::operator`].
    pub fn verdict_level(&self, operator: &Result<OperatorEstimate, NotConvertible>) -> VerdictLevel {
        if self.theta().iter().any(|v| !v.is_finite()) {
            return VerdictLevel::NotDetermined;
        }
        let unsettled = self.is_paused() || self.time_since_restart_s().is_some_and(|s| s < SETTLING_S);
        let level = self.estimate_level(operator);
        if unsettled {
            level.max(VerdictLevel::Doubtful)
        } else {
            level
        }
    }

    fn estimate_level(&self, operator: &Result<OperatorEstimate, NotConvertible>) -> VerdictLevel {
        if !self.has_estimate() {
            return VerdictLevel::NotDetermined;
        }
        // If no coefficient has a standard error, the estimate is doubtful.
        let known = |e: &Estimate| e.standard_error.is_some_and(|s| s > 0.0);
        if !self.parameters().iter().any(known) {
            return VerdictLevel::Doubtful;
        }
        match operator {
            Ok(operator) => operator_level(operator, self.sample_time),
            Err(_) if !has_other_form(operator) => VerdictLevel::Doubtful,
            Err(_) => {
                let open = self.response_is_undetermined();
                if open {
                    VerdictLevel::NotDetermined
                } else {
                    VerdictLevel::Trustworthy
                }
            }
        }
    }

    /// True if the model has an input and no coefficient of B is at least two standard errors from zero.
    fn response_is_undetermined(&self) -> bool {
        let (names, estimates) = (self.parameter_names(), self.parameters());
        let mut of_b = names
            .iter()
            .zip(&estimates)
            .filter(|(name, _)| name.starts_with('b'))
            .peekable();
        of_b.peek().is_some() && of_b.all(|(_, e)| is_undetermined(e))
    }
}

fn operator_level(operator: &OperatorEstimate, sample_time: SampleTime) -> VerdictLevel {
    let mut gains = gain_findings(&[("", *operator)]);
    // A person who responds like a pure gain has no lead to determine.
    if !is_undetermined(&operator.k_e) && is_undetermined(&operator.k_e_dot) {
        gains.retain(|finding| finding.kind != "undetermined-parameter");
    }
    let implausible = neuromuscular_finding(operator.omega_nm_rad_s.value, operator.zeta_nm.value, sample_time);
    let open = gains.iter().any(|finding| finding.severity == Severity::Undetermined);
    if open {
        VerdictLevel::NotDetermined
    } else if !gains.is_empty() || implausible.is_some() || !operator.parameters().is_stable() {
        VerdictLevel::Doubtful
    } else {
        VerdictLevel::Trustworthy
    }
}
