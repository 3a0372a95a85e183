//! Findings about the operators of the rows of a trace: the share of rows that have an operator, the significance and
//! sign of the gains, the lead, and the plausibility of poles and delay.

use hoid_ident::diagnostics::{has_negative_lead, is_undetermined, neuromuscular_finding};
use hoid_model::{
    Finding, NotConvertible, Severity,
    uncertainty::{Estimate, OperatorEstimate},
};

use crate::trace::Trace;

/// The operator of one row, or the reason why the row has none.
pub(super) type Operator = Result<OperatorEstimate, NotConvertible>;

/// True if the model does not have the orders or the form of an operator.
pub(super) fn has_other_form(operator: &Operator) -> bool {
    matches!(
        operator,
        Err(NotConvertible::OtherOrders { .. } | NotConvertible::PolesInBoth { .. } | NotConvertible::OtherForm { .. })
    )
}

/// Shares of the rows beyond which a finding is reported.
const NOT_CONVERTIBLE_SHARE: f64 = 0.05;
const UNDETERMINED_SHARE: f64 = 0.5;
const IMPLAUSIBLE_SHARE: f64 = 0.25;
const SIGN_CHANGE_SHARE: f64 = 0.02;
const NEGATIVE_LEAD_SHARE: f64 = 0.1;
/// Upper bound of omega_nm in the physical recursions as a share of the Nyquist frequency, less rounding.
const OMEGA_BOUND_SHARE: f64 = 0.4999;

/// Returns the findings about the operators of the rows of a trace.
pub(super) fn operator_findings(trace: &Trace, operators: &[Operator]) -> Vec<Finding> {
    let mut all = Vec::new();
    if operators.is_empty() || operators.iter().all(has_other_form) {
        return all;
    }
    let share = |count: usize, of: usize| count as f64 / of.max(1) as f64;
    let found: Vec<&OperatorEstimate> = operators.iter().filter_map(|o| o.as_ref().ok()).collect();
    let lacking = share(operators.len() - found.len(), operators.len());
    if lacking > NOT_CONVERTIBLE_SHARE {
        let reason = operators.iter().find_map(|o| o.as_ref().err());
        let reason = reason.map_or(String::new(), |r| format!(", as {r}"));
        let words = format!(
            "{:.0} % of the rows do not correspond to any operator{reason}",
            100.0 * lacking
        );
        // If the gain is zero in all rows, the cause is not another form of the operator: no response was found.
        let nothing = operators.iter().all(|o| matches!(o, Err(NotConvertible::ZeroGain)));
        all.push(match nothing {
            true => Finding::undetermined("not-convertible", words),
            false => Finding::warning("not-convertible", words),
        });
    }
    let rows_with = |is: &dyn Fn(&OperatorEstimate) -> bool| share(found.iter().filter(|o| is(o)).count(), found.len());
    let remembers = trace.options().method.memories().is_some();
    // If the response is known, gain and lead are only one description of the response, which may have another form.
    let of_response = |finding: Finding| match trace.response_is_known {
        true => Finding {
            severity: Severity::Note,
            ..finding
        },
        false => finding,
    };
    all.extend(undetermined_gains_finding(&rows_with, remembers).map(of_response));
    all.extend(sign_finding(&rows_with));
    all.extend(lead_finding(&rows_with).map(of_response));
    let nyquist = trace.sample_time().nyquist_rad_s();
    let bounded = trace.options().method.is_physical();
    let implausible = rows_with(&|o| {
        let omega = o.omega_nm_rad_s.value;
        neuromuscular_finding(omega, o.zeta_nm.value, trace.sample_time()).is_some()
            || (bounded && omega >= OMEGA_BOUND_SHARE * nyquist)
    });
    if implausible > IMPLAUSIBLE_SHARE {
        all.push(Finding::warning(
            "neuromuscular-lag",
            format!(
                "in {:.0} % of the rows the two poles represent a lag and carry no information about the neuromuscular \
                 system (omega_nm near or above the Nyquist frequency, or zeta_nm above 3)",
                100.0 * implausible
            ),
        ));
    }
    if let Some((low, high)) = trace.options().method.track_delay_s().filter(|(low, high)| high > low) {
        let near = 1e-6 * (high - low);
        let at_end = rows_with(&|o| o.tau_e_s.value <= low + near || o.tau_e_s.value >= high - near);
        if at_end > IMPLAUSIBLE_SHARE {
            all.push(Finding::warning(
                "delay-at-bound",
                format!(
                    "in {:.0} % of the rows the delay is at an end of its range {low} to {high} s; widen this range",
                    100.0 * at_end
                ),
            ));
        }
    }
    all
}

/// Finding about a gain that changes its sign: people do not reverse their gain, but a channel may be inverted during
/// the run.
fn sign_finding(rows_with: &ShareOfRows<'_>) -> Option<Finding> {
    let beyond = |e: &Estimate, sign: f64| e.standard_error.is_some_and(|s| sign * e.value > 3.0 * s);
    let positive = rows_with(&|o| beyond(&o.k_e, 1.0));
    let negative = rows_with(&|o| beyond(&o.k_e, -1.0));
    (positive > SIGN_CHANGE_SHARE && negative > SIGN_CHANGE_SHARE).then(|| {
        Finding::warning(
            "gain-sign",
            format!(
                "K_e is positive in {:.0} % of the rows and negative in {:.0} %: check whether the sign of e or u changes",
                100.0 * positive,
                100.0 * negative
            ),
        )
    })
}

/// Finding about a negative lead: people have no negative lead, but gain and lead that approximate a lag can include
/// one.
fn lead_finding(rows_with: &ShareOfRows<'_>) -> Option<Finding> {
    let negative = rows_with(&has_negative_lead);
    (negative > NEGATIVE_LEAD_SHARE).then(|| {
        Finding::warning(
            "negative-lead",
            format!(
                "the lead T_L is negative in {:.0} % of the rows, by at least two standard errors of K_e and of \
                 K_e_dot: a gain and a lead do not describe this person, who may have a lag; K_e, T_L and K_e_dot are \
                 then not parameters of the person, and only the response is valid; use hoid identify to find the form",
                100.0 * negative
            ),
        )
    })
}

/// Returns the share of the rows whose operator has a property.
type ShareOfRows<'a> = dyn Fn(&dyn Fn(&OperatorEstimate) -> bool) -> f64 + 'a;

/// Finding about gains that are undetermined in most rows. For methods with a memory length, it recommends a longer
/// one.
fn undetermined_gains_finding(rows_with: &ShareOfRows<'_>, remembers: bool) -> Option<Finding> {
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let both = rows_with(&|o| is_undetermined(&o.k_e) && is_undetermined(&o.k_e_dot));
    if both > UNDETERMINED_SHARE {
        let why = if remembers { " for the memory in use" } else { "" };
        return Some(Finding::undetermined(
            "gain",
            format!(
                "in {} of the rows no gain differs from zero by at least two standard errors: there is too little \
                 response to e{why}",
                percent(both)
            ),
        ));
    }
    let no_gain = rows_with(&|o| is_undetermined(&o.k_e) && !is_undetermined(&o.k_e_dot));
    let no_lead = rows_with(&|o| is_undetermined(&o.k_e_dot) && !is_undetermined(&o.k_e));
    if no_gain > UNDETERMINED_SHARE {
        let remedy = if remembers { "; use a longer memory" } else { "" };
        return Some(Finding::warning(
            "undetermined-parameter",
            format!(
                "K_e is within two standard errors of zero in {} of the rows{remedy}",
                percent(no_gain)
            ),
        ));
    }
    (no_lead > UNDETERMINED_SHARE).then(|| {
        Finding::note(
            "undetermined-parameter",
            format!(
                "in {} of the rows the gain differs from zero by at least two standard errors, but the lead does not: \
                 a pure gain describes the person equally well, and T_L and K_e_dot are not determined",
                percent(no_lead)
            ),
        )
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn negative_lead_is_reported() {
        let operator = |k_e: f64, k_e_dot: f64| OperatorEstimate {
            k_e: Estimate::with_variance(k_e, 0.01),
            t_l_s: Estimate::fixed(k_e_dot / k_e),
            k_e_dot: Estimate::with_variance(k_e_dot, 0.01),
            omega_nm_rad_s: Estimate::fixed(11.0),
            zeta_nm: Estimate::fixed(0.25),
            tau_e_s: Estimate::fixed(0.2),
        };
        // Two standard errors of each gain are .2.
        for (k_e, k_e_dot, expected) in [
            (1.0, 1.0, false),
            (1.0, -0.3, true),
            (1.0, -0.1, false),
            (-1.0, 0.3, true),
            (0.1, -0.3, false),
            (-1.0, -0.3, false),
        ] {
            assert_eq!(has_negative_lead(&operator(k_e, k_e_dot)), expected, "{k_e}, {k_e_dot}");
        }
        let share = |negative: f64| move |_: &dyn Fn(&OperatorEstimate) -> bool| negative;
        assert!(lead_finding(&share(0.05)).is_none());
        assert_eq!(lead_finding(&share(0.4)).unwrap().kind, "negative-lead");
    }
}
