//! The parameters of an operator that the data determine.
//!
//! A parameter is determined if it is more than two standard errors from zero and, if the method has a prior for the
//! parameter, the data have at least halved the prior variance. Otherwise the value comes mainly from the prior. The
//! delay of a further input may be zero, so only its variance counts.

use hoid_model::uncertainty::{Estimate, OperatorEstimate};

use crate::{FurtherOperator, Trace, Tracker, methods::Method};

/// Smallest distance of a determined parameter from zero, in standard errors.
const MIN_DISTANCE: f64 = 2.0;
/// Largest remaining share of the prior variance of a determined parameter.
const MAX_REMAINING_SHARE: f64 = 0.5;

/// Name of a parameter, and true if the parameter is determined.
pub type Determination = (&'static str, bool);

fn determinations(method: &Method, operator: &OperatorEstimate) -> Vec<Determination> {
    let before = method.prior_deviations();
    let supposed = |name: &str| {
        let [omega, zeta, tau] = before?;
        match name {
            "omega_nm" => Some(omega),
            "zeta_nm" => Some(zeta),
            "tau_e" => Some(tau),
            _ => None,
        }
    };
    let of = |(name, _, estimate): (&'static str, _, Estimate)| {
        let error = estimate.standard_error?;
        let learnt = supposed(name).is_none_or(|before| error * error < MAX_REMAINING_SHARE * before * before);
        Some((name, learnt && estimate.value.abs() > MIN_DISTANCE * error))
    };
    operator.rows().into_iter().filter_map(of).collect()
}

fn further_determinations(delay_deviation_s: Option<f64>, operator: &FurtherOperator) -> [bool; 3] {
    let is_nonzero = |gain: Estimate| {
        gain.standard_error
            .is_some_and(|error| gain.value.abs() > MIN_DISTANCE * error)
    };
    let halved =
        |error: f64| delay_deviation_s.is_none_or(|before| error * error < MAX_REMAINING_SHARE * before * before);
    [
        is_nonzero(operator.k_f),
        is_nonzero(operator.k_f_dot),
        operator.tau_f_s.standard_error.is_some_and(halved),
    ]
}

impl Tracker {
    /// Returns each parameter of the current operator, and whether it is determined; parameters without a standard
    /// error are omitted.
    pub fn determinations(&self, operator: &OperatorEstimate) -> Vec<Determination> {
        determinations(&self.options().method, operator)
    }
}

impl Trace {
    /// Returns each parameter of the operator of a row, and whether it is determined; parameters without a standard
    /// error are omitted.
    pub fn determinations(&self, operator: &OperatorEstimate) -> Vec<Determination> {
        determinations(&self.options().method, operator)
    }

    /// Returns, for each parameter of the response to the further input in a row, whether it is determined.
    pub fn further_determinations(&self, operator: &FurtherOperator) -> [bool; FurtherOperator::NAMES.len()] {
        let options = self.options();
        let further = options.further.as_ref();
        let before = further.and_then(|f| options.method.further_delay_deviation(f, self.sample_time()));
        further_determinations(before, operator)
    }

    /// Returns a column for each parameter of the operator, such as `K_e_determined`, with 1 in each row in which the
    /// parameter is determined and 0 in the others. There are no columns for methods that need a start fit.
    pub fn determined_columns(
        &self,
        operators: &[Result<OperatorEstimate, hoid_model::NotConvertible>],
    ) -> Vec<(String, Vec<u64>)> {
        if !self.options().method.is_self_starting() {
            return Vec::new();
        }
        let rows: Vec<Vec<Determination>> = operators
            .iter()
            .map(|operator| operator.as_ref().map(|o| self.determinations(o)).unwrap_or_default())
            .collect();
        let column = |name: &str| {
            let of = |row: &Vec<Determination>| u64::from(row.iter().any(|(known, yes)| *known == name && *yes));
            (format!("{name}_determined"), rows.iter().map(of).collect())
        };
        self.operator_columns().into_iter().map(column).collect()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn prior_values_are_not_determined() {
        let e = |value: f64, error: f64| Estimate::with_variance(value, error * error);
        let operator = OperatorEstimate {
            k_e: e(1.0, 0.6),
            t_l_s: e(0.5, 0.1),
            k_e_dot: e(0.5, 0.1),
            omega_nm_rad_s: e(11.0, 3.0),
            zeta_nm: e(0.25, 0.05),
            tau_e_s: Estimate::fixed(0.2),
        };
        // Before the first sample the standard deviations are 3.3 rad/s for omega and .125 for zeta.
        let found = determinations(&Method::adaptive(), &operator);
        let expected = [
            ("K_e", false),
            ("T_L", true),
            ("K_e_dot", true),
            ("omega_nm", false),
            ("zeta_nm", true),
        ];
        assert_eq!(found, expected);
        let other = determinations(&Method::rpem(), &operator);
        assert!(other.contains(&("omega_nm", true)));
    }

    #[test]
    fn response_to_a_further_input_may_have_no_delay() {
        let e = |value: f64, error: f64| Estimate::with_variance(value, error * error);
        let operator = |gain_error: f64, delay_error: f64| FurtherOperator {
            k_f: e(0.5, gain_error),
            k_f_dot: e(0.02, 0.1),
            tau_f_s: e(0.0, delay_error),
        };
        assert_eq!(
            further_determinations(Some(0.1), &operator(0.1, 0.03)),
            [true, false, true]
        );
        assert_eq!(
            further_determinations(Some(0.1), &operator(0.3, 0.08)),
            [false, false, false]
        );
    }
}
