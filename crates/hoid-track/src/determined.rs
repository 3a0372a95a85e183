//! The parameters of an operator that the data determine.
//!
//! A parameter is determined if it is more than two standard errors from zero and, if the method has a prior for it,
//! the data have at least halved the prior variance: otherwise the value is that of the prior.

use hoid_model::uncertainty::OperatorEstimate;

use crate::{Trace, Tracker, methods::Method};

/// Distance from zero, in standard errors.
const APART: f64 = 2.0;
/// Largest remaining share of the prior variance.
const LEFT: f64 = 0.5;

/// Name of a parameter, and whether it is determined.
pub type Determined = (&'static str, bool);

fn determined(method: &Method, operator: &OperatorEstimate) -> Vec<Determined> {
    let before = method.spread_before();
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
        let learnt = supposed(name).is_none_or(|before| error * error < LEFT * before * before);
        Some((name, learnt && estimate.value.abs() > APART * error))
    };
    operator.rows().into_iter().filter_map(of).collect()
}

impl Tracker {
    /// Returns which parameters of the operator are determined now; those without a standard error are left out.
    pub fn determined(&self, operator: &OperatorEstimate) -> Vec<Determined> {
        determined(&self.options().method, operator)
    }
}

impl Trace {
    /// Returns which parameters of the operator of a row are determined; those without a standard error are left out.
    pub fn determined(&self, operator: &OperatorEstimate) -> Vec<Determined> {
        determined(&self.options().method, operator)
    }

    /// Columns that show for each parameter whether it is determined, 1 or 0, for methods with a prior:
    /// `K_e_determined` and so on.
    pub fn determined_columns(
        &self,
        operators: &[Result<OperatorEstimate, hoid_model::NotConvertible>],
    ) -> Vec<(String, Vec<u64>)> {
        if !self.options().method.starts_itself() {
            return Vec::new();
        }
        let rows: Vec<Vec<Determined>> = operators
            .iter()
            .map(|operator| operator.as_ref().map(|o| self.determined(o)).unwrap_or_default())
            .collect();
        let column = |name: &str| {
            let of = |row: &Vec<Determined>| u64::from(row.iter().any(|(known, yes)| *known == name && *yes));
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
    fn a_supposition_is_not_what_the_data_say() {
        let e = |value: f64, error: f64| Estimate::with_variance(value, error * error);
        let operator = OperatorEstimate {
            k_e: e(1.0, 0.6),
            t_l_s: e(0.5, 0.1),
            k_e_dot: e(0.5, 0.1),
            omega_nm_rad_s: e(11.0, 3.0),
            zeta_nm: e(0.25, 0.05),
            tau_e_s: Estimate::fixed(0.2),
        };
        // Before the first sample omega is known to 3.3 rad/s, zeta to .125.
        let found = determined(&Method::adaptive(), &operator);
        let expected = [
            ("K_e", false),
            ("T_L", true),
            ("K_e_dot", true),
            ("omega_nm", false),
            ("zeta_nm", true),
        ];
        assert_eq!(found, expected);
        let other = determined(&Method::rpem(), &operator);
        assert!(other.contains(&("omega_nm", true)));
    }
}
