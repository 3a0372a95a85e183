//! The result of a comparison.

use hoid_analysis::{AnalysisError, Setting, json};
use hoid_model::Verdict;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::{Coefficient, EffectSize, Quantity, Variation};

/// An estimate for one person, from which the means and differences are computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PersonEstimate {
    /// Quantity that was estimated.
    pub quantity: Quantity,
    /// Name of the person.
    pub subject: String,
    /// Name of the condition.
    pub condition: String,
    /// Group of the person; empty if groups are not compared.
    pub group: String,
    /// Value of the quantity; with a covariate, the value at the mean of the covariate.
    pub value: f64,
    /// Standard error of the value.
    pub standard_error: Option<f64>,
    /// Number of runs from which the value was estimated.
    pub runs: usize,
}

/// Mean over people in one condition.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mean {
    /// Quantity that was averaged.
    pub quantity: Quantity,
    /// Name of the condition.
    pub condition: String,
    /// Group of people; empty if groups are not compared.
    pub group: String,
    /// Number of people.
    pub people: usize,
    /// Standard deviation between people, excluding the errors of their estimates.
    pub tau: f64,
    /// The mean with its confidence interval.
    #[serde(flatten)]
    pub estimate: Coefficient,
}

/// A difference between two levels of a factor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Difference {
    /// Quantity that was compared.
    pub quantity: Quantity,
    /// The factor; for an interaction, both factors.
    pub factor: String,
    /// Whether the factor varies within or between people.
    pub variation: Variation,
    /// The level that is subtracted.
    pub from: String,
    /// The level from which `from` is subtracted.
    pub to: String,
    /// For an interaction, the factor whose effect differs, and its two levels.
    pub effect: Option<[String; 3]>,
    /// Names of the people, each with the index of their group; all indices are the same in comparisons within people.
    pub people: Vec<(String, usize)>,
    /// The difference with its confidence interval, t and p-value.
    #[serde(flatten)]
    pub estimate: Coefficient,
    /// Degrees of freedom of t.
    pub degrees_of_freedom: usize,
    /// p-value adjusted for all differences of this comparison.
    pub p_adjusted: f64,
    /// Effect size of the difference.
    pub effect_size: Option<EffectSize>,
    /// Bayes factor of a difference against no difference, from the t test with equal weights
    /// ([`bayes_factor`](super::bayes_factor)).
    #[serde(default)]
    pub bayes_factor: Option<f64>,
    /// Standard deviation, over people, of the difference, excluding the errors of the estimates.
    pub tau: f64,
    /// Share of tau^2 in the total variance of a typical estimate (I^2).
    pub i_squared: Option<f64>,
    /// Heterogeneity Q, and its p-value under the hypothesis that all people are equal.
    pub heterogeneity: Option<(f64, f64)>,
    /// Result of the t test with equal weights for all people.
    pub unweighted: Coefficient,
    /// Sentence that describes the difference.
    pub sentence: String,
}

/// Change in a quantity from run to run, averaged over people.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Learning {
    /// Quantity whose change is given.
    pub quantity: Quantity,
    /// Name of the condition; empty for the mean over all conditions.
    pub condition: String,
    /// Number of people.
    pub people: usize,
    /// Change per run with its confidence interval.
    #[serde(flatten)]
    pub estimate: Coefficient,
}

/// A missing estimate, with the reason.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MissingEstimate {
    /// The quantity that was compared without this estimate.
    pub quantity: Quantity,
    /// Name of the person.
    pub subject: String,
    /// Name of the condition.
    pub condition: String,
    /// Reason why the estimate is missing.
    pub reason: String,
}

/// Result of a comparison of conditions or of people.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Name of the group.
    pub group: String,
    /// The estimates of the people.
    pub estimates: Vec<PersonEstimate>,
    /// Means over people, by condition.
    pub means: Vec<Mean>,
    /// Differences between the levels of the factors.
    pub differences: Vec<Difference>,
    /// Changes from run to run, if requested.
    pub learning: Vec<Learning>,
    /// Missing estimates.
    pub left_out: Vec<MissingEstimate>,
    /// Settings of the comparison.
    pub settings: Vec<Setting>,
    /// The verdict on the comparison.
    pub verdict: Verdict,
}

/// Value of `kind` in the JSON of [`Comparison::json`].
const KIND: &str = "comparison";

impl Comparison {
    /// Returns the quantities that were compared, in order.
    pub fn quantities(&self) -> Vec<&Quantity> {
        let mut all: Vec<&Quantity> = Vec::new();
        for one in self.estimates.iter().map(|e| &e.quantity) {
            if !all.contains(&one) {
                all.push(one);
            }
        }
        all
    }

    /// Returns the comparison as a JSON object.
    pub fn json(&self) -> Map<String, Value> {
        let mut map = json::envelope(KIND, &[], &[], &[], &self.verdict, &self.settings);
        let with_unit = |quantity: &Quantity, one: Value| {
            let mut one = one;
            one["unit"] = json!(quantity.unit());
            one
        };
        let mut set = |key: &str, value: Value| map.insert(key.to_owned(), value);
        set("group", json!(self.group));
        let rows = self.estimates.iter().map(|e| with_unit(&e.quantity, json!(e)));
        set("estimates", rows.collect());
        set(
            "means",
            self.means.iter().map(|m| with_unit(&m.quantity, json!(m))).collect(),
        );
        let rows = self.differences.iter().map(|d| with_unit(&d.quantity, json!(d)));
        set("differences", rows.collect());
        set(
            "learning",
            self.learning.iter().map(|l| with_unit(&l.quantity, json!(l))).collect(),
        );
        set("left_out", json!(self.left_out));
        let state = json::state::serialise(self).map_or(Value::Null, Value::String);
        set("state", state);
        map
    }

    /// Returns the comparison as indented JSON text.
    pub fn to_json(&self) -> String {
        format!("{:#}", Value::Object(self.json()))
    }

    /// Reads the output of [`Self::to_json`].
    ///
    /// # Errors
    /// [`AnalysisError::NotAResult`] if the text is invalid or damaged, or has another version.
    pub fn from_json(text: &str) -> Result<Self, AnalysisError> {
        json::state::restore_state(text, KIND)
    }
}
