//! Expected standard errors. The error of the operator in N runs is `se(theta_k) = sqrt((I^-1)_kk)` with the
//! information I of the lines (`information`). People vary from run to run; the error for the person is
//!
//! `sqrt(se^2 + (w s)^2/N)`
//!
//! where w is the relative variation from run to run and s the size of the quantity. Both parts fall as `1/sqrt(N)`.

use hoid_model::{static_names::Name, uncertainty::Estimate};
use serde::{Deserialize, Serialize};

/// A quantity of a person with its expected standard error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExpectedQuantity {
    /// Name of the quantity: `crossover`, `phase_margin`, or a parameter.
    #[serde(deserialize_with = "hoid_model::static_names::name")]
    pub name: Name,
    /// Unit of the quantity.
    #[serde(deserialize_with = "hoid_model::static_names::name")]
    pub unit: Name,
    /// Value of the quantity with the standard error of the operator in these runs.
    pub estimate: Estimate,
    /// Size to which the variation is relative: the value; for the phase margin its derivative with respect to the
    /// logarithm of the gain, and for the delay to a target, which may be zero, the delay to the error.
    pub size: f64,
    /// Standard error for the person, which includes the variation from run to run.
    pub standard_error_person: Option<f64>,
}

/// Returns true if the errors of a quantity are given in its unit: in deg for the phase margin, and in s for the delay
/// to a target, which may be zero. Relative errors of these quantities have no meaning.
pub fn has_absolute_error(name: &str) -> bool {
    matches!(name, "phase_margin" | "tau_f")
}

/// Expected standard errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Expected {
    /// Crossover frequency (rad/s), phase margin (deg), and the parameters of the person.
    pub quantities: Vec<ExpectedQuantity>,
    /// Root mean square of the error e, in the unit of the forcing function.
    pub rms_e: f64,
    /// Root mean square of the control output u.
    pub rms_u: f64,
}

impl Expected {
    /// Returns a copy whose errors for the person include the relative variation of one person between these runs.
    #[must_use]
    pub fn with_run_to_run(mut self, variation: f64, runs: usize) -> Self {
        let of_mean = variation / (runs as f64).sqrt();
        for q in &mut self.quantities {
            let own = q.estimate.standard_error;
            q.standard_error_person = own.map(|own| own.hypot(of_mean * q.size));
        }
        self
    }

    /// Returns a copy with all standard errors multiplied by a factor.
    #[must_use]
    pub fn scaled(mut self, by: f64) -> Self {
        for q in &mut self.quantities {
            for error in [&mut q.estimate.standard_error, &mut q.standard_error_person] {
                *error = error.map(|error| error * by);
            }
        }
        self
    }

    /// Returns a quantity by its name.
    pub fn quantity(&self, name: &str) -> Option<&ExpectedQuantity> {
        self.quantities.iter().find(|q| q.name == name)
    }

    /// Returns the value of a quantity with the standard error of the operator in these runs.
    pub fn estimate(&self, name: &str) -> Option<Estimate> {
        Some(self.quantity(name)?.estimate)
    }

    /// Returns the standard error of a quantity for the person, in the form in which accepted errors are given:
    /// relative to its value, or in its unit if [`has_absolute_error`] is true.
    pub fn error(&self, name: &str) -> Option<f64> {
        let found = self.quantity(name)?;
        let error = found.standard_error_person?;
        Some(match has_absolute_error(name) {
            true => error,
            false => error / found.estimate.value.abs(),
        })
    }

    /// Returns the parameters of the person, without the crossover frequency and the phase margin.
    pub fn parameters(&self) -> impl Iterator<Item = &ExpectedQuantity> {
        let is_parameter = |q: &&ExpectedQuantity| !matches!(q.name, "crossover" | "phase_margin");
        self.quantities.iter().filter(is_parameter)
    }

    /// Returns the names of all quantities.
    pub fn names(&self) -> Vec<&'static str> {
        self.quantities.iter().map(|q| q.name).collect()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::super::{
        expected,
        information::tests::{reference, task},
    };

    #[test]
    fn run_to_run_variation_adds_to_the_error_for_the_person() {
        let of_one = expected(&task(0.2), &reference(), 81.92).unwrap();
        let of_four = expected(&task(0.2), &reference(), 4.0 * 81.92).unwrap();
        let (one, four) = (of_one.with_run_to_run(0.1, 1), of_four.with_run_to_run(0.1, 4));
        for (a, b) in one.quantities.iter().zip(&four.quantities) {
            let (own, person) = (a.estimate.standard_error.unwrap(), a.standard_error_person.unwrap());
            assert!((person.powi(2) - own.powi(2) - (0.1 * a.size).powi(2)).abs() < 1e-12 * person.powi(2));
            assert!(
                (person / b.standard_error_person.unwrap() - 2.0).abs() < 1e-9,
                "{}",
                a.name
            );
        }
        let relative = one.quantity("tau_e").unwrap().standard_error_person.unwrap() / 0.25;
        assert!((one.error("tau_e").unwrap() - relative).abs() < 1e-12 && relative > 0.1);
        // The size of the phase margin is its derivative with respect to the logarithm of the gain, some degrees.
        let margin = one.quantity("phase_margin").unwrap();
        assert!((3.0..100.0).contains(&margin.size), "{margin:?}");
        assert_eq!(one.error("phase_margin"), margin.standard_error_person);
        assert_eq!(one.clone().scaled(0.5), one.clone().scaled(0.25).scaled(2.0));
    }
}
