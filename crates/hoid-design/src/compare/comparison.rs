//! The result of a comparison.

use hoid_analysis::{AnalysisError, Setting, json};
use hoid_model::Verdict;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::{Coefficient, EffectSize, Quantity, Variation};

/// An estimate of a person, of which the means and differences are made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PersonEstimate {
    /// What.
    pub quantity: Quantity,
    /// Who.
    pub subject: String,
    /// In which condition.
    pub condition: String,
    /// The group of people that they are in; empty if none are compared.
    pub group: String,
    /// The value; with a covariate that at its middle.
    pub value: f64,
    /// Its standard error.
    pub standard_error: Option<f64>,
    /// Runs after it.
    pub runs: usize,
}

/// The mean over people.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mean {
    /// Of what.
    pub quantity: Quantity,
    /// In which condition.
    pub condition: String,
    /// Of which group of people; empty if none are compared.
    pub group: String,
    /// How many people.
    pub people: usize,
    /// Standard deviation between people, beyond their errors.
    pub tau: f64,
    /// The mean with its interval.
    #[serde(flatten)]
    pub estimate: Coefficient,
}

/// A difference between two levels of a factor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Difference {
    /// Of what.
    pub quantity: Quantity,
    /// The factor; of an interaction both.
    pub factor: String,
    /// Where it varies.
    pub variation: Variation,
    /// The level that is subtracted.
    pub from: String,
    /// The level from which it is.
    pub to: String,
    /// For an interaction the factor whose effect differs, and its levels.
    pub effect: Option<[String; 3]>,
    /// The people, and of a difference between them the group of each.
    pub people: Vec<(String, usize)>,
    /// The difference with its interval, t and p.
    #[serde(flatten)]
    pub estimate: Coefficient,
    /// Degrees of freedom of t.
    pub degrees_of_freedom: usize,
    /// p next to all other differences of this comparison.
    pub p_adjusted: f64,
    /// Its size.
    pub effect_size: Option<EffectSize>,
    /// Standard deviation of the difference between people, beyond their errors.
    pub tau: f64,
    /// Share of that in the variance of a typical estimate.
    pub i_squared: Option<f64>,
    /// Heterogeneity Q and its probability where all people are the same.
    pub heterogeneity: Option<(f64, f64)>,
    /// The t test in which each person counts the same.
    pub unweighted: Coefficient,
    /// The difference in a sentence.
    pub sentence: String,
}

/// How a quantity changes from run to run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Learning {
    /// What.
    pub quantity: Quantity,
    /// In which condition; empty for the mean over all of them.
    pub condition: String,
    /// How many people.
    pub people: usize,
    /// Change a run, with its interval.
    #[serde(flatten)]
    pub estimate: Coefficient,
}

/// An estimate that does not exist, and why.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    /// The quantity that was compared without it.
    pub quantity: Quantity,
    /// Who.
    pub subject: String,
    /// In which condition.
    pub condition: String,
    /// Why it is missing.
    pub reason: String,
}

/// Do conditions differ, and people?
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Name of the group.
    pub group: String,
    /// The estimates of people.
    pub estimates: Vec<PersonEstimate>,
    /// Their means by condition.
    pub means: Vec<Mean>,
    /// The differences.
    pub differences: Vec<Difference>,
    /// Changes from run to run, where they were requested.
    pub learning: Vec<Learning>,
    /// Missing people.
    pub left_out: Vec<LeftOut>,
    /// The settings.
    pub settings: Vec<Setting>,
    /// The verdict on it.
    pub verdict: Verdict,
}

/// Kind in the JSON of [`Comparison::json`].
const KIND: &str = "comparison";

impl Comparison {
    /// The quantities that were compared, in their order.
    pub fn quantities(&self) -> Vec<&Quantity> {
        let mut all: Vec<&Quantity> = Vec::new();
        for one in self.estimates.iter().map(|e| &e.quantity) {
            if !all.contains(&one) {
                all.push(one);
            }
        }
        all
    }

    /// The object of the contract.
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
        let state = json::state::written(self).map_or(Value::Null, Value::String);
        set("state", state);
        map
    }

    /// The same as text, indented.
    pub fn to_json(&self) -> String {
        format!("{:#}", Value::Object(self.json()))
    }

    /// Reads the output of [`Self::to_json`].
    ///
    /// # Errors
    /// [`AnalysisError::NotAResult`] for a text that is invalid, is damaged, or is of another
    /// version.
    pub fn from_json(text: &str) -> Result<Self, AnalysisError> {
        let none = |found: String| AnalysisError::NotAResult { found };
        let object: Value = serde_json::from_str(text).map_err(|error| none(format!("it is not JSON: {error}")))?;
        if object["kind"] != KIND {
            return Err(none(format!("its kind is {}, expected {KIND:?}", object["kind"])));
        }
        let state = object["state"]
            .as_str()
            .ok_or_else(|| none("it has no state".to_owned()))?;
        json::state::read(state).map_err(none)
    }
}
