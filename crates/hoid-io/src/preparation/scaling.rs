//! Factors and units of channels: `u=12.5`, `u=12.5:deg`, `e=rad:deg`.
//!
//! The factor multiplies the values in the file; the new unit follows the colon. Two known units of the same kind
//! define the factor exactly: `rad:deg` means 180 / pi. Gains of the operator are ratios of u to e: with e in deg and u
//! in V the gain K_e is in V/deg.

use std::f64::consts::PI;
use std::str::FromStr;

use super::record_parts::RecordParts;
use super::step::Step;
use crate::IoError;
use crate::wording::format_decimal;

/// Known units: name, kind, and size in multiples of the first unit of the kind.
const KNOWN_UNITS: [(&str, &str, f64); 18] = [
    ("rad", "angle", 1.0),
    ("mrad", "angle", 1e-3),
    ("deg", "angle", PI / 180.0),
    ("rev", "angle", 2.0 * PI),
    ("arcmin", "angle", PI / 10_800.0),
    ("m", "length", 1.0),
    ("cm", "length", 1e-2),
    ("mm", "length", 1e-3),
    ("in", "length", 0.0254),
    ("ft", "length", 0.3048),
    ("V", "voltage", 1.0),
    ("mV", "voltage", 1e-3),
    ("uV", "voltage", 1e-6),
    ("N", "force", 1.0),
    ("mN", "force", 1e-3),
    ("lbf", "force", 4.448_221_615_260_5),
    ("Nm", "torque", 1.0),
    ("mNm", "torque", 1e-3),
];

/// Other spellings of known units.
const UNIT_ALIASES: [(&[&str], &str); 9] = [
    (&["degree", "degrees", "degs", "°"], "deg"),
    (&["radian", "radians", "rads"], "rad"),
    (&["meter", "metre", "meters", "metres"], "m"),
    (&["centimeter", "centimetre", "centimeters", "centimetres"], "cm"),
    (&["millimeter", "millimetre", "millimeters", "millimetres"], "mm"),
    (&["inch", "inches"], "in"),
    (&["foot", "feet"], "ft"),
    (&["volt", "volts"], "V"),
    (&["newton", "newtons"], "N"),
];

/// Returns the standard name of a unit; an unknown unit is returned unchanged.
fn canonical_unit(unit: &str) -> &str {
    let small = unit.to_lowercase();
    let other = UNIT_ALIASES
        .into_iter()
        .find(|(names, _)| names.contains(&small.as_str()));
    other.map_or(unit, |(_, canonical)| canonical)
}

/// Factor by which a channel is multiplied, and the new unit of the channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Scaling {
    /// The factor, finite and not 0.
    factor: f64,
    /// Unit that the channel must have if the file gives one.
    from: Option<&'static str>,
    /// New unit; `None` if it is unknown, because the old unit no longer applies.
    to: Option<String>,
}

impl Scaling {
    /// Creates a multiplication by a factor; the new unit is `unit`, or unknown if `unit` is `None`.
    ///
    /// # Errors
    /// [`IoError::Scaling`] unless the factor is finite and not 0.
    pub fn from_factor(factor: f64, unit: Option<&str>) -> Result<Self, IoError> {
        if factor == 0.0 || !factor.is_finite() {
            return Err(scaling_error(
                &factor.to_string(),
                "a finite nonzero factor, since a channel times 0 carries no information",
            ));
        }
        Ok(Self {
            factor,
            from: None,
            to: unit.map(canonical_unit).map(str::to_owned),
        })
    }

    /// Returns the factor.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Returns the new unit of the channel, if known.
    pub fn unit(&self) -> Option<&str> {
        self.to.as_deref()
    }
}

/// Parses `FACTOR`, `FACTOR:UNIT` or `UNIT:UNIT`.
impl FromStr for Scaling {
    type Err = IoError;

    /// # Errors
    /// [`IoError::Scaling`].
    fn from_str(text: &str) -> Result<Self, IoError> {
        let (left, right) = match text.split_once(':') {
            Some((left, right)) => (left.trim(), Some(right.trim())),
            None => (text.trim(), None),
        };
        let known = |name: &str| KNOWN_UNITS.into_iter().find(|(unit, ..)| *unit == canonical_unit(name));
        // The left part is tried as a number first: "1:deg" sets the unit and changes no value.
        if let Ok(factor) = left.parse::<f64>() {
            if right == Some("") {
                return Err(scaling_error(text, "a unit after the colon, such as 12.5:deg"));
            }
            return Self::from_factor(factor, right).map_err(|_| {
                scaling_error(
                    text,
                    "a finite nonzero factor, since a channel times 0 carries no information",
                )
            });
        }
        let (Some(from), Some(to)) = (known(left), right.and_then(known)) else {
            let names: Vec<&str> = KNOWN_UNITS.iter().map(|(name, ..)| *name).collect();
            return Err(scaling_error(
                text,
                &format!(
                    "a factor (12.5), a factor and a unit (12.5:deg), or two units (rad:deg); known units: {}",
                    names.join(", ")
                ),
            ));
        };
        if from.1 != to.1 {
            return Err(scaling_error(
                text,
                &format!(
                    "two units of the same kind, but {} is a unit of {} and {} is a unit of {}",
                    from.0, from.1, to.0, to.1
                ),
            ));
        }
        Ok(Self {
            factor: from.2 / to.2,
            from: Some(from.0),
            to: Some(to.0.to_owned()),
        })
    }
}

fn scaling_error(found: &str, expected: &str) -> IoError {
    IoError::Scaling {
        found: found.to_owned(),
        expected: expected.to_owned(),
    }
}

impl RecordParts {
    /// Sets the units declared for channels; a declared unit that contradicts the file is an error.
    #[expect(clippy::indexing_slicing, reason = "`find` returns indices of channels")]
    pub(super) fn declare_units(&mut self, units: &std::collections::BTreeMap<String, String>) -> Result<(), IoError> {
        const STEP_NAME: &str = "unit";
        let named = units.iter().map(|(name, unit)| (name.clone(), unit.as_str()));
        for (channel, unit) in self.find_channels(STEP_NAME, named)? {
            let unit = canonical_unit(unit);
            let known = self.channels[channel].unit.clone();
            if !known.is_empty() && canonical_unit(&known) != unit {
                let name = &self.channels[channel].name;
                return Err(self.error(
                    STEP_NAME,
                    format!("{name} is in {known} according to its file, but declared to be in {unit}"),
                    format!("the unit of the file; convert it with --scale {name}={known}:{unit}"),
                ));
            }
            unit.clone_into(&mut self.channels[channel].unit);
        }
        Ok(())
    }

    #[expect(clippy::indexing_slicing, reason = "`find` returns indices of channels")]
    pub(super) fn scale(&mut self, scale: &std::collections::BTreeMap<String, Scaling>) -> Result<(), IoError> {
        const STEP_NAME: &str = "scale";
        let named = scale.iter().map(|(name, scaling)| (name.clone(), scaling));
        for (channel, scaling) in self.find_channels(STEP_NAME, named)? {
            let found = self.channels[channel].unit.clone();
            if let Some(from) = scaling
                .from
                .filter(|from| !found.is_empty() && *from != canonical_unit(&found))
            {
                return Err(self.error(
                    STEP_NAME,
                    format!(
                        "{} is in {found} according to its file, but the conversion is from {from}",
                        self.channels[channel].name
                    ),
                    format!(
                        "the unit of the file, or a factor such as {}",
                        format_decimal(scaling.factor)
                    ),
                ));
            }
            let channel = &mut self.channels[channel];
            channel.values.iter_mut().for_each(|value| *value *= scaling.factor);
            channel.unit = scaling.to.clone().unwrap_or_default();
            self.steps.push(Step::Scale {
                channel: channel.name.clone(),
                factor: scaling.factor,
                unit: scaling.to.clone(),
            });
        }
        Ok(())
    }
}
