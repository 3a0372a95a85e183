//! The designed experiment: the forcing function, the expected errors for the typical person and for others, and the
//! JSON.

use hoid_analysis::{AnalysisError, Setting, json};
use hoid_model::{
    Verdict,
    family_scenario::{Display, Feedforward},
};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::{
    DesignedLine, DifferencePlan, EntryPoint, Expected, ExpectedQuantity, ExpectedResponse, RequestedQuantity, Task,
};

/// Expected errors for another person, or for another forcing function of the same duration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NamedExpected {
    /// Name of the person or of the forcing function.
    pub name: String,
    /// Expected errors from all runs.
    pub expected: Expected,
    /// Number of runs needed for the accepted errors of all requested quantities.
    pub runs_needed: usize,
}

/// A designed experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExperimentDesign {
    /// The typical person, with the controlled element and the remnant.
    pub task: Task,
    /// Point of entry of the forcing function. If the display shows the target, a disturbance is added.
    pub enters: EntryPoint,
    /// Name of the typical person.
    pub person: String,
    /// Length of a run in s, the period of the forcing function.
    pub length_s: f64,
    /// Number of runs.
    pub runs: usize,
    /// Number of runs needed for the accepted errors of all requested quantities, for the typical person.
    pub runs_needed: usize,
    /// The requested quantities with their accepted errors.
    pub wanted: Vec<RequestedQuantity>,
    /// Display of the task.
    pub display: Display,
    /// Lines of the forcing function, with the expected errors from all runs.
    pub lines: Vec<DesignedLine>,
    /// Response of the operator between the lines, with the expected errors from all runs.
    pub response: Vec<ExpectedResponse>,
    /// Response to a displayed target between the lines, with the expected errors from all runs; empty if the target is
    /// not displayed.
    pub response_to_target: Vec<ExpectedResponse>,
    /// Ratio of peak to rms of the forcing function; of two forcing functions, the larger ratio.
    pub crest_factor: f64,
    /// Standard deviation of one person from run to run, relative to the quantity.
    pub run_to_run: f64,
    /// Source of `run_to_run`, in words.
    pub run_to_run_source: String,
    /// Expected errors from all runs, for the typical person.
    pub expected: Expected,
    /// Expected errors for the other people, with the same forcing function.
    pub people: Vec<NamedExpected>,
    /// The other person with the largest errors; `None` if there are no other people.
    pub worst: Option<NamedExpected>,
    /// Expected errors with another forcing function, if requested.
    pub against: Option<NamedExpected>,
    /// Number of people and runs needed to find a difference, if requested.
    pub difference: Option<DifferencePlan>,
    /// Settings of the design.
    pub settings: Vec<Setting>,
    /// Verdict on the design.
    pub verdict: Verdict,
}

/// Value of `kind` in the JSON of [`ExperimentDesign::json`].
const KIND: &str = "design";

impl ExperimentDesign {
    /// Returns the design as a JSON object.
    pub fn json(&self) -> Map<String, Value> {
        let mut map = json::envelope(KIND, &[], &[], &[], &self.verdict, &self.settings);
        let mut set = |key: &str, value: Value| map.insert(key.to_owned(), value);
        set("person", json!(self.person));
        set("form", json!(self.task.state.operator.form().name()));
        set(
            "controlled_element",
            json!(self.task.state.controlled_element.to_string()),
        );
        set("display", json!(self.display.name()));
        set("enters", json!(self.enters.name()));
        set(
            "feedforward",
            self.task.feedforward.as_ref().map_or(Value::Null, feedforward_json),
        );
        set("runs", json!(self.runs));
        set("length_s", json::number(self.length_s));
        set("runs_needed", json!(self.runs_needed));
        set("run_to_run", json::number(self.run_to_run));
        set("run_to_run_source", json!(self.run_to_run_source));
        set("crest_factor", json::number(self.crest_factor));
        for (key, value) in expected_json(&self.expected) {
            set(&key, value);
        }
        set("lines", self.lines.iter().map(line_json).collect());
        set("response", self.response.iter().map(response_json).collect());
        set(
            "response_to_target",
            self.response_to_target.iter().map(response_json).collect(),
        );
        set("people", self.people.iter().map(named_expected_json).collect());
        set("worst", self.worst.as_ref().map_or(Value::Null, named_expected_json));
        set(
            "against",
            self.against.as_ref().map_or(Value::Null, named_expected_json),
        );
        set(
            "difference",
            self.difference.as_ref().map_or(Value::Null, DifferencePlan::json),
        );
        let state = json::state::serialise(self).map_or(Value::Null, Value::String);
        set("state", state);
        map
    }

    /// Returns the design as indented JSON text.
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

fn line_json(designed: &DesignedLine) -> Value {
    let mut one = response_json(&designed.response);
    one["enters"] = json!(designed.enters.name());
    one["amplitude"] = json::number(designed.line.amplitude_deg);
    one["phase_rad"] = json::number(designed.line.phase_rad);
    one["to_remnant"] = json::number(designed.to_remnant);
    one
}

fn feedforward_json(seen: &Feedforward) -> Value {
    json!({
        "form": seen.operator.form().name(),
        "preview_s": json::number(seen.preview_s),
    })
}

fn response_json(r: &ExpectedResponse) -> Value {
    json!({
        "omega_rad_s": json::number(r.omega_rad_s),
        "gain_db": json::number(r.gain_db.value),
        "gain_se_db": json::optional(r.gain_db.standard_error),
        "phase_deg": json::number(r.phase_deg.value),
        "phase_se_deg": json::optional(r.phase_deg.standard_error),
    })
}

fn named_expected_json(one: &NamedExpected) -> Value {
    let mut map = Map::new();
    map.insert("name".to_owned(), json!(one.name));
    map.insert("runs_needed".to_owned(), json!(one.runs_needed));
    map.extend(expected_json(&one.expected));
    Value::Object(map)
}

fn expected_json(e: &Expected) -> Map<String, Value> {
    let with_person = |mut one: Value, q: &ExpectedQuantity| {
        one["standard_error_person"] = json::optional(q.standard_error_person);
        one
    };
    let (mut of_loop, mut parameters) = (Map::new(), Vec::new());
    for q in &e.quantities {
        let key = match q.name {
            "crossover" => "crossover_rad_s",
            "phase_margin" => "phase_margin_deg",
            name => {
                let mut one = with_person(json::named(name, &q.estimate), q);
                one["unit"] = json!(q.unit);
                parameters.push(one);
                continue;
            }
        };
        of_loop.insert(key.to_owned(), with_person(json::estimate(&q.estimate), q));
    }
    let mut map = Map::new();
    map.insert("parameters".to_owned(), Value::Array(parameters));
    map.insert("open_loop".to_owned(), Value::Object(of_loop));
    map.insert("rms_e".to_owned(), json::number(e.rms_e));
    map.insert("rms_u".to_owned(), json::number(e.rms_u));
    map
}
