//! Forgetting rules.

use std::collections::BTreeMap;

use hoid_ident::{
    IdentError,
    settings::{Bounds, Kind, Setting, Settings, Value},
};

/// Default rate of the normalised gradient.
const DEFAULT_RATE: f64 = 0.1;

/// Names of the rules.
const RULE_NAMES: [&str; 6] = [
    "exponential",
    "random-walk",
    "window",
    "variable",
    "directional",
    "gradient",
];

/// Forgetting rule of a recursion.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum ForgettingRule {
    /// One forgetting factor for each parameter; a scalar factor if all memories are equal.
    #[default]
    Exponential,
    /// Random walk: standard deviation of the drift of each parameter in one second, in the unit of the parameter.
    /// Parameters that are not named do not drift.
    RandomWalk(BTreeMap<String, f64>),
    /// Sliding rectangular window, as long as the shortest memory.
    Window,
    /// Variable forgetting factor, which gives the shortest memory while the innovations are as large as expected.
    Variable,
    /// Directional forgetting with the shortest memory.
    Directional,
    /// Normalised gradient with this rate, between 0 and 2.
    Gradient(f64),
}

/// Reads the rule from its name, without the options that belong to it.
impl Value for ForgettingRule {
    const KIND: Kind = Kind::Choice(&RULE_NAMES);

    fn read(text: &str) -> Result<Self, String> {
        match text.to_ascii_lowercase().replace('_', "-").as_str() {
            "exponential" => Ok(Self::Exponential),
            "random-walk" => Ok(Self::RandomWalk(BTreeMap::new())),
            "window" => Ok(Self::Window),
            "variable" => Ok(Self::Variable),
            "directional" => Ok(Self::Directional),
            "gradient" => Ok(Self::Gradient(DEFAULT_RATE)),
            _ => Err(format!("one of {}", RULE_NAMES.join(", "))),
        }
    }

    fn text(&self) -> Option<String> {
        let word = match self {
            Self::Exponential => 0,
            Self::RandomWalk(_) => 1,
            Self::Window => 2,
            Self::Variable => 3,
            Self::Directional => 4,
            Self::Gradient(_) => 5,
        };
        Some(RULE_NAMES[word].to_owned())
    }
}

impl ForgettingRule {
    fn rule_setting() -> Setting {
        Setting::of("forgetting", &Self::Exponential)
            .help(&["Type of forgetting; window, variable and directional use the shortest memory"])
    }

    fn drift_setting() -> Setting {
        Setting::of("drift", &BTreeMap::<String, f64>::new())
            .bounds(Bounds::NonNegative)
            .help(&[
                "For random-walk: drift of a parameter in one second (standard deviation),",
                "such as K_e=.01,K_e_dot=.01",
            ])
    }

    fn rate_setting() -> Setting {
        Setting::of("rate", &DEFAULT_RATE)
            .bounds(Bounds::Between(0.0, 2.0))
            .help(&["For gradient: step size"])
    }

    fn wrong_rule_error(name: &str, rule: &str) -> IdentError {
        IdentError::BadOption {
            option: name.to_owned(),
            found: "the option with another type of forgetting".to_owned(),
            expected: format!("forgetting = {rule}, to which this option belongs"),
        }
    }

    /// Checks that the options that the rule needs are given.
    ///
    /// # Errors
    /// [`IdentError::BadOption`].
    pub(crate) fn check(&self) -> Result<(), IdentError> {
        match self {
            Self::RandomWalk(drift) if drift.is_empty() => Err(IdentError::BadOption {
                option: "forgetting".to_owned(),
                found: "random-walk without drift".to_owned(),
                expected: "the standard deviation of the drift in one second, such as drift K_e=.01".to_owned(),
            }),
            Self::Gradient(rate) if !Self::rate_setting().bounds.contains(*rate) => Err(IdentError::BadOption {
                option: "the rate of the gradient".to_owned(),
                found: rate.to_string(),
                expected: Self::rate_setting().bounds.to_string(),
            }),
            _ => Ok(()),
        }
    }
}

/// `forgetting` must be set first, because the options of one rule are rejected by the others.
impl Settings for ForgettingRule {
    fn list(&self) -> Vec<Setting> {
        vec![Self::rule_setting(), Self::drift_setting(), Self::rate_setting()]
    }

    fn set(&mut self, name: &str, text: &str) -> Result<bool, IdentError> {
        match (name, &mut *self) {
            ("forgetting", rule) => *rule = Self::rule_setting().read(text)?,
            ("drift", Self::RandomWalk(drift)) => *drift = Self::drift_setting().read(text)?,
            ("drift", _) => return Err(Self::wrong_rule_error(name, RULE_NAMES[1])),
            ("rate", Self::Gradient(rate)) => *rate = Self::rate_setting().read(text)?,
            ("rate", _) => return Err(Self::wrong_rule_error(name, RULE_NAMES[5])),
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn get(&self, name: &str) -> Option<String> {
        match (name, self) {
            ("forgetting", rule) => rule.text(),
            ("drift", Self::RandomWalk(drift)) => drift.text(),
            ("rate", Self::Gradient(rate)) => rate.text(),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn settings_of_one_rule_are_refused_by_the_others() {
        let mut rule = ForgettingRule::default();
        assert!(rule.set("drift", "K_e=.01").is_err() && rule.set("rate", ".2").is_err());
        assert!(rule.set("forgetting", "random_walk").unwrap());
        assert!(rule.check().is_err());
        assert!(rule.set("drift", "K_e=.01").unwrap() && rule.check().is_ok());
        assert_eq!(rule.get("drift").as_deref(), Some("K_e=0.01"));
        assert!(rule.set("forgetting", "gradient").unwrap() && rule.set("rate", "0.5").unwrap());
        assert_eq!(rule, ForgettingRule::Gradient(0.5));
        assert!(rule.set("rate", "2").is_err() && rule.set("forgetting", "never").is_err());
        assert!(ForgettingRule::Gradient(2.0).check().is_err());
    }
}
