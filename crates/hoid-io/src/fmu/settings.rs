//! Settings in the resources of an FMU, read by its library at start.

use std::collections::BTreeMap;

use hoid_model::NamedChoice;
use serde::{Deserialize, Serialize};

use super::variables::{FmuKind, FmuStart, FmuVariable, Role};

/// Name of the settings file among the resources.
pub const FMU_SETTINGS_FILE: &str = "hoid.json";

/// Settings of an FMU.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FmuSettings {
    kind: String,
    /// Parameters whose start values differ from the defaults.
    #[serde(default)]
    parameters: BTreeMap<String, SettingValue>,
    /// Text of the scenario file that describes the operator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scenario: Option<String>,
    /// A fit as printed by `hoid identify --json`, used as the initial state of a tracker.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fit: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
enum SettingValue {
    Boolean(bool),
    Integer(i32),
    Real(f64),
    Text(String),
}

impl FmuSettings {
    /// Creates settings with default parameters.
    pub fn new(kind: FmuKind) -> Self {
        Self {
            kind: kind.name().to_owned(),
            parameters: BTreeMap::new(),
            scenario: None,
            fit: None,
        }
    }

    /// Sets the text of the scenario file that describes the operator.
    pub fn with_scenario(self, text: String) -> Self {
        Self {
            scenario: Some(text),
            ..self
        }
    }

    /// Sets the text of the fit from which a tracker starts.
    pub fn with_fit(self, text: String) -> Self {
        Self {
            fit: Some(text),
            ..self
        }
    }

    /// Sets the start value of a parameter.
    pub fn with(mut self, parameter: &str, start: FmuStart) -> Self {
        let given = match start {
            FmuStart::Real(value) => SettingValue::Real(value),
            FmuStart::Integer(value) => SettingValue::Integer(value),
            FmuStart::Boolean(value) => SettingValue::Boolean(value),
            FmuStart::Text(text) => SettingValue::Text(text),
        };
        self.parameters.insert(parameter.to_owned(), given);
        self
    }

    /// Parses the text of the settings file.
    ///
    /// # Errors
    /// A description of the problem in the text.
    pub fn parse(text: &str) -> Result<Self, String> {
        let settings: Self = serde_json::from_str(text).map_err(|error| format!("{FMU_SETTINGS_FILE}: {error}"))?;
        settings.kind()?;
        Ok(settings)
    }

    /// Returns the text of the settings file.
    pub fn text(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).unwrap_or_default();
        text.push('\n');
        text
    }

    /// Returns the kind of the FMU.
    ///
    /// # Errors
    /// A message if the kind is invalid.
    pub fn kind(&self) -> Result<FmuKind, String> {
        FmuKind::from_name(&self.kind).map_err(|error| format!("{FMU_SETTINGS_FILE}: {error}"))
    }

    /// Returns the variables with the start values of this FMU.
    ///
    /// # Errors
    /// A message if the FMU does not have a parameter or a value has the wrong type.
    pub fn variables(&self) -> Result<Vec<FmuVariable>, String> {
        let mut all = self.kind()?.variables();
        for (name, given) in &self.parameters {
            let parameter = (all.iter_mut())
                .find(|variable| variable.role == Role::Parameter && variable.name == name)
                .ok_or_else(|| format!("{FMU_SETTINGS_FILE}: the FMU has no parameter {name}"))?;
            parameter.start = match (&parameter.start, given) {
                (FmuStart::Real(_), SettingValue::Real(value)) => FmuStart::Real(*value),
                (FmuStart::Real(_), SettingValue::Integer(value)) => FmuStart::Real(f64::from(*value)),
                (FmuStart::Integer(_), SettingValue::Integer(value)) => FmuStart::Integer(*value),
                (FmuStart::Boolean(_), SettingValue::Boolean(value)) => FmuStart::Boolean(*value),
                (FmuStart::Text(_), SettingValue::Text(text)) => FmuStart::Text(text.clone()),
                _ => return Err(format!("{FMU_SETTINGS_FILE}: the parameter {name} has the wrong type")),
            };
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn settings_round_trip() {
        let settings = FmuSettings::new(FmuKind::Tracker)
            .with_fit("{}".to_owned())
            .with("sample_time", FmuStart::Real(0.02))
            .with("method", FmuStart::Text("multiple-model".to_owned()));
        let back = FmuSettings::parse(&settings.text()).unwrap();
        assert_eq!(back.variables().unwrap()[0].start, FmuStart::Real(0.02));
        assert_eq!(back, settings);
        // An integer number of seconds is also accepted for a real parameter.
        let whole = settings.clone().with("sample_time", FmuStart::Integer(1));
        assert_eq!(whole.variables().unwrap()[0].start, FmuStart::Real(1.0));
        for wrong in [
            settings.clone().with("colour", FmuStart::Real(1.0)),
            settings.with("method", FmuStart::Real(1.0)),
        ] {
            assert!(wrong.variables().is_err());
        }
        for wrong in ["", "{}", "{\"kind\": \"cat\"}"] {
            assert!(
                FmuSettings::parse(wrong).unwrap_err().contains(FMU_SETTINGS_FILE),
                "{wrong}"
            );
        }
    }
}
