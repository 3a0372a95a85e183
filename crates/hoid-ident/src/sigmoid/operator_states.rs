//! The operator before the change, after the change and at any time, with standard errors.

use hoid_model::{
    FamilyOperator, Form, ModelError,
    operator_family::Coordinate,
    uncertainty::{Estimate, OperatorEstimate, variance_along},
};

use super::{
    layout::{Layout, MAX_VARYING},
    sigmoid_point::SigmoidPoint,
};

/// A parameter with its name, unit and estimate.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct NamedEstimate {
    /// Name, such as K, T_L or T_I, as in [`FamilyOperator::named_parameters`].
    #[serde(deserialize_with = "hoid_model::static_names::name")]
    pub name: hoid_model::static_names::Name,
    /// Unit; empty if there is none.
    #[serde(deserialize_with = "hoid_model::static_names::name")]
    pub unit: hoid_model::static_names::Name,
    /// Value and standard error.
    pub estimate: Estimate,
}

/// An operator with the standard errors of its parameters.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ChangedOperator {
    /// The operator itself, without standard errors.
    pub operator: FamilyOperator,
    /// Parameters of the operator: the parameters of the numerator, products such as K_e T_L, and the parameters that
    /// do not change.
    pub parameters: Vec<NamedEstimate>,
}

impl ChangedOperator {
    /// Returns a parameter by its name.
    pub fn get(&self, name: &str) -> Option<Estimate> {
        self.parameters.iter().find(|p| p.name == name).map(|p| p.estimate)
    }

    /// Returns the parameters with the names of the thesis; `None` for forms other than a gain and a lead with the
    /// neuromuscular part.
    pub fn operator_estimate(&self) -> Option<OperatorEstimate> {
        if self.operator.form() != Form::Lead {
            return None;
        }
        Some(OperatorEstimate {
            k_e: self.get("K_e")?,
            t_l_s: self.get("T_L")?,
            k_e_dot: self.get("K_e_dot")?,
            omega_nm_rad_s: self.get("omega_nm")?,
            zeta_nm: self.get("zeta_nm")?,
            tau_e_s: self.get("tau_e")?,
        })
    }
}

/// An estimate of theta and its covariance.
#[derive(Debug, Clone, Copy)]
pub(super) struct ThetaEstimate<'a> {
    pub layout: &'a Layout,
    pub theta: &'a [f64],
    /// Covariance of theta, by rows; `None` for an exact fit.
    pub covariance: Option<&'a [f64]>,
    /// Variance of t_M if t_M is a change point, i.e. if the sigmoid is not linear over the interval of t_M; otherwise
    /// `None`.
    pub change_point: Option<f64>,
}

impl ThetaEstimate<'_> {
    /// Returns the operator before (0) or after (1) the change.
    pub fn operator_at_end(&self, end: usize) -> Result<ChangedOperator, ModelError> {
        let mut values = [0.0; MAX_VARYING];
        for (i, value) in values.iter_mut().enumerate().take(self.layout.varying) {
            *value = self.theta[Layout::end_indices(i)[end]];
        }
        let operator = self.layout.operator(self.theta, &values)?;
        let of = |gradient: &[f64]| {
            let mut whole = self.constant_part(gradient);
            for (i, slope) in gradient.iter().enumerate().take(self.layout.varying) {
                whole[Layout::end_indices(i)[end]] = *slope;
            }
            (whole, 0.0)
        };
        let parameters = self.named_estimates(&operator, |_| true, of);
        Ok(ChangedOperator { operator, parameters })
    }

    /// Returns the changing parameters at the time `time_s`, with their standard errors.
    pub fn at(&self, time_s: f64) -> Vec<NamedEstimate> {
        let here = SigmoidPoint::at(self.layout, self.theta, time_s);
        // An operator between two valid operators is always valid.
        let Ok(operator) = self.layout.operator(self.theta, &here.values) else {
            return Vec::new();
        };
        let of = |gradient: &[f64]| {
            let mut whole = self.constant_part(gradient);
            let mut by_share = 0.0;
            for (i, slope) in gradient.iter().enumerate().take(self.layout.varying) {
                let [first, last] = Layout::end_indices(i);
                (whole[first], whole[last]) = (slope * (1.0 - here.share), slope * here.share);
                by_share += slope * (self.theta[last] - self.theta[first]);
            }
            let (midpoint, log_rate) = (self.layout.midpoint, self.layout.log_rate);
            let mut of_time = 0.0;
            if let Some(variance) = self.change_point {
                let x = (time_s - self.theta[midpoint]) / variance.sqrt();
                // This logistic function closely approximates the normal distribution function.
                let happened = 1.0 / (1.0 + (-1.702 * x).exp());
                of_time = by_share * by_share * happened * (1.0 - happened);
            } else {
                (whole[midpoint], whole[log_rate]) =
                    (by_share * here.derivative_midpoint, by_share * here.derivative_log_rate);
            }
            (whole, of_time)
        };
        let changes = |gradient: &[f64]| gradient[..self.layout.varying].iter().any(|slope| *slope != 0.0);
        self.named_estimates(&operator, changes, of)
    }

    /// Converts the part of a gradient for the parameters that do not change to a gradient with respect to theta.
    fn constant_part(&self, gradient: &[f64]) -> Vec<f64> {
        let mut whole = vec![0.0; self.theta.len()];
        for (index, slope) in self
            .layout
            .pole_indices()
            .into_iter()
            .zip(&gradient[self.layout.varying..])
        {
            // theta contains omega_nm and zeta_nm, not their logarithms.
            let logarithmic = self
                .layout
                .neuromuscular_indices
                .is_some_and(|own| own.contains(&index));
            whole[index] = if logarithmic { slope / self.theta[index] } else { *slope };
        }
        whole
    }

    /// Returns the parameters of an operator for which `wanted` accepts the gradient. `of` converts a gradient with
    /// respect to the coordinates to a gradient with respect to theta, and returns a variance to be added.
    fn named_estimates(
        &self,
        operator: &FamilyOperator,
        wanted: impl Fn(&[f64]) -> bool,
        of: impl Fn(&[f64]) -> (Vec<f64>, f64),
    ) -> Vec<NamedEstimate> {
        let all = operator.named_gradients().into_iter();
        all.filter(|(_, gradient)| wanted(gradient))
            .map(|(parameter, gradient)| {
                let (mut whole, extra_variance) = of(&gradient);
                let mut value = parameter.value;
                // omega_nm and zeta_nm are elements of theta, so no logarithm is involved.
                let own = match (parameter.coordinate, self.layout.neuromuscular_indices) {
                    (Some(Coordinate::LogOmega), Some([omega, _])) => Some(omega),
                    (Some(Coordinate::LogZeta), Some([_, zeta])) => Some(zeta),
                    _ => None,
                };
                if let Some(index) = own {
                    (whole[index], value) = (1.0, self.theta[index]);
                }
                NamedEstimate {
                    name: parameter.name,
                    unit: parameter.unit,
                    estimate: match self.covariance {
                        Some(covariance) => estimate(value, variance_along(&whole, covariance) + extra_variance),
                        None => Estimate::fixed(value),
                    },
                }
            })
            .collect()
    }
}

/// Returns an estimate without a standard error if the variance is zero, as for fixed parameters.
pub(super) fn estimate(value: f64, variance: f64) -> Estimate {
    if variance > 0.0 {
        Estimate::with_variance(value, variance)
    } else {
        Estimate::fixed(value)
    }
}
