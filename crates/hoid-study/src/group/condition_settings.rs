//! Known properties of a condition: the keys of `[conditions.NAME]`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::preparation_settings::PreparationSettings;

/// Known properties of a condition.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ConditionSettings {
    /// Controlled element, as `90/(s(s+6))` or `90/1,6,0` (by descending powers of s).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub controlled_element: Option<String>,
    /// Channel whose lines excite the loop: f_t or a disturbance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub excitation: Option<String>,
    /// Period of the excitation, s; the longest that all its lines are harmonics of where it is
    /// left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub period_s: Option<f64>,
    /// Samples by which u is recorded later than the e that it answers: `e[k]` belongs to
    /// `u[k + offset]`.
    pub offset_samples: f64,
    /// Time at which the task changes, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub change_s: Option<f64>,
    /// Treatment of its runs before they are analysed; what it names wins over that of the group.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prepare: Option<PreparationSettings>,
}
