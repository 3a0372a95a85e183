//! Standard errors of derived quantities by the delta method.
//!
//! For `y = g(theta)` and an estimate with covariance P, `var y ~ G P G'` with `G = dg/dtheta` at the estimate. For the
//! operator, G is the inverse of the Jacobian of the exact zero-order hold ([`crate::operator::retrieval_jacobian`]).
//! The lead time constant is the ratio `T_L = K_e_dot / K_e`, whose first-order error is accurate as long as K_e is
//! several standard errors away from zero. Source: A. W. van der Vaart, *Asymptotic Statistics*, 1998, section 3.1.

use std::fmt;

use crate::{
    NotConvertible, OperatorParameters, PolynomialModel,
    estimate_table::write_rows,
    operator::retrieval_jacobian,
    remnant::{self, RemnantDiscretisation},
};

pub use crate::estimate::Estimate;

/// Parameters of the operator with their standard errors.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct OperatorEstimate {
    /// Error gain K_e, in the unit of u divided by the unit of e.
    pub k_e: Estimate,
    /// Lead time constant T_L, s.
    pub t_l_s: Estimate,
    /// Error-rate gain K_e_dot, in s times the unit of u divided by the unit of e.
    pub k_e_dot: Estimate,
    /// Neuromuscular frequency omega_nm, rad/s.
    pub omega_nm_rad_s: Estimate,
    /// Neuromuscular damping ratio zeta_nm.
    pub zeta_nm: Estimate,
    /// Delay tau_e = (nk - 1) Ts, s: an integer number of samples; it has no standard error if it was given.
    pub tau_e_s: Estimate,
}

impl From<OperatorParameters> for OperatorEstimate {
    /// Converts given parameters to estimates without standard errors.
    fn from(o: OperatorParameters) -> Self {
        Self {
            k_e: Estimate::fixed(o.k_e),
            t_l_s: Estimate::fixed(o.t_l_s),
            k_e_dot: Estimate::fixed(o.k_e_dot()),
            omega_nm_rad_s: Estimate::fixed(o.omega_nm_rad_s),
            zeta_nm: Estimate::fixed(o.zeta_nm),
            tau_e_s: Estimate::fixed(o.tau_e_s),
        }
    }
}

impl OperatorEstimate {
    /// Returns the parameters without their standard errors.
    pub fn parameters(&self) -> OperatorParameters {
        OperatorParameters {
            k_e: self.k_e.value,
            t_l_s: self.t_l_s.value,
            omega_nm_rad_s: self.omega_nm_rad_s.value,
            zeta_nm: self.zeta_nm.value,
            tau_e_s: self.tau_e_s.value,
        }
    }

    /// Returns the name, the unit and the estimate of each parameter, in the order in which they are reported; the
    /// names of the gains are those that [`GainUnit`](crate::GainUnit) uses.
    pub fn rows(&self) -> [(&'static str, &'static str, Estimate); 6] {
        [
            ("K_e", "", self.k_e),
            ("T_L", "s", self.t_l_s),
            ("K_e_dot", "s", self.k_e_dot),
            ("omega_nm", "rad/s", self.omega_nm_rad_s),
            ("zeta_nm", "", self.zeta_nm),
            ("tau_e", "s", self.tau_e_s),
        ]
    }
}

impl fmt::Display for OperatorEstimate {
    /// Formats a row for each parameter: name, value ± standard error, unit.
    ///
    /// ```
    /// # use hoid_model::{OperatorParameters, uncertainty::OperatorEstimate};
    /// let operator = OperatorParameters { k_e: 0.09, t_l_s: 0.4, omega_nm_rad_s: 11.25, zeta_nm: 0.35, tau_e_s: 0.28 };
    /// let table = OperatorEstimate::from(operator).to_string();
    /// assert!(table.starts_with("K_e        0.09\nT_L"));
    /// ```
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_rows(f, self.rows().map(|(name, unit, estimate)| (name, estimate, unit)))
    }
}

/// Parameters of the remnant filter with their standard errors.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RemnantEstimate {
    /// Order m of the filter.
    pub order: usize,
    /// Discretisation whose inverse gave these estimates.
    pub discretisation: RemnantDiscretisation,
    /// Time constant T_n, s.
    pub t_n_s: Estimate,
    /// Gain K_n.
    pub k_n: Estimate,
}

impl fmt::Display for RemnantEstimate {
    /// Formats a row for each parameter: name, value ± standard error, unit.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_rows(f, [("T_n", self.t_n_s, "s"), ("K_n", self.k_n, "")])
    }
}

/// Returns the variance `gradient' P gradient`, where `covariance` is the covariance P by rows.
pub fn variance_along(gradient: &[f64], covariance: &[f64]) -> f64 {
    let p = gradient.len();
    let mut total = 0.0;
    for (i, gi) in gradient.iter().enumerate() {
        for (j, gj) in gradient.iter().enumerate() {
            total += gi * covariance[i * p + j] * gj;
        }
    }
    // Rounding may leave a tiny negative number where the variance is zero.
    if total < 0.0 && total > -1e-12 * covariance.iter().fold(0.0_f64, |m, c| m.max(c.abs())) {
        0.0
    } else {
        total
    }
}

/// Returns the operator parameters of a model, with standard errors from the covariance of theta (by rows).
///
/// # Errors
/// [`NotConvertible`] with the reason.
pub fn operator_estimate(model: &PolynomialModel, covariance: &[f64]) -> Result<OperatorEstimate, NotConvertible> {
    let parameters = model.discrete_operator()?.parameters()?;
    let p = model.theta().len();
    let positions = model.operator_positions();
    let block: Vec<f64> = positions
        .iter()
        .flat_map(|&i| positions.iter().map(move |&j| covariance[i * p + j]))
        .collect();
    let jacobian = retrieval_jacobian(&parameters, model.sample_time());
    let estimate = |value: f64, gradient: Option<[f64; 4]>| match gradient {
        Some(g) => Estimate::with_variance(value, variance_along(&g, &block)),
        None => Estimate::fixed(value),
    };
    let row = |i: usize| jacobian.map(|j| j[i]);
    // The derivatives of the lead time constant follow from d T_L = (d K_e_dot - T_L d K_e) / K_e.
    let lead = jacobian.map(|j| std::array::from_fn(|k| (j[1][k] - parameters.t_l_s * j[0][k]) / parameters.k_e));
    Ok(OperatorEstimate {
        k_e: estimate(parameters.k_e, row(0)),
        t_l_s: estimate(parameters.t_l_s, lead),
        k_e_dot: estimate(parameters.k_e_dot(), row(1)),
        omega_nm_rad_s: estimate(parameters.omega_nm_rad_s, row(2)),
        zeta_nm: estimate(parameters.zeta_nm, row(3)),
        tau_e_s: Estimate::fixed(parameters.tau_e_s),
    })
}

/// Returns T_n and K_n from the noise polynomial D of a model. Their standard errors follow from the covariance of
/// theta (by rows) and from `innovation_sd_variance`, the variance of the standard deviation of the innovation, which
/// is uncorrelated with theta for Gaussian innovations.
///
/// # Errors
/// [`NotConvertible`] with the reason.
pub fn remnant_estimate(
    model: &PolynomialModel,
    covariance: Option<&[f64]>,
    innovation_sd: f64,
    innovation_sd_variance: f64,
    how: RemnantDiscretisation,
) -> Result<RemnantEstimate, NotConvertible> {
    let d = model.d();
    if !model.a().is_empty() {
        return Err(NotConvertible::NotARemnantFilter {
            order: d.len(),
            reason: "the noise passes through A as well".to_owned(),
        });
    }
    let found = remnant::retrieve(d, innovation_sd, model.sample_time(), how)?;
    let [by_time, by_gain] = remnant::retrieval_jacobian(d, innovation_sd, model.sample_time(), how)?;
    let orders = model.orders();
    let (p, m, first) = (orders.parameter_count(), orders.nd, orders.na + orders.nb + orders.nc);
    let estimate = |value: f64, gradient: &[f64]| {
        let Some(covariance) = covariance else {
            return Estimate::fixed(value);
        };
        let block: Vec<f64> = (0..m)
            .flat_map(|i| (0..m).map(move |j| covariance[(first + i) * p + first + j]))
            .collect();
        let from_sd = gradient[m] * gradient[m] * innovation_sd_variance;
        Estimate::with_variance(value, variance_along(&gradient[..m], &block) + from_sd)
    };
    Ok(RemnantEstimate {
        order: m,
        discretisation: how,
        t_n_s: estimate(found.t_n_s, &by_time),
        k_n: estimate(found.k_n, &by_gain),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Orders, SampleTime, Structure};

    /// Normal deviates by the method of Box and Muller from a linear congruential generator, which suffices for a check
    /// to a few per cent.
    fn normals(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        let mut uniform = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
        };
        move || (-2.0 * uniform().ln()).sqrt() * (2.0 * std::f64::consts::PI * uniform()).cos()
    }

    fn model(theta: Vec<f64>) -> PolynomialModel {
        let orders = Orders {
            nb: 2,
            nd: 1,
            nf: 2,
            nk: 29,
            ..Orders::default()
        };
        PolynomialModel::new(Structure::BoxJenkins, orders, SampleTime::new(0.01).unwrap(), theta).unwrap()
    }

    /// Parameters of state s1 with a remnant of T_n = 0.06 s.
    fn truth() -> Vec<f64> {
        vec![0.0442765923, -0.0431823806, -0.8464817249, -1.9121130548, 0.9242709633]
    }

    /// Lower triangular factor (by rows) of a covariance as in a fit: the errors of b0 and b1, and of f1 and f2, are
    /// nearly opposite. It is scaled down so that the conversion is nearly linear over its range.
    fn factor() -> Vec<f64> {
        let rows = [
            [2e-3, 0.0, 0.0, 0.0, 0.0],
            [-1.995e-3, 1.4e-4, 0.0, 0.0, 0.0],
            [0.0, 0.0, 5.8e-3, 0.0, 0.0],
            [-1.5e-3, 0.0, 0.0, 5.2e-3, 0.0],
            [1.5e-3, 0.0, 0.0, -5.18e-3, 5e-4],
        ];
        rows.iter().flatten().map(|v| v * 0.03).collect()
    }

    fn covariance() -> Vec<f64> {
        let l = factor();
        (0..25)
            .map(|ij| (0..5).map(|k| l[ij / 5 * 5 + k] * l[ij % 5 * 5 + k]).sum())
            .collect()
    }

    #[test]
    fn standard_errors_agree_with_monte_carlo() {
        let (p, l) = (covariance(), factor());
        let (sd, sd_variance) = (0.0117, (0.0117_f64 * 0.002).powi(2));
        let exact = operator_estimate(&model(truth()), &p).unwrap();
        let remnant = remnant_estimate(
            &model(truth()),
            Some(&p),
            sd,
            sd_variance,
            RemnantDiscretisation::ZeroOrderHold,
        )
        .unwrap();
        let mut draw = normals(17);
        let runs = 4000;
        let mut samples = vec![Vec::new(); 7];
        for _ in 0..runs {
            let z: Vec<f64> = (0..5).map(|_| draw()).collect();
            let theta: Vec<f64> = (0..5)
                .map(|i| truth()[i] + (0..=i).map(|k| l[i * 5 + k] * z[k]).sum::<f64>())
                .collect();
            let noisy_sd = sd + sd_variance.sqrt() * draw();
            let m = model(theta);
            let o = m.discrete_operator().unwrap().parameters().unwrap();
            let r = remnant::retrieve(m.d(), noisy_sd, m.sample_time(), RemnantDiscretisation::ZeroOrderHold).unwrap();
            let values = [o.k_e, o.t_l_s, o.k_e_dot(), o.omega_nm_rad_s, o.zeta_nm, r.t_n_s, r.k_n];
            samples.iter_mut().zip(values).for_each(|(s, v)| s.push(v));
        }
        let ours = [
            exact.k_e,
            exact.t_l_s,
            exact.k_e_dot,
            exact.omega_nm_rad_s,
            exact.zeta_nm,
            remnant.t_n_s,
            remnant.k_n,
        ];
        for (i, (sample, estimate)) in samples.iter().zip(ours).enumerate() {
            let mean = sample.iter().sum::<f64>() / runs as f64;
            let spread = (sample.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (runs - 1) as f64).sqrt();
            // The standard deviation of 4000 draws has a standard error of 1.1 %; the tolerance is four standard
            // errors.
            let ratio = spread / estimate.standard_error.unwrap();
            assert!((ratio - 1.0).abs() < 0.045, "parameter {i}: ratio {ratio}");
        }
        assert_eq!(exact.tau_e_s, Estimate::fixed(0.28));
    }

    #[test]
    fn missing_covariance_gives_no_standard_error() {
        let nothing = vec![f64::NAN; 25];
        let estimate = operator_estimate(&model(truth()), &nothing).unwrap();
        assert_eq!(estimate.k_e.standard_error, None);
        assert!((estimate.k_e.value - 0.09).abs() < 1e-6);
        assert_eq!(Estimate::with_variance(1.0, -1.0).standard_error, None);
    }

    #[test]
    fn non_convertible_model_gives_the_reason() {
        let mut theta = truth();
        theta[4] = -0.05;
        assert!(matches!(
            operator_estimate(&model(theta), &covariance()),
            Err(NotConvertible::NegativeRealPole { .. })
        ));
        let mut theta = truth();
        theta[2] = 0.5;
        let how = RemnantDiscretisation::default();
        assert!(remnant_estimate(&model(theta), None, 0.01, 0.0, how).is_err());
    }
}
