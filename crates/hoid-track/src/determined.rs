//! The parameters of an operator that the data determine.
//!
//! A parameter is determined if it is more than two standard errors from zero and, if the method has a prior for the
//! parameter, the data have at least halved the prior variance. Otherwise the value comes mainly from the prior.

use hoid_model::uncertainty::OperatorEstimate;

use crate::{Trace, Tracker, methods::Method};

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
    let of = |(name, _, estimate): (&'static str, _, hoid_model::uncertainty::Estimate)| {
        let error = estimate.standard_error?;
        let learnt = supposed(name).is_none_or(|before| error * error < MAX_REMAINING_SHARE * before * before);
        Some((name, learnt && estimate.value.abs() > MIN_DISTANCE * error))
    };
    operator.rows().into_iter().filter_map(of).collect()
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

    /// Returns for each parameter of the operator a column, such as `K_e_determined`, with 1 in each row in which the
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
    use hoid_model::uncertainty::Estimate;

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
}
