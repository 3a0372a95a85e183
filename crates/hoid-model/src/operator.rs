//! The linear part of the human operator, in continuous and in discrete time.
//!
//! `H(s) = K_e (T_L s + 1) e^{-s tau_e} omega_nm^2 / (s^2 + 2 zeta_nm omega_nm s + omega_nm^2)`
//! (eq. 2)
//!
//! After a zero-order hold, H is exactly `(b0 + b1 q^-1) q^-nk / (1 + f1 q^-1 + f2 q^-2)` with `nk = tau_e/Ts + 1` (eq.
//! 11), by the formulas of [`hoid_core::zoh_operator`].

use hoid_core::zoh_operator::zoh_operator;
use nalgebra::{Matrix4, Vector4};

use crate::{
    ModelError, NotConvertible, SampleTime, second_order::ZohSecondOrder, transfer_function::ContinuousTransferFunction,
};

/// Parameters of the operator's response to the error.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct OperatorParameters {
    /// Error gain K_e, deg/deg.
    pub k_e: f64,
    /// Lead time constant T_L, s.
    pub t_l_s: f64,
    /// Neuromuscular frequency omega_nm, rad/s.
    pub omega_nm_rad_s: f64,
    /// Neuromuscular damping ratio zeta_nm.
    pub zeta_nm: f64,
    /// Delay tau_e, s.
    pub tau_e_s: f64,
}

/// The discrete operator that estimators fit: two coefficients in B, two poles, and a delay in samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscreteOperator {
    /// Discrete model without the delay, `(b0 + b1 q^-1) q^-1 / (1 + f1 q^-1 + f2 q^-2)`.
    pub zoh: ZohSecondOrder,
    /// Delay of b0 in samples.
    pub nk: usize,
    /// Time between two samples.
    pub sample_time: SampleTime,
}

/// Value of `1 + f1 + f2 + ...` below which a pole counts as a pole at s = 0: four orders of magnitude above rounding.
const ORIGIN_TOLERANCE: f64 = 1e-12;

/// True if a model with the denominator `1 + f1 q^-1 + f2 q^-2 + ...` has a pole at z = 1, up to rounding errors.
pub fn has_pole_at_origin(f: &[f64]) -> bool {
    (1.0 + f.iter().sum::<f64>()).abs() < ORIGIN_TOLERANCE
}

/// Names of the physical parameters, in the order of the rows or columns of every Jacobian in this module.
pub const PHYSICAL_PARAMETER_NAMES: [&str; 4] = ["K_e", "K_e_dot", "omega_nm", "zeta_nm"];

impl OperatorParameters {
    /// Creates an operator from named parameters: `K_e`, `T_L` or `K_e_dot`, `omega_nm`, `zeta_nm`, and `tau_e`, which
    /// is zero by default.
    ///
    /// # Errors
    /// [`ModelError::Operator`] for a name that is unknown or missing, or if one quantity is given under two names.
    pub fn from_names(pairs: &[(String, f64)]) -> Result<Self, ModelError> {
        const NAMES: [&str; 6] = ["K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm", "tau_e"];
        let wrong = |reason: String| ModelError::Operator { reason };
        if let Some((name, _)) = pairs.iter().find(|(name, _)| !NAMES.contains(&name.as_str())) {
            return Err(wrong(format!(
                "there is no parameter {name}; expected {}",
                NAMES.join(", ")
            )));
        }
        let find = |name: &str| pairs.iter().find(|(n, _)| n == name).map(|(_, v)| *v);
        let need = |name: &str| find(name).ok_or_else(|| wrong(format!("{name} is missing")));
        let k_e = need("K_e")?;
        let t_l_s = match (find("T_L"), find("K_e_dot")) {
            (Some(t_l), None) => t_l,
            (None, Some(k_e_dot)) if k_e != 0.0 => k_e_dot / k_e,
            (None, Some(_)) => return Err(wrong("T_L = K_e_dot/K_e does not exist for K_e = 0".to_owned())),
            (Some(_), Some(_)) => return Err(wrong("give T_L or K_e_dot, not both".to_owned())),
            (None, None) => return Err(wrong("T_L (or K_e_dot) is missing".to_owned())),
        };
        Ok(Self {
            k_e,
            t_l_s,
            omega_nm_rad_s: need("omega_nm")?,
            zeta_nm: need("zeta_nm")?,
            tau_e_s: find("tau_e").unwrap_or(0.0),
        })
    }

    /// Error-rate gain `K_e_dot = K_e T_L`, s.
    pub fn k_e_dot(&self) -> f64 {
        self.k_e * self.t_l_s
    }

    /// Returns the parameters without the delay, in the order of [`PHYSICAL_PARAMETER_NAMES`].
    fn parameters_without_delay(&self) -> [f64; 4] {
        [self.k_e, self.k_e_dot(), self.omega_nm_rad_s, self.zeta_nm]
    }

    /// True if the neuromuscular poles are in the open left half plane.
    pub fn is_stable(&self) -> bool {
        self.zeta_nm > 0.0
    }

    /// Returns H(s) with its delay.
    ///
    /// # Errors
    /// [`ModelError`] if a parameter is not finite or the delay is negative.
    pub fn transfer_function(&self) -> Result<ContinuousTransferFunction, ModelError> {
        let w2 = self.omega_nm_rad_s * self.omega_nm_rad_s;
        ContinuousTransferFunction::new(
            &[w2 * self.k_e_dot(), w2 * self.k_e],
            &[1.0, 2.0 * self.zeta_nm * self.omega_nm_rad_s, w2],
        )?
        .with_delay(self.tau_e_s)
    }

    /// Returns the exact discrete model for an error held over each sample.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] if omega_nm is not positive, a parameter is not finite, or the delay is not an
    /// integer number of samples.
    pub fn discretise(&self, sample_time: SampleTime) -> Result<DiscreteOperator, ModelError> {
        let checks = [
            ("error gain K_e", self.k_e, true),
            ("lead time T_L in s", self.t_l_s, true),
            (
                "neuromuscular frequency omega_nm in rad/s",
                self.omega_nm_rad_s,
                self.omega_nm_rad_s > 0.0,
            ),
            ("neuromuscular damping zeta_nm", self.zeta_nm, true),
        ];
        for (quantity, found, in_range) in checks {
            if !(found.is_finite() && in_range) {
                return Err(ModelError::OutOfRange {
                    quantity,
                    found,
                    expected: "a finite number, positive for omega_nm",
                });
            }
        }
        let Some(delay) = sample_time.whole_samples(self.tau_e_s) else {
            return Err(ModelError::OutOfRange {
                quantity: "delay tau_e in s",
                found: self.tau_e_s,
                expected: "zero or more, and a whole number of samples: round it or change the sample time",
            });
        };
        let ([b0, b1, f1, f2], _) = zoh_operator(self.parameters_without_delay(), sample_time.s());
        Ok(DiscreteOperator {
            zoh: ZohSecondOrder { b0, b1, f1, f2 }.check_finite()?,
            nk: delay + 1,
            sample_time,
        })
    }
}

impl DiscreteOperator {
    /// Returns the parameters of the operator that has this discrete model (eq. 12).
    ///
    /// # Errors
    /// [`NotConvertible`] with the reason; parameters are never clipped to a valid range.
    pub fn parameters(&self) -> Result<OperatorParameters, NotConvertible> {
        if self.nk == 0 {
            return Err(NotConvertible::NoDelay);
        }
        let c = self.zoh.inverse_zoh(self.sample_time)?;
        // K_e and omega_nm depend on 1 + f1 + f2, a difference of numbers of order 1. If this difference is nearly
        // zero, it consists mainly of rounding errors.
        if c.a2 <= 0.0 || has_pole_at_origin(&[self.zoh.f1, self.zoh.f2]) {
            return Err(NotConvertible::NoNaturalFrequency { a1: c.a1, a2: c.a2 });
        }
        let omega = c.a2.sqrt();
        let (k_e, k_e_dot) = (c.b1 / c.a2, c.b0 / c.a2);
        if k_e == 0.0 {
            return Err(NotConvertible::ZeroGain);
        }
        Ok(OperatorParameters {
            k_e,
            t_l_s: k_e_dot / k_e,
            omega_nm_rad_s: omega,
            zeta_nm: c.a1 / (2.0 * omega),
            tau_e_s: self.sample_time.s() * (self.nk - 1) as f64,
        })
    }
}

/// Returns the Jacobian of `[b0, b1, f1, f2]` (rows) with respect to `[K_e, K_e_dot, omega_nm, zeta_nm]` (columns).
pub fn discretisation_jacobian(operator: &OperatorParameters, sample_time: SampleTime) -> [[f64; 4]; 4] {
    zoh_operator(operator.parameters_without_delay(), sample_time.s()).1
}

/// Returns the Jacobian of `[K_e, K_e_dot, omega_nm, zeta_nm]` (rows) with respect to `[b0, b1, f1, f2]` (columns): the
/// inverse of [`discretisation_jacobian`]. `None` if that Jacobian is singular.
pub fn retrieval_jacobian(operator: &OperatorParameters, sample_time: SampleTime) -> Option<[[f64; 4]; 4]> {
    let forward = discretisation_jacobian(operator, sample_time);
    let matrix = Matrix4::from_fn(|i, j| forward[i][j]);
    // The columns are scaled to unit size, because the gains and omega_nm differ by orders of magnitude.
    let scale = Vector4::from_fn(|j, _| matrix.column(j).norm());
    if scale.iter().any(|s| *s == 0.0 || !s.is_finite()) {
        return None;
    }
    let scaled = Matrix4::from_fn(|i, j| matrix[(i, j)] / scale[j]);
    let inverse = scaled.lu().try_inverse()?;
    let result = std::array::from_fn(|i| std::array::from_fn(|j| inverse[(i, j)] / scale[i]));
    let finite = |rows: &[[f64; 4]; 4]| rows.iter().flatten().all(|v| v.is_finite());
    finite(&result).then_some(result)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::OperatingState;

    fn ts() -> SampleTime {
        SampleTime::new(0.01).unwrap()
    }

    fn s1() -> OperatorParameters {
        OperatingState::s1().operator
    }

    fn s2() -> OperatorParameters {
        OperatingState::s2().operator
    }

    fn other_operators() -> Vec<OperatorParameters> {
        let with = |omega, zeta| OperatorParameters {
            omega_nm_rad_s: omega,
            zeta_nm: zeta,
            ..s1()
        };
        vec![
            s1(),
            s2(),
            with(11.25, 1.0),
            with(11.25, 1.0 + 1e-9),
            with(11.25, 1.7),
            with(60.0, 0.1),
            with(60.0, 3.0),
            with(2.0, 0.05),
            with(150.0, 0.6),
            OperatorParameters { t_l_s: -0.2, ..s1() },
            OperatorParameters { k_e: -0.3, ..s1() },
        ]
    }

    #[test]
    fn discrete_parameters_match_expected_values() {
        // Expected values of the deterministic part, computed independently.
        let expected = [(s1(), 0.0442765923, -0.0431823806), (s2(), 0.1024498216, -0.1015987680)];
        for (operator, b0, b1) in expected {
            let d = operator.discretise(ts()).unwrap();
            assert!((d.zoh.f1 + 1.9121130548).abs() < 5e-11);
            assert!((d.zoh.f2 - 0.9242709633).abs() < 5e-11);
            assert!((d.zoh.b0 - b0).abs() < 5e-11);
            assert!((d.zoh.b1 - b1).abs() < 5e-11);
            assert_eq!(d.nk, 29);
        }
    }

    #[test]
    fn parameters_invert_discretise() {
        for operator in other_operators() {
            let back = operator.discretise(ts()).unwrap().parameters().unwrap();
            // b0 and b1 cancel in their sum to a fraction of about (omega_nm Ts)^2, and K_e loses this factor in
            // precision.
            for (a, b) in [
                (back.k_e, operator.k_e),
                (back.t_l_s, operator.t_l_s),
                (back.omega_nm_rad_s, operator.omega_nm_rad_s),
                (back.zeta_nm, operator.zeta_nm),
                (back.tau_e_s, operator.tau_e_s),
            ] {
                assert!((a - b).abs() < 1e-9 * b.abs(), "{operator:?}: {a} and {b}");
            }
        }
    }

    #[test]
    fn jacobian_agrees_with_finite_differences() {
        for operator in other_operators() {
            let exact = discretisation_jacobian(&operator, ts());
            let at = |p: [f64; 4]| {
                let d = OperatorParameters {
                    k_e: p[0],
                    t_l_s: p[1] / p[0],
                    omega_nm_rad_s: p[2],
                    zeta_nm: p[3],
                    tau_e_s: 0.28,
                }
                .discretise(ts())
                .unwrap();
                [d.zoh.b0, d.zoh.b1, d.zoh.f1, d.zoh.f2]
            };
            let p = [
                operator.k_e,
                operator.k_e_dot(),
                operator.omega_nm_rad_s,
                operator.zeta_nm,
            ];
            for j in 0..4 {
                let h = 1e-5 * p[j].abs();
                let (mut up, mut down) = (p, p);
                up[j] += h;
                down[j] -= h;
                let (up, down) = (at(up), at(down));
                for i in 0..4 {
                    let difference = (up[i] - down[i]) / (2.0 * h);
                    // Central differences have a truncation error of order h^2 and a rounding error of order eps/h,
                    // both below 1e-8 of the largest entry of the column.
                    let scale = (0..4).map(|k| exact[k][j].abs()).fold(0.0, f64::max);
                    assert!(
                        (exact[i][j] - difference).abs() < 2e-8 * scale,
                        "{operator:?} d{i}/d{}: {} and {difference}",
                        PHYSICAL_PARAMETER_NAMES[j],
                        exact[i][j]
                    );
                }
            }
        }
    }

    #[test]
    fn retrieval_jacobian_is_the_inverse() {
        for operator in other_operators() {
            let forward = discretisation_jacobian(&operator, ts());
            let back = retrieval_jacobian(&operator, ts()).unwrap();
            for i in 0..4 {
                for j in 0..4 {
                    let product: f64 = (0..4).map(|k| forward[i][k] * back[k][j]).sum();
                    let identity = f64::from(u8::from(i == j));
                    assert!((product - identity).abs() < 1e-7, "{operator:?}: {product} at {i},{j}");
                }
            }
        }
    }

    #[test]
    fn non_convertible_models_give_the_reason() {
        let model = |b: [f64; 2], f: [f64; 2], nk| DiscreteOperator {
            zoh: ZohSecondOrder {
                b0: b[0],
                b1: b[1],
                f1: f[0],
                f2: f[1],
            },
            nk,
            sample_time: ts(),
        };
        let reason = |b, f, nk| model(b, f, nk).parameters().unwrap_err();
        assert!(matches!(
            reason([1.0, 0.0], [-0.9, -0.05], 29),
            NotConvertible::NegativeRealPole { .. }
        ));
        assert!(matches!(
            reason([1.0, 0.0], [-2.0, 0.99], 29),
            NotConvertible::NoNaturalFrequency { .. }
        ));
        assert!(matches!(
            reason([1.0, -1.0], [-1.9, 0.92], 29),
            NotConvertible::ZeroGain
        ));
        assert!(matches!(reason([1.0, 0.0], [-1.9, 0.92], 0), NotConvertible::NoDelay));
        // An unstable complex pair can be converted; the result reports that it is not stable.
        let unstable = model([0.044, -0.043], [-1.95, 1.01], 29).parameters().unwrap();
        assert!(!unstable.is_stable());
    }

    #[test]
    fn bad_parameters_are_refused() {
        let refused = |o: OperatorParameters| o.discretise(ts()).is_err();
        assert!(refused(OperatorParameters { k_e: f64::NAN, ..s1() }));
        assert!(refused(OperatorParameters {
            omega_nm_rad_s: 0.0,
            ..s1()
        }));
        assert!(refused(OperatorParameters { tau_e_s: 0.285, ..s1() }));
        assert!(refused(OperatorParameters { tau_e_s: -0.01, ..s1() }));
    }
}
