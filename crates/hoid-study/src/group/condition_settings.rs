//! Known properties of a condition: the keys of `[conditions.NAME]`.

use hoid_ident::family::SeenChannel;
use hoid_model::ContinuousTransferFunction;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::preparation_settings::PreparationSettings;

/// Known properties of a condition.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ConditionSettings {
    /// Controlled element, such as `90/(s(s+6))` or `90/1,6,0` (coefficients in descending powers of s). If the element
    /// changes, this is the one before the change.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub controlled_element: Option<String>,
    /// Channel whose lines excite the loop: f_t or a disturbance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub excitation: Option<String>,
    /// Further inputs of the person with their roles, such as `r=feedforward:0.25` for a target displayed with 0.25 s
    /// of preview.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub roles: Vec<String>,
    /// Period of the excitation, s. Default: the shortest period of which all lines are harmonics.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub period_s: Option<f64>,
    /// Number of samples by which u is recorded later than the e to which it responds: `e[k]` belongs to
    /// `u[k + offset]`.
    pub offset_samples: f64,
    /// Time at which the task changes, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub change_s: Option<f64>,
    /// Controlled element after the change.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub changes_to: Option<String>,
    /// Rate G of the change, 1/s: at time t the new element has the weight `1/(1 + exp(-G (t - change_s)))`. Default: a
    /// sudden change.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub change_per_s: Option<f64>,
    /// Preparation of the runs of this condition; its keys override those of the group.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prepare: Option<PreparationSettings>,
}

impl ConditionSettings {
    /// Returns the controlled element if it is known and the same during the whole run, otherwise `None`.
    pub fn constant_element(&self) -> Option<&str> {
        match self.changes_to {
            None => self.controlled_element.as_deref(),
            Some(_) => None,
        }
    }

    /// Returns the further inputs.
    ///
    /// # Errors
    /// The invalid entry, and the remedy.
    pub(super) fn channels(&self) -> Result<Vec<SeenChannel>, String> {
        let mut all: Vec<SeenChannel> = Vec::with_capacity(self.roles.len());
        for text in &self.roles {
            let channel: SeenChannel = text
                .parse()
                .map_err(|why| format!("roles: found {text:?}; expected {why}"))?;
            if all.iter().any(|other| other.name == channel.name) {
                return Err(format!("roles: {} has two roles, expected one", channel.name));
            }
            all.push(channel);
        }
        Ok(all)
    }

    /// Checks the controlled elements and the settings of the change between them.
    ///
    /// # Errors
    /// The invalid key, with the problem and the remedy.
    pub(super) fn check_elements(&self) -> Result<(), String> {
        let elements = [
            ("controlled_element", &self.controlled_element),
            ("changes_to", &self.changes_to),
        ];
        for (key, element) in elements {
            if let Some(element) = element {
                element
                    .parse::<ContinuousTransferFunction>()
                    .map_err(|reason| format!("{key}: {reason}"))?;
            }
        }
        if self.changes_to.is_some() && (self.controlled_element.is_none() || self.change_s.is_none()) {
            return Err(
                "changes_to: also give controlled_element (the element before the change) and change_s (the time of the change)"
                    .to_owned(),
            );
        }
        match self.change_per_s {
            Some(_) if self.changes_to.is_none() => {
                Err("change_per_s: also give changes_to, the element after the change".to_owned())
            }
            Some(rate) if !(rate.is_finite() && rate > 0.0) => Err(format!(
                "change_per_s is {rate}, expected a rate above 0; leave it out for a sudden change"
            )),
            _ => Ok(()),
        }
    }
}
