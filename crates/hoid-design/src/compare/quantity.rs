//! Quantities to compare: quantities with the same meaning for every person, and parameters of one form.

use std::{fmt, str::FromStr};

use hoid_model::operator_family::PARAMETERS;
use serde::{Deserialize, Serialize};

use super::CompareError;

/// The delay, a parameter of every form.
const DELAY_NAME: &str = "tau_e";
/// The delay of the response to a further input.
const INPUT_DELAY: (&str, &str) = ("tau_f", "s");

/// A quantity to compare.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum Quantity {
    /// Crossover frequency, rad/s.
    Crossover,
    /// Phase margin, deg.
    PhaseMargin,
    /// Gain of the person in dB, at a frequency in rad/s.
    Gain(f64),
    /// Phase of the person in deg, at a frequency in rad/s.
    Phase(f64),
    /// Root mean square of the error e.
    RmsE,
    /// Root mean square of the control output u.
    RmsU,
    /// A parameter of the operator, by its name.
    Parameter(String),
    /// A parameter of the response to a further input, written `tau_f[INPUT]`.
    OfInput {
        /// Name of the parameter.
        parameter: String,
        /// Name of the input.
        input: String,
    },
}

impl Quantity {
    /// Returns the default quantities of a comparison.
    pub fn defaults() -> Vec<Self> {
        vec![
            Self::Crossover,
            Self::PhaseMargin,
            Self::Parameter(DELAY_NAME.to_owned()),
        ]
    }

    /// Returns the unit of the quantity; empty if it has none or has the unit of the recording.
    pub fn unit(&self) -> &str {
        match self {
            Self::Crossover => "rad/s",
            Self::PhaseMargin | Self::Phase(_) => "deg",
            Self::Gain(_) => "dB",
            Self::RmsE | Self::RmsU => "",
            Self::Parameter(name) | Self::OfInput { parameter: name, .. } => {
                let mut known = PARAMETERS.iter().chain([&INPUT_DELAY]);
                known.find(|(n, _)| n == name).map_or("", |(_, unit)| unit)
            }
        }
    }

    /// Returns the name of the quantity for use in a sentence.
    pub fn sentence_name(&self) -> String {
        match self {
            Self::Crossover => "crossover".to_owned(),
            Self::PhaseMargin => "phase margin".to_owned(),
            Self::Gain(omega) => format!("gain at {omega} rad/s"),
            Self::Phase(omega) => format!("phase at {omega} rad/s"),
            Self::RmsE => "RMS of e".to_owned(),
            Self::RmsU => "RMS of u".to_owned(),
            Self::Parameter(name) if name == DELAY_NAME => "delay tau_e".to_owned(),
            Self::Parameter(name) => name.clone(),
            Self::OfInput { parameter, input } => format!("{parameter} of the response to {input}"),
        }
    }

    /// True if the meaning of the quantity does not depend on the form of the operator; false for all of its parameters
    /// except the delay.
    pub fn is_form_independent(&self) -> bool {
        !matches!(self, Self::Parameter(name) if name != DELAY_NAME)
    }

    /// Returns the name of the quantity among the estimates of a person; `None` for a gain or phase at a frequency.
    pub(super) fn key(&self) -> Option<String> {
        match self {
            Self::Crossover => Some("crossover_rad_s".to_owned()),
            Self::PhaseMargin => Some("phase_margin_deg".to_owned()),
            Self::RmsE | Self::RmsU | Self::Parameter(_) | Self::OfInput { .. } => Some(self.to_string()),
            Self::Gain(_) | Self::Phase(_) => None,
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Crossover => f.write_str("crossover"),
            Self::PhaseMargin => f.write_str("phase_margin"),
            Self::Gain(omega) => write!(f, "gain_db@{omega}"),
            Self::Phase(omega) => write!(f, "phase_deg@{omega}"),
            Self::RmsE => f.write_str("rms_e"),
            Self::RmsU => f.write_str("rms_u"),
            Self::Parameter(name) => f.write_str(name),
            Self::OfInput { parameter, input } => write!(f, "{parameter}[{input}]"),
        }
    }
}

impl FromStr for Quantity {
    type Err = CompareError;

    fn from_str(text: &str) -> Result<Self, CompareError> {
        let text = text.trim();
        let unknown = || CompareError::Quantity { found: text.to_owned() };
        if let Some((parameter, input)) = text.strip_suffix(']').and_then(|text| text.split_once('[')) {
            let mut known = PARAMETERS.iter().chain([&INPUT_DELAY]);
            return match known.any(|(name, _)| *name == parameter) && !input.is_empty() {
                true => Ok(Self::OfInput {
                    parameter: parameter.to_owned(),
                    input: input.to_owned(),
                }),
                false => Err(unknown()),
            };
        }
        if let Some((name, omega)) = text.split_once('@') {
            let omega: f64 = omega.parse().map_err(|_| unknown())?;
            return match name {
                _ if !(omega.is_finite() && omega > 0.0) => Err(unknown()),
                "gain_db" | "gain" => Ok(Self::Gain(omega)),
                "phase_deg" | "phase" => Ok(Self::Phase(omega)),
                _ => Err(unknown()),
            };
        }
        match text {
            "crossover" | "crossover_rad_s" => Ok(Self::Crossover),
            "phase_margin" | "margin" | "phase_margin_deg" => Ok(Self::PhaseMargin),
            "rms_e" => Ok(Self::RmsE),
            "rms_u" => Ok(Self::RmsU),
            "delay" => Ok(Self::Parameter(DELAY_NAME.to_owned())),
            name if PARAMETERS.iter().any(|(n, _)| *n == name) => Ok(Self::Parameter(name.to_owned())),
            _ => Err(unknown()),
        }
    }
}

impl From<Quantity> for String {
    fn from(quantity: Quantity) -> Self {
        quantity.to_string()
    }
}

impl TryFrom<String> for Quantity {
    type Error = CompareError;

    fn try_from(text: String) -> Result<Self, CompareError> {
        text.parse()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn quantity_names_round_trip() {
        for name in [
            "crossover",
            "phase_margin",
            "tau_e",
            "gain_db@2.5",
            "phase_deg@1",
            "rms_e",
            "omega_nm",
            "tau_f[f_t]",
            "K_d[r]",
        ] {
            assert_eq!(name.parse::<Quantity>().unwrap().to_string(), name);
        }
        assert_eq!(
            "delay".parse::<Quantity>().unwrap(),
            Quantity::Parameter(DELAY_NAME.to_owned())
        );
        assert_eq!("margin".parse::<Quantity>().unwrap().unit(), "deg");
        for bad in [
            "",
            "speed",
            "gain_db@",
            "gain_db@-1",
            "gain_db@nan",
            "tau_e@2",
            "tau_f",
            "tau_f[]",
            "speed[r]",
        ] {
            let error = bad.parse::<Quantity>().unwrap_err().to_string();
            assert!(error.contains("crossover") && error.contains("gain_db@W"), "{error}");
        }
        let of_input: Quantity = "tau_f[f_t]".parse().unwrap();
        assert_eq!((of_input.unit(), of_input.is_form_independent()), ("s", true));
        assert!(
            Quantity::Crossover.is_form_independent() && !Quantity::Parameter("K".to_owned()).is_form_independent()
        );
    }
}
