//! One operator of the family.

use num_complex::Complex64;

use super::{
    dual::{Dual, PARTIAL_COUNT},
    form::{Coordinate, Form, Rational},
};
use crate::{
    ContinuousTransferFunction, ModelError, polynomial,
    uncertainty::{Estimate, variance_along},
};

/// Names and units of the parameters of all forms; the names are those of [`FamilyOperator::named_parameters`].
pub const PARAMETERS: [(&str, &str); 16] = [
    ("K", ""),
    ("K_over_T_I", "1/s"),
    ("K_I", "1/s"),
    ("K_d", "s"),
    ("K_m", "s^2"),
    ("K_m_rate", "s"),
    ("K_e", ""),
    ("K_e_dot", "s"),
    ("T_L", "s"),
    ("T_I", "s"),
    ("c_1", "s"),
    ("c_2", "s^2"),
    ("alpha", "rad/s"),
    ("omega_nm", "rad/s"),
    ("zeta_nm", ""),
    ("tau_e", "s"),
];

/// An operator: its form and the values of its coordinates.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "SerializedOperator")]
pub struct FamilyOperator {
    form: Form,
    neuromuscular: bool,
    coordinates: Vec<f64>,
}

/// An operator as read from a file, before it is checked.
#[derive(serde::Deserialize)]
struct SerializedOperator {
    form: Form,
    neuromuscular: bool,
    coordinates: Vec<f64>,
}

impl TryFrom<SerializedOperator> for FamilyOperator {
    type Error = ModelError;

    fn try_from(written: SerializedOperator) -> Result<Self, ModelError> {
        Self::new(written.form, written.neuromuscular, &written.coordinates)
    }
}

/// Frequency response `Y(j omega)` and its derivatives with respect to the coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct FamilyResponse {
    /// Frequency response `Y(j omega)`.
    pub value: Complex64,
    /// Derivative of Y with respect to each coordinate.
    pub gradient: Vec<Complex64>,
}

impl FamilyResponse {
    /// Returns the covariance of the real part of `dY/Y = d ln Y`, the relative error of the gain, and its imaginary
    /// part, the error of the phase in rad. `covariance` is the covariance of the coordinates by rows.
    pub fn relative_covariance(&self, covariance: &[f64]) -> [[f64; 2]; 2] {
        let along = |part: fn(Complex64) -> f64| -> Vec<f64> {
            let gradient = self.gradient.iter().map(|g| part(g / self.value));
            gradient.collect()
        };
        // The variance of the sum of the real and imaginary parts contains their covariance twice.
        let [a, c, both] = [along(|z| z.re), along(|z| z.im), along(|z| z.re + z.im)]
            .map(|gradient| variance_along(&gradient, covariance));
        let b = 0.5 * (both - a - c);
        [[a, b], [b, c]]
    }
}

/// A reported parameter of an operator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NamedParameter {
    /// Name of the parameter: K, K_over_T_I, T_L, T_I, omega_nm, zeta_nm, tau_e and so on.
    pub name: &'static str,
    /// Unit of the parameter; empty for a ratio of control and error.
    pub unit: &'static str,
    /// Value of the parameter; infinite for T_I of a pure integration.
    pub value: f64,
    /// Coordinate of the parameter; `None` if the parameter depends on more than one coordinate.
    pub coordinate: Option<Coordinate>,
}

impl Form {
    /// Returns the names of the parameters of an operator with this form, in the order of
    /// [`FamilyOperator::named_parameters`].
    pub fn parameters(self, neuromuscular: bool) -> Vec<&'static str> {
        let any = FamilyOperator {
            form: self,
            neuromuscular,
            coordinates: vec![1.0; self.coordinates(neuromuscular).len()],
        };
        any.named_parameters().iter().map(|p| p.name).collect()
    }
}

impl FamilyOperator {
    /// Creates an operator from its coordinates, in the order of [`Form::coordinates`].
    ///
    /// # Errors
    /// [`ModelError::Operator`] for an improper form, a wrong number of coordinates, or a value that is not finite;
    /// [`ModelError::OutOfRange`] for a negative delay.
    pub fn new(form: Form, neuromuscular: bool, coordinates: &[f64]) -> Result<Self, ModelError> {
        let wrong = |reason: String| Err(ModelError::Operator { reason });
        if !form.is_proper(neuromuscular) {
            return wrong(format!(
                "the form {form} without neuromuscular dynamics is a pure derivative, which has no sampled model; add \
                 the neuromuscular part or choose a form with a lag"
            ));
        }
        let expected = form.coordinates(neuromuscular);
        if coordinates.len() != expected.len() {
            return wrong(format!(
                "found {} coordinates for the form {form}; expected {}",
                coordinates.len(),
                expected.len()
            ));
        }
        if let Some(bad) = coordinates.iter().position(|c| !c.is_finite()) {
            return wrong(format!(
                "the coordinate {:?} is {}; expected a finite number",
                expected[bad], coordinates[bad]
            ));
        }
        let delay = coordinates[coordinates.len() - 1];
        if delay < 0.0 {
            return Err(ModelError::OutOfRange {
                quantity: "delay tau_e in s",
                found: delay,
                expected: "zero or more",
            });
        }
        Ok(Self {
            form,
            neuromuscular,
            coordinates: coordinates.to_vec(),
        })
    }

    /// Creates an operator from the named parameters of its form: a gain (`K`, `K_over_T_I`, `K_e`, `K_I`, `K_d`, `K_m`
    /// or `K_m_rate`),
    /// `T_L`, `T_I`, `omega_nm`, `zeta_nm`, `tau_e`, `c_1`, `c_2`, `alpha`. The operator has a neuromuscular part if
    /// omega_nm or zeta_nm is given. A missing tau_e is zero.
    ///
    /// # Errors
    /// [`ModelError::Operator`] for a name that is unknown or missing, for a gain given under two names, and for
    /// invalid values; otherwise as [`FamilyOperator::new`].
    pub fn from_names(form: Form, pairs: &[(String, f64)]) -> Result<Self, ModelError> {
        let wrong = |reason: String| ModelError::Operator { reason };
        let find = |name: &str| pairs.iter().find(|(n, _)| n == name).map(|(_, v)| *v);
        let need = |name: &str| find(name).ok_or_else(|| wrong(format!("{name} is missing for the form {form}")));
        let neuromuscular = find("omega_nm").is_some() || find("zeta_nm").is_some();
        let positive = |name: &str| {
            let value = need(name)?;
            if value > 0.0 {
                Ok(value)
            } else {
                Err(wrong(format!("{name} is {value}; expected a positive number")))
            }
        };
        let mut known = vec!["tau_e"];
        let mut values = Vec::new();
        for coordinate in form.coordinates(neuromuscular) {
            let (names, value): (&[&str], f64) = match coordinate {
                Coordinate::Gain if form.has_lag() => match find("K_over_T_I") {
                    Some(ratio) => (&["K_over_T_I"], ratio),
                    None => (&["K"], need("K")? / positive("T_I")?),
                },
                Coordinate::Gain => match form.gain_name_and_unit() {
                    ("K", _) if find("K").is_none() => (&["K_e"], need("K_e")?),
                    ("K_I", _) => (&["K_I"], need("K_I")?),
                    ("K_d", _) => (&["K_d"], need("K_d")?),
                    ("K_m", _) => (&["K_m"], need("K_m")?),
                    ("K_m_rate", _) => (&["K_m_rate"], need("K_m_rate")?),
                    _ => (&["K"], need("K")?),
                },
                Coordinate::Lead => (&["T_L"], need("T_L")?),
                Coordinate::LagRate => (&["T_I"], 1.0 / positive("T_I")?),
                Coordinate::Linear => (&["c_1"], need("c_1")?),
                Coordinate::Quadratic => (&["c_2"], need("c_2")?),
                Coordinate::Droop => (&["alpha"], need("alpha")?),
                Coordinate::LogOmega => (&["omega_nm"], positive("omega_nm")?.ln()),
                Coordinate::LogZeta => (&["zeta_nm"], positive("zeta_nm")?.ln()),
                Coordinate::Delay => (&["tau_e"], find("tau_e").unwrap_or(0.0)),
            };
            known.extend(names);
            values.push(value);
        }
        if let Some((name, _)) = pairs.iter().find(|(name, _)| !known.contains(&name.as_str())) {
            return Err(wrong(format!(
                "there is no parameter {name} in the form {form}; expected {}",
                known.join(", ")
            )));
        }
        Self::new(form, neuromuscular, &values)
    }

    /// Form of the operator.
    pub fn form(&self) -> Form {
        self.form
    }

    /// True if the operator has a neuromuscular part.
    pub fn has_neuromuscular(&self) -> bool {
        self.neuromuscular
    }

    /// Returns the coordinates, in the order of [`Form::coordinates`].
    pub fn coordinates(&self) -> &[f64] {
        &self.coordinates
    }

    fn coordinate(&self, wanted: Coordinate) -> Option<f64> {
        let all = self.form.coordinates(self.neuromuscular);
        let index = all.iter().position(|c| *c == wanted)?;
        Some(self.coordinates[index])
    }

    /// Delay tau_e in s.
    pub fn tau_e_s(&self) -> f64 {
        self.coordinates[self.coordinates.len() - 1]
    }

    /// Neuromuscular frequency in rad/s and damping ratio; `None` without a neuromuscular part.
    pub fn neuromuscular_parameters(&self) -> Option<(f64, f64)> {
        let (log_omega, log_zeta) = (
            self.coordinate(Coordinate::LogOmega)?,
            self.coordinate(Coordinate::LogZeta)?,
        );
        Some((log_omega.exp(), log_zeta.exp()))
    }

    /// Returns the parameters by name: `K`, `K_over_T_I`, `T_L`, `T_I`, `omega_nm`, `zeta_nm`, `tau_e`; `K_e`, `T_L`,
    /// `K_e_dot` for the lead; `c_1`, `c_2`, `alpha` for the alternative forms.
    pub fn named_parameters(&self) -> Vec<NamedParameter> {
        let gain = self.coordinates[0];
        let mut all = Vec::new();
        let mut put = |name, unit, value, coordinate| {
            all.push(NamedParameter {
                name,
                unit,
                value,
                coordinate,
            });
        };
        for (coordinate, &x) in self.form.coordinates(self.neuromuscular).iter().zip(&self.coordinates) {
            let own = Some(*coordinate);
            match coordinate {
                Coordinate::Gain if self.form.has_lag() => {
                    let rate = self.coordinate(Coordinate::LagRate).unwrap_or(0.0);
                    put("K", "", gain / rate, None);
                    put("K_over_T_I", "1/s", gain, own);
                }
                Coordinate::Gain if self.form == Form::Lead => put("K_e", "", gain, own),
                Coordinate::Gain => {
                    let (name, unit) = self.form.gain_name_and_unit();
                    put(name, unit, gain, own);
                }
                Coordinate::Lead => {
                    put("T_L", "s", x, own);
                    if self.form == Form::Lead {
                        put("K_e_dot", "s", gain * x, None);
                    }
                }
                Coordinate::LagRate => put("T_I", "s", 1.0 / x, own),
                Coordinate::Linear => put("c_1", "s", x, own),
                Coordinate::Quadratic => put("c_2", "s^2", x, own),
                Coordinate::Droop => put("alpha", "rad/s", x, own),
                Coordinate::LogOmega => put("omega_nm", "rad/s", x.exp(), own),
                Coordinate::LogZeta => put("zeta_nm", "", x.exp(), own),
                Coordinate::Delay => put("tau_e", "s", x, own),
            }
        }
        all
    }

    /// Returns the parameters of [`FamilyOperator::named_parameters`], each with its derivatives with respect to the
    /// coordinates.
    pub fn named_gradients(&self) -> Vec<(NamedParameter, Vec<f64>)> {
        let x = &self.coordinates;
        let all = self.form.coordinates(self.neuromuscular);
        let slot = |wanted: Coordinate| all.iter().position(|c| *c == wanted);
        let with = |parameter: NamedParameter| {
            let mut gradient = vec![0.0; x.len()];
            match (parameter.coordinate.and_then(slot), parameter.coordinate) {
                (Some(i), Some(Coordinate::LagRate)) => gradient[i] = -1.0 / (x[i] * x[i]),
                (Some(i), Some(Coordinate::LogOmega | Coordinate::LogZeta)) => gradient[i] = parameter.value,
                (Some(i), _) => gradient[i] = 1.0,
                // The parameter is a quotient or a product of coordinates: K = (K/T_I)/(1/T_I), or K_e_dot = K_e T_L.
                (None, _) => match (slot(Coordinate::LagRate), slot(Coordinate::Lead)) {
                    (Some(i), _) => {
                        gradient[0] = 1.0 / x[i];
                        gradient[i] = -x[0] / (x[i] * x[i]);
                    }
                    (None, Some(i)) => (gradient[0], gradient[i]) = (x[i], x[0]),
                    (None, None) => {}
                },
            }
            (parameter, gradient)
        };
        self.named_parameters().into_iter().map(with).collect()
    }

    /// Returns the parameters of [`FamilyOperator::named_parameters`] with their standard errors to first order, from
    /// the covariance of the coordinates by rows. A standard error is missing if there is no covariance or the
    /// parameter is infinite.
    pub fn named_estimates(&self, covariance: Option<&[f64]>) -> Vec<(NamedParameter, Estimate)> {
        let of = |(parameter, gradient): (NamedParameter, Vec<f64>)| {
            let estimate = match covariance {
                Some(c) if parameter.value.is_finite() => {
                    Estimate::with_variance(parameter.value, variance_along(&gradient, c))
                }
                _ => Estimate::fixed(parameter.value),
            };
            (parameter, estimate)
        };
        self.named_gradients().into_iter().map(of).collect()
    }

    /// Returns the coordinates as variables of dual numbers.
    pub(super) fn variables(&self) -> Vec<Dual> {
        let variable = |(i, &x): (usize, &f64)| Dual::variable(x, i);
        self.coordinates.iter().enumerate().map(variable).collect()
    }

    /// Returns omega and zeta as functions of the coordinates; `None` without a neuromuscular part.
    pub(super) fn neuromuscular_variables(&self, variables: &[Dual]) -> Option<(Dual, Dual)> {
        let n = variables.len();
        self.neuromuscular
            .then(|| (variables[n - 3].exp(), variables[n - 2].exp()))
    }

    /// Returns `Y(j omega)` and its derivatives, delay included.
    pub fn response_and_gradient(&self, omega_rad_s: f64) -> FamilyResponse {
        let variables = self.variables();
        let s = Complex64::new(0.0, omega_rad_s);
        let Rational { numerator, pole } = self.form.rational(&variables);
        let zero = Complex64::new(0.0, 0.0);
        // Value and derivatives of a polynomial in s whose coefficients are functions of the coordinates.
        let of = |coefficients: &[Dual]| {
            let mut value = zero;
            let mut partials = [zero; PARTIAL_COUNT];
            for c in coefficients.iter().rev() {
                value = value * s + c.value;
                for (p, d) in partials.iter_mut().zip(c.partials) {
                    *p = *p * s + d;
                }
            }
            (value, partials)
        };
        let (n, n_slopes) = of(&numerator);
        let mut value = n;
        let mut gradient = n_slopes;
        let mut divide = |(d, slopes): (Complex64, [Complex64; PARTIAL_COUNT])| {
            value /= d;
            for (g, slope) in gradient.iter_mut().zip(slopes) {
                *g = (*g - value * slope) / d;
            }
        };
        let one = Dual::constant(1.0);
        if let Some(a) = pole {
            divide(of(&[a, one]));
        }
        if let Some((omega, zeta)) = self.neuromuscular_variables(&variables) {
            divide(of(&[one, (zeta / omega).scaled(2.0), one / (omega * omega)]));
        }
        let delay = self.coordinates.len() - 1;
        let turn = (-s * self.tau_e_s()).exp();
        gradient[delay] -= value * s;
        FamilyResponse {
            value: value * turn,
            gradient: gradient[..self.coordinates.len()].iter().map(|g| g * turn).collect(),
        }
    }

    /// Returns `Y(j omega)`, delay included.
    pub fn response(&self, omega_rad_s: f64) -> Complex64 {
        self.response_and_gradient(omega_rad_s).value
    }

    /// Returns Y(s) as a transfer function with its delay.
    ///
    /// # Errors
    /// As [`ContinuousTransferFunction::new`].
    pub fn transfer_function(&self) -> Result<ContinuousTransferFunction, ModelError> {
        let variables = self.variables();
        let Rational { numerator, pole } = self.form.rational(&variables);
        let mut num: Vec<f64> = numerator.iter().rev().map(|c| c.value).collect();
        let mut den = vec![1.0];
        if let Some(a) = pole {
            den = vec![1.0, a.value];
        }
        if let Some((omega, zeta)) = self.neuromuscular_parameters() {
            let square = omega * omega;
            num.iter_mut().for_each(|c| *c *= square);
            den = polynomial::product(&den, &[1.0, 2.0 * zeta * omega, square]);
        }
        ContinuousTransferFunction::new(&num, &den)?.with_delay(self.tau_e_s())
    }
}

#[cfg(test)]
mod tests {
    use super::{super::examples::operator, *};

    fn typical(form: Form) -> FamilyOperator {
        operator(form, true, 0.1837)
    }

    /// A change in gain affects only the real part of `dY/Y`, and a change in delay affects only the imaginary part.
    #[test]
    fn gain_affects_real_part_and_delay_imaginary_part_of_relative_covariance() {
        let operator = FamilyOperator::new(Form::Gain, false, &[2.0, 0.3]).unwrap();
        let response = operator.response_and_gradient(5.0);
        let [[gain, both], [again, phase]] = response.relative_covariance(&[0.04, 0.003, 0.003, 0.01]);
        let expected = [0.04 / 4.0, -5.0 * 0.003 / 2.0, 25.0 * 0.01];
        for (found, expected) in [gain, both, phase].into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-14, "{found} {expected}");
        }
        assert_eq!(both, again);
    }

    #[test]
    fn parameter_names_cover_all_forms() {
        let mut seen = Vec::new();
        for form in Form::ALL {
            for named in typical(form).named_parameters() {
                assert!(PARAMETERS.contains(&(named.name, named.unit)), "{form} {}", named.name);
                seen.push(named.name);
                // K of a form with a lag has no coordinate, because it is a quotient of two coordinates.
                if let Some(coordinate) = named.coordinate {
                    assert_eq!(Coordinate::from_parameter(named.name), Some(coordinate), "{form}");
                }
            }
        }
        assert!(PARAMETERS.iter().all(|(name, _)| seen.contains(name)));
        for coordinate in Coordinate::ALL {
            assert_eq!(Coordinate::from_parameter(coordinate.parameter()), Some(coordinate));
        }
        assert_eq!(Coordinate::from_parameter("K_e_dot"), None);
        assert_eq!(Coordinate::from_parameter("gain"), None);
    }

    #[test]
    fn gradient_agrees_with_finite_differences() {
        for form in Form::ALL {
            let operator = typical(form);
            for omega in [0.3, 2.0, 9.0, 25.0] {
                let exact = operator.response_and_gradient(omega);
                for i in 0..operator.coordinates.len() {
                    let h = 1e-6;
                    let at = |by: f64| {
                        let mut x = operator.coordinates.clone();
                        x[i] += by;
                        FamilyOperator::new(form, true, &x).unwrap().response(omega)
                    };
                    let difference = (at(h) - at(-h)) / (2.0 * h);
                    let error = (exact.gradient[i] - difference).norm();
                    assert!(error < 1e-7 * (1.0 + difference.norm()), "{form} {i}: {error}");
                }
            }
        }
    }

    #[test]
    fn response_matches_the_transfer_function() {
        for form in Form::ALL {
            let operator = typical(form);
            let transfer = operator.transfer_function().unwrap();
            for omega in [0.5, 3.0, 20.0] {
                let difference = (operator.response(omega) - transfer.response(omega)).norm();
                assert!(difference < 1e-12 * transfer.response(omega).norm(), "{form}");
            }
        }
    }

    #[test]
    fn names_and_coordinates_round_trip() {
        for form in Form::ALL {
            let operator = typical(form);
            let pairs: Vec<(String, f64)> = operator
                .named_parameters()
                .iter()
                .filter(|p| !["K_e_dot"].contains(&p.name))
                .filter(|p| !(form.has_lag() && p.name == "K"))
                .map(|p| (p.name.to_owned(), p.value))
                .collect();
            let back = FamilyOperator::from_names(form, &pairs).unwrap();
            for (a, b) in back.coordinates.iter().zip(&operator.coordinates) {
                assert!((a - b).abs() < 1e-14 * (1.0 + b.abs()), "{form}");
            }
        }
        let k = |name: &str, value: f64| (name.to_owned(), value);
        let lag = FamilyOperator::from_names(Form::Lag, &[k("K", 10.0), k("T_I", 5.0)]).unwrap();
        assert_eq!(
            (lag.coordinates(), lag.has_neuromuscular()),
            (&[2.0, 0.2, 0.0][..], false)
        );
    }

    #[test]
    fn named_gradients_agree_with_finite_differences() {
        for form in Form::ALL {
            let operator = typical(form);
            for (k, (parameter, gradient)) in operator.named_gradients().into_iter().enumerate() {
                for i in 0..operator.coordinates.len() {
                    let at = |by: f64| {
                        let mut x = operator.coordinates.clone();
                        x[i] += by;
                        FamilyOperator::new(form, true, &x).unwrap().named_parameters()[k].value
                    };
                    let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
                    let error = (gradient[i] - difference).abs();
                    assert!(
                        error < 1e-6 * (1.0 + difference.abs()),
                        "{form} {}: {error}",
                        parameter.name
                    );
                }
            }
        }
    }

    #[test]
    fn invalid_operators_are_refused() {
        assert!(FamilyOperator::new(Form::Lead, false, &[1.0, 0.5, 0.2]).is_err());
        assert!(FamilyOperator::new(Form::Gain, false, &[1.0]).is_err());
        assert!(FamilyOperator::new(Form::Gain, false, &[1.0, -0.1]).is_err());
        assert!(FamilyOperator::new(Form::Gain, false, &[f64::NAN, 0.1]).is_err());
        let pair = |name: &str, value: f64| (name.to_owned(), value);
        let lag = |pairs: &[(String, f64)]| FamilyOperator::from_names(Form::Lag, pairs);
        assert!(
            lag(&[pair("K", 1.0)])
                .unwrap_err()
                .to_string()
                .contains("T_I is missing")
        );
        assert!(lag(&[pair("K", 1.0), pair("T_I", -2.0)]).is_err());
        assert!(lag(&[pair("K", 1.0), pair("T_I", 2.0), pair("T_L", 1.0)]).is_err());
        assert!(lag(&[pair("K", 1.0), pair("T_I", 2.0), pair("zeta_nm", 1.0)]).is_err());
    }
}
