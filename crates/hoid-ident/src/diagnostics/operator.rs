//! Findings against an operator: gains that do not differ from zero, implausible poles, and a delay at the end of its
//! range.

use std::f64::consts::PI;

use hoid_model::{
    Finding, SampleTime,
    uncertainty::{Estimate, OperatorEstimate},
};

use crate::{Reason, Termination};

/// A value within this number of its standard errors of zero counts as undetermined.
const MIN_STANDARD_ERRORS: f64 = 2.0;
/// Damping ratio above which the poles count as a lag: the faster of the two real poles is then 34 times the slower.
const MAX_DAMPING_RATIO: f64 = 3.0;

/// True if a value is less than two standard errors from zero; false for a value without a standard error, which was
/// given and not estimated.
pub fn is_undetermined(e: &Estimate) -> bool {
    e.standard_error
        .is_some_and(|error| e.value.abs() < MIN_STANDARD_ERRORS * error)
}

/// True if K_e and K_e_dot have opposite signs and are each at least two standard errors from zero: a negative lead.
pub fn has_negative_lead(o: &OperatorEstimate) -> bool {
    let sign = |e: &Estimate| if is_undetermined(e) { 0.0 } else { e.value.signum() };
    sign(&o.k_e) * sign(&o.k_e_dot) < 0.0
}

/// Returns findings about undetermined gains and leads, and about negative leads. Each operator has a label, such as
/// ` of record 2`; the label of a single operator is empty. If K_e and K_e_dot of all operators are undetermined, the
/// only finding is that the response to e is too small.
pub fn gain_findings(operators: &[(&str, OperatorEstimate)]) -> Vec<Finding> {
    let mut open = Vec::new();
    let mut all_open = !operators.is_empty();
    for (label, o) in operators {
        let named = [("K_e", o.k_e), ("T_L", o.t_l_s), ("K_e_dot", o.k_e_dot)];
        let of_label = named.iter().filter(|(_, e)| is_undetermined(e));
        open.extend(of_label.map(|(name, e)| format!("{name}{label} ({e})")));
        all_open &= is_undetermined(&o.k_e) && is_undetermined(&o.k_e_dot);
    }
    if all_open {
        return vec![Finding::undetermined(
            "gain",
            "no gain differs from zero by at least two standard errors: u responds too little to e",
        )];
    }
    let backwards = operators.iter().filter(|(_, o)| has_negative_lead(o));
    let negative: Vec<String> = backwards
        .map(|(label, o)| format!("T_L{label} ({})", o.t_l_s))
        .collect();
    undetermined_finding(&open)
        .into_iter()
        .chain(negative_lead_finding(&negative))
        .collect()
}

/// Returns a finding about a negative lead. People have no negative lead; a negative lead arises if a gain and a lead
/// are fitted to a lag.
fn negative_lead_finding(negative: &[String]) -> Option<Finding> {
    let verb = if negative.len() == 1 { "is" } else { "are" };
    (!negative.is_empty()).then(|| {
        Finding::warning(
            "negative-lead",
            format!(
                "{} {verb} below zero by at least two standard errors of K_e and of K_e_dot: a gain and a lead do not \
                 describe this person, whose response may contain a lag; only the response is valid; use --structure \
                 operator to find the form",
                negative.join(", ")
            ),
        )
    })
}

/// Returns findings about omega_nm and zeta_nm if they are undetermined or implausible for a person.
pub fn pole_findings(operator: &OperatorEstimate, sample_time: SampleTime) -> Vec<Finding> {
    let named = [("omega_nm", operator.omega_nm_rad_s), ("zeta_nm", operator.zeta_nm)];
    let open: Vec<String> = named
        .iter()
        .filter(|(_, e)| is_undetermined(e))
        .map(|(name, e)| format!("{name} ({e})"))
        .collect();
    let lag = neuromuscular_finding(operator.omega_nm_rad_s.value, operator.zeta_nm.value, sample_time);
    undetermined_finding(&open).into_iter().chain(lag).collect()
}

/// Returns a finding about poles that describe a lag: omega_nm is above the Nyquist frequency, or the damping ratio is
/// so large that the two poles are far apart.
pub fn neuromuscular_finding(omega_nm_rad_s: f64, zeta_nm: f64, sample_time: SampleTime) -> Option<Finding> {
    let nyquist = PI / sample_time.s();
    let what = if omega_nm_rad_s > nyquist {
        format!("omega_nm = {omega_nm_rad_s:.0} rad/s lies above the Nyquist frequency, {nyquist:.0} rad/s")
    } else if zeta_nm > MAX_DAMPING_RATIO {
        format!("zeta_nm = {zeta_nm:.1} is above {MAX_DAMPING_RATIO}")
    } else {
        return None;
    };
    Some(Finding::warning(
        "neuromuscular-lag",
        format!(
            "{what}: the two poles describe a lag and carry no information about the neuromuscular system; use the \
             grey box or the operator family, or a model of another order"
        ),
    ))
}

fn undetermined_finding(open: &[String]) -> Option<Finding> {
    let verb = if open.len() == 1 { "is" } else { "are" };
    (!open.is_empty()).then(|| {
        Finding::warning(
            "undetermined-parameter",
            format!(
                "{} {verb} not determined: less than two standard errors from zero",
                open.join(", ")
            ),
        )
    })
}

/// Returns a finding if the delay `tau_s` is at an end of its search range.
pub(super) fn delay_finding(tau_s: f64, (low, high): (f64, f64), of: &str) -> Option<Finding> {
    (high > low && (tau_s <= low || tau_s >= high)).then(|| {
        Finding::warning(
            "delay-at-bound",
            format!(
                "the delay{of}, {tau_s:.3} s, is at an end of its search range, {low:.3} to {high:.3} s; widen this \
                 range"
            ),
        )
    })
}

/// Returns a finding if the search did not converge, ended at a border or found an exact fit.
pub(super) fn search_finding(termination: Termination) -> Option<Finding> {
    match termination.reason {
        Reason::Border => Some(Finding::warning(
            "border",
            "a root of C or F lies on the unit circle, so standard errors are unreliable; lower the orders",
        )),
        Reason::ExactFit => Some(Finding::note(
            "exact-fit",
            "the residuals are zero up to rounding: the data contain no noise, and there are no error bars",
        )),
        _ => (!termination.converged())
            .then(|| Finding::warning("not-converged", format!("the search has {termination}"))),
    }
}

#[cfg(test)]
mod tests {
    use hoid_model::OperatorParameters;

    use super::*;

    fn ts() -> SampleTime {
        SampleTime::AT_100_HZ
    }

    fn operator() -> OperatorEstimate {
        let e = |value: f64| Estimate::with_variance(value, (0.1 * value).powi(2));
        let given = OperatorParameters {
            k_e: 0.09,
            t_l_s: 0.4,
            omega_nm_rad_s: 11.25,
            zeta_nm: 0.35,
            tau_e_s: 0.28,
        };
        let o = OperatorEstimate::from(given);
        OperatorEstimate {
            k_e: e(0.09),
            t_l_s: e(0.4),
            k_e_dot: e(0.036),
            omega_nm_rad_s: e(11.25),
            zeta_nm: e(0.35),
            ..o
        }
    }

    fn imprecise_estimate(value: f64) -> Estimate {
        Estimate::with_variance(value, value * value)
    }

    #[test]
    fn determined_operators_and_fixed_values_give_no_finding() {
        let o = operator();
        assert!(gain_findings(&[("", o)]).is_empty() && pole_findings(&o, ts()).is_empty());
        assert!(!is_undetermined(&Estimate::fixed(0.0)));
        assert!(gain_findings(&[]).is_empty());
    }

    #[test]
    fn negative_lead_is_reported() {
        let e = |value: f64, error: f64| Estimate::with_variance(value, error * error);
        let lag = OperatorEstimate {
            t_l_s: e(-0.2, 0.05),
            k_e_dot: e(-0.018, 0.004),
            ..operator()
        };
        let found = gain_findings(&[(" of record 2", lag)]);
        assert_eq!((found.len(), found[0].kind), (1, "negative-lead"));
        assert!(
            found[0].message.starts_with("T_L of record 2 (-0.20"),
            "{}",
            found[0].message
        );
        // Both gains are negative, so T_L is positive and there is no negative lead.
        let flipped = OperatorEstimate {
            k_e: e(-0.09, 0.009),
            k_e_dot: e(-0.036, 0.004),
            ..operator()
        };
        assert!(!has_negative_lead(&flipped));
        let open = OperatorEstimate {
            k_e_dot: e(-0.004, 0.004),
            ..lag
        };
        assert!(!has_negative_lead(&open));
    }

    #[test]
    fn undetermined_parameters_are_reported() {
        let lead = OperatorEstimate {
            k_e: imprecise_estimate(0.09),
            t_l_s: imprecise_estimate(0.4),
            ..operator()
        };
        let found = gain_findings(&[("", lead)]);
        assert_eq!((found.len(), found[0].kind), (1, "undetermined-parameter"));
        assert!(
            found[0]
                .message
                .starts_with("K_e (0.090 ± 0.090), T_L (0.40 ± 0.40) are not"),
            "{}",
            found[0].message
        );
        let nothing = OperatorEstimate {
            k_e_dot: imprecise_estimate(0.036),
            ..lead
        };
        assert_eq!(gain_findings(&[("", nothing)])[0].kind, "gain");
        // The gains of one of the two operators are determined.
        let found = gain_findings(&[(" of record 1", nothing), (" of record 2", operator())]);
        assert_eq!(found[0].kind, "undetermined-parameter");
        assert!(found[0].message.contains("K_e_dot of record 1"), "{}", found[0].message);
        let poles = OperatorEstimate {
            zeta_nm: imprecise_estimate(0.35),
            ..operator()
        };
        assert!(pole_findings(&poles, ts())[0].message.starts_with("zeta_nm (0.35"));
    }

    #[test]
    fn implausible_neuromuscular_poles_are_reported() {
        for (omega, zeta, implausible) in [
            (11.25, 0.35, false),
            (11.25, 2.9, false),
            (11.25, 3.1, true),
            (313.0, 1.0, false),
            (315.0, 1.0, true),
        ] {
            let found = neuromuscular_finding(omega, zeta, ts());
            assert_eq!(found.is_some(), implausible, "{omega}, {zeta}");
            assert!(found.is_none_or(|f| f.kind == "neuromuscular-lag"));
        }
    }

    #[test]
    fn search_termination_and_delay_bounds_are_reported() {
        let of = |reason| {
            search_finding(Termination { reason, iterations: 3 }).map(|finding| (finding.kind, finding.severity.name()))
        };
        assert_eq!(of(Reason::SmallDecrease), None);
        assert_eq!(of(Reason::Direct), None);
        assert_eq!(of(Reason::Border), Some(("border", "doubt")));
        assert_eq!(of(Reason::IterationLimit), Some(("not-converged", "doubt")));
        assert_eq!(of(Reason::ExactFit), Some(("exact-fit", "note")));
        assert!(delay_finding(0.05, (0.05, 0.6), "").is_some() && delay_finding(0.6, (0.05, 0.6), "").is_some());
        assert!(delay_finding(0.28, (0.05, 0.6), "").is_none() && delay_finding(0.28, (0.28, 0.28), "").is_none());
    }
}
