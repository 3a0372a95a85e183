//! Expected standard errors: `se(theta_k) = sqrt((I^-1)_kk)` with the information I of the lines (`information`). The
//! errors of N runs are those of one run divided by `sqrt(N)`.

use hoid_model::{interned::Name, uncertainty::Estimate};
use serde::{Deserialize, Serialize};

/// A parameter of a person with its expected standard error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExpectedParameter {
    /// Name of the parameter.
    #[serde(deserialize_with = "hoid_model::interned::name")]
    pub name: Name,
    /// Unit of the parameter.
    #[serde(deserialize_with = "hoid_model::interned::name")]
    pub unit: Name,
    /// Value of the parameter with its expected standard error.
    pub estimate: Estimate,
}

/// Returns true if errors of a quantity are given in its unit: a relative error of the phase margin (deg), or of the
/// delay to a target, which may be zero (s), has no meaning.
pub fn has_absolute_error(name: &str) -> bool {
    matches!(name, "phase_margin" | "tau_f")
}

/// Expected standard errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Expected {
    /// Parameters of the person.
    pub parameters: Vec<ExpectedParameter>,
    /// Crossover frequency, rad/s.
    pub crossover_rad_s: Estimate,
    /// Phase margin, deg.
    pub phase_margin_deg: Estimate,
    /// Root mean square of the error e, in the unit of the forcing function.
    pub rms_e: f64,
    /// Root mean square of the control output u.
    pub rms_u: f64,
}

impl Expected {
    /// Returns a copy with all standard errors multiplied by a factor.
    #[must_use]
    pub fn scaled(&self, by: f64) -> Self {
        let of = |e: &Estimate| Estimate {
            standard_error: e.standard_error.map(|error| error * by),
            ..*e
        };
        let parameter = |p: &ExpectedParameter| ExpectedParameter {
            estimate: of(&p.estimate),
            ..p.clone()
        };
        Self {
            parameters: self.parameters.iter().map(parameter).collect(),
            crossover_rad_s: of(&self.crossover_rad_s),
            phase_margin_deg: of(&self.phase_margin_deg),
            ..*self
        }
    }

    /// Returns `crossover` in rad/s, `phase_margin` in deg, or a parameter, with its standard error.
    pub fn estimate(&self, name: &str) -> Option<Estimate> {
        match name {
            "crossover" => Some(self.crossover_rad_s),
            "phase_margin" => Some(self.phase_margin_deg),
            name => Some(self.parameters.iter().find(|p| p.name == name)?.estimate),
        }
    }

    /// Returns the standard error of a quantity as accepted errors are given: relative to its value, or in its unit if
    /// [`has_absolute_error`] is true.
    pub fn error(&self, name: &str) -> Option<f64> {
        let found = self.estimate(name)?;
        if has_absolute_error(name) {
            return found.standard_error;
        }
        Some(found.standard_error? / found.value.abs())
    }

    /// Returns the names of all quantities.
    pub fn names(&self) -> Vec<&'static str> {
        let parameters = self.parameters.iter().map(|p| p.name);
        ["crossover", "phase_margin"].into_iter().chain(parameters).collect()
    }
}
