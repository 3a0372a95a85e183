//! Estimates for each person in each condition, read from the result directory of a group or from the JSON output of
//! `hoid group`.
//!
//! A person in a condition is a cell. The crossover, the margin and the parameters come from the joint fit to all runs,
//! with the standard errors of that fit. Root mean squares are means over the runs; responses come from the joint fit.
//! The standard error of a root mean square or a response is the standard deviation between runs divided by the square
//! root of the number of runs. If some parameters were estimated for each run, a cell is the mean over its runs.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use hoid_ident::family::Parameter;
use hoid_model::{Finding, Verdict, VerdictLevel, operator_family::PARAMETERS, uncertainty::Estimate};
use hoid_numerics::statistics::{mean, sample_variance};
use hoid_study::{
    StudyError,
    group::{FormEvidence, GroupSummary, MANIFEST_FILE, Manifest, Person, PersonStatus, RunEstimates, has_results},
};
use serde::Deserialize;
use serde_json::Value;

use super::{CommonForm, CompareError, Observation, Quantity, common_form::common_form};

/// A value with its standard error, the share of the prior in it, and the number of runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct EstimatedValue {
    pub value: f64,
    pub standard_error: Option<f64>,
    pub determined: bool,
    pub prior_share: f64,
    pub runs: usize,
}

/// A person in a condition.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cell {
    pub subject: String,
    pub condition: String,
    pub form: String,
    /// Reason why the person has no operator; `None` if there is one.
    pub missing: Option<String>,
    pub doubtful: bool,
    /// Evidence for the forms; empty if it is not known.
    forms: Vec<FormEvidence>,
    /// Form of the response to each further input; `None` if no response was found.
    inputs: BTreeMap<String, Option<String>>,
    runs: usize,
    estimates: BTreeMap<String, EstimatedValue>,
}

/// The estimates of a group.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupEstimates {
    pub(super) name: String,
    pub(super) cells: Vec<Cell>,
    runs: Option<RunEstimates>,
    /// Estimates of the runs in the common form; `None` if the runs were not analysed again in that form.
    common_form_runs: Option<RunEstimates>,
    /// Note about the common form of the parameters.
    pub(super) common: Option<Finding>,
}

impl GroupEstimates {
    /// Returns the path of a manifest whose recordings have not been analysed yet: `location` itself, or the manifest
    /// in a directory without results.
    pub fn recordings_path(location: &Path) -> Option<PathBuf> {
        if location.is_file() {
            return location
                .extension()
                .is_some_and(|ending| ending == "toml")
                .then(|| location.to_owned());
        }
        let manifest = location.join(MANIFEST_FILE);
        (manifest.is_file() && !has_results(location)).then_some(manifest)
    }

    /// Reads the results of a group from their directory or from JSON.
    ///
    /// # Errors
    /// [`CompareError::NoGroup`] with the reason, or [`CompareError::Study`] if a table cannot be read.
    pub fn read(location: &Path) -> Result<Self, CompareError> {
        let none = |reason: String| CompareError::NoGroup {
            path: location.display().to_string(),
            reason,
        };
        if !location.is_dir() {
            let bytes = hoid_io::read_bytes(location).map_err(StudyError::Io)?;
            let object = serde_json::from_slice(&bytes).map_err(|error| none(format!("it is not JSON: {error}")))?;
            return Self::from_json(&object).map_err(none);
        }
        let path = location.join(MANIFEST_FILE);
        if !path.exists() {
            return Err(none(format!(
                "there is no {MANIFEST_FILE} in it; for recordings, write one with `hoid group init {}`",
                location.display()
            )));
        }
        let manifest = Manifest::read(&path)?;
        if !location.join("people.parquet").exists() {
            return Err(none(
                "the table people is missing: the group is unfinished; continue with `hoid group --resume`".to_owned(),
            ));
        }
        let summary = GroupSummary::read(&manifest, location)?;
        Ok(Self {
            name: manifest.name.clone(),
            cells: merge_runs(summary.people.iter().map(Cell::from_person).collect()),
            runs: Some(RunEstimates::read(location)?),
            common_form_runs: None,
            common: None,
        })
    }

    /// Reads the JSON object that `hoid group --json` writes.
    fn from_json(object: &Value) -> Result<Self, String> {
        let people = object["people"].as_array().ok_or("it has no people")?;
        let cells: Vec<Cell> = people.iter().map(Cell::from_json).collect();
        if cells.iter().any(|cell| cell.subject.is_empty()) {
            return Err("an entry of people has no subject".to_owned());
        }
        Ok(Self {
            name: object["group"].as_str().unwrap_or("group").to_owned(),
            cells: merge_runs(cells),
            runs: None,
            common_form_runs: None,
            common: None,
        })
    }

    /// Returns the conditions, in the order of the manifest.
    pub fn conditions(&self) -> Vec<String> {
        distinct(self.cells.iter().map(|cell| &cell.condition))
    }

    /// Returns the people, in the order of the manifest.
    pub fn subjects(&self) -> Vec<String> {
        distinct(self.cells.iter().map(|cell| &cell.subject))
    }

    /// Returns the form in which the parameters of all people can be compared; `None` if there is no such form, or if
    /// the evidence for the forms is not known.
    pub fn common_form(&self) -> Option<CommonForm> {
        let fitted = self.cells.iter().filter(|cell| !cell.form.is_empty());
        let forms: Vec<&[FormEvidence]> = fitted.map(|cell| cell.forms.as_slice()).collect();
        common_form(&forms)
    }

    /// Replaces the parameters that belong to one form by those of the fits in the common form.
    pub(super) fn with_parameters_of(mut self, other: Self, common: CommonForm) -> Self {
        let best = forms_text(&forms(self.cells.iter(), None));
        for cell in &mut self.cells {
            let of = other.cell(&cell.subject, &cell.condition);
            let of_form = |name: &String| !Quantity::Parameter(name.clone()).is_form_independent();
            let is_parameter = |name: &String| of_form(name) && PARAMETERS.iter().any(|(known, _)| known == name);
            cell.estimates.retain(|name, _| !is_parameter(name));
            let Some(of) = of else { continue };
            cell.form.clone_from(&of.form);
            let parameters = of.estimates.iter().filter(|(name, _)| is_parameter(name));
            cell.estimates
                .extend(parameters.map(|(name, value)| (name.clone(), *value)));
        }
        self.common_form_runs = other.runs;
        self.common = Some(common.finding(&best));
        self
    }

    pub(super) fn cell(&self, subject: &str, condition: &str) -> Option<&Cell> {
        let is = |cell: &&Cell| cell.subject == subject && cell.condition == condition;
        self.cells.iter().find(is)
    }

    /// Returns a quantity of a cell, or the reason why the cell does not have it.
    pub(super) fn estimate(&self, cell: &Cell, quantity: &Quantity) -> Result<EstimatedValue, String> {
        let of_runs = || {
            let all: Vec<f64> = self
                .run_estimates(cell, quantity)
                .into_iter()
                .map(|(_, o)| o.value)
                .collect();
            if all.is_empty() {
                return Err(format!("no run has the {}", quantity.sentence_name()));
            }
            Ok(mean_over_runs(&all))
        };
        if matches!(quantity, Quantity::RmsE | Quantity::RmsU) {
            return of_runs();
        }
        if let Some(why) = &cell.missing {
            return Err(why.clone());
        }
        let Some(name) = quantity.key() else {
            let response = self.response(cell, None, quantity);
            let value = response.ok_or_else(|| format!("its operator has no {}", quantity.sentence_name()))?;
            let scatter = of_runs().ok().filter(|runs| runs.runs > 1);
            return Ok(EstimatedValue {
                value,
                standard_error: scatter.and_then(|runs| runs.standard_error),
                ..mean_over_runs(&vec![value; cell.runs.max(1)])
            });
        };
        let known = cell.estimates.get(&name).copied();
        let known = known
            .filter(|k| k.value.is_finite() || !k.determined)
            .ok_or_else(|| match quantity {
                Quantity::Crossover | Quantity::PhaseMargin => format!(
                    "it has no {}: the condition has no controlled element, or the loop gain does not cross 1",
                    quantity.sentence_name()
                ),
                Quantity::OfInput { parameter, input } => match cell.inputs.get(input) {
                    None => format!("{input} is not an input of its model"),
                    Some(None) => format!("no response to {input} was found"),
                    Some(Some(form)) => format!("the form {form} of its response to {input} has no {parameter}"),
                },
                _ => format!("its form {} has no {name}", cell.form),
            })?;
        if known.determined {
            Ok(known)
        } else {
            Err(format!("the data do not determine its {name}"))
        }
    }

    /// Returns a quantity in each run of a cell, with the names of the runs; empty if the runs are not known.
    pub(super) fn run_estimates(&self, cell: &Cell, quantity: &Quantity) -> Vec<(&str, Observation)> {
        let in_form = self
            .common_form_runs
            .as_ref()
            .filter(|_| !quantity.is_form_independent());
        let Some(runs) = in_form.or(self.runs.as_ref()) else {
            return Vec::new();
        };
        let key = quantity.key();
        let one = |run: &str| match &key {
            Some(name) => runs.parameter([&cell.subject, &cell.condition, run], name),
            None => self.response(cell, Some(run), quantity).map(Estimate::fixed),
        };
        let observation = |e: Estimate| Observation {
            value: e.value,
            variance: e.standard_error.map_or(0.0, |s| s * s),
        };
        let all = runs.runs(&cell.subject, &cell.condition).iter();
        all.filter_map(|run| Some((run.as_str(), observation(one(run)?))))
            .filter(|(_, o)| o.value.is_finite() && o.variance.is_finite())
            .collect()
    }

    fn response(&self, cell: &Cell, run: Option<&str>, quantity: &Quantity) -> Option<f64> {
        let at = |omega| {
            self.runs
                .as_ref()?
                .response([&cell.subject, &cell.condition], run, omega)
        };
        match quantity {
            Quantity::Gain(omega) => at(*omega).map(|[decibel, _]| decibel),
            Quantity::Phase(omega) => at(*omega).map(|[_, degrees]| degrees),
            _ => None,
        }
    }

    /// True if the estimates of single runs are known; false if the group was read from JSON.
    pub(super) fn has_runs(&self) -> bool {
        self.runs.is_some()
    }
}

impl Cell {
    fn without_estimates(subject: &str, condition: &str, runs: usize) -> Self {
        Self {
            subject: subject.to_owned(),
            condition: condition.to_owned(),
            form: String::new(),
            missing: None,
            doubtful: false,
            forms: Vec::new(),
            inputs: BTreeMap::new(),
            runs,
            estimates: BTreeMap::new(),
        }
    }

    /// Sets the verdict on the operator, or the reason why there is no operator.
    fn set_verdict(&mut self, verdict: Option<&Verdict>, reason: &str) {
        self.doubtful = verdict.is_some_and(|verdict| verdict.level == VerdictLevel::Doubtful);
        self.missing = match verdict {
            Some(verdict) if verdict.level == VerdictLevel::NotDetermined => {
                let reasons: Vec<&str> = verdict.reasons().collect();
                Some(format!(
                    "the data do not determine its operator: {}",
                    reasons.join("; ")
                ))
            }
            Some(_) => None,
            None => Some(format!("it has no operator: {reason}")),
        };
    }

    fn from_person(person: &Person) -> Self {
        let mut cell = Self::without_estimates(&person.subject, &person.condition, person.runs);
        let fitted = person.status == PersonStatus::Fitted;
        cell.set_verdict(person.verdict.as_ref().filter(|_| fitted), &person.reason);
        cell.form.clone_from(&person.form);
        cell.forms.clone_from(&person.forms);
        let runs = if person.covers_all_runs() { person.runs } else { 1 };
        let of_parameter = |p: &Parameter| EstimatedValue {
            value: p.value,
            standard_error: p.standard_error_person.or(p.standard_error),
            determined: p.determined,
            prior_share: p.prior_share,
            runs,
        };
        for p in &person.parameters {
            cell.estimates.insert(p.name.clone(), of_parameter(p));
        }
        for channel in &person.channels {
            let form = channel.form.map(|form| form.name().to_owned());
            cell.inputs.insert(channel.name.clone(), form);
            for p in &channel.parameters {
                cell.estimates
                    .insert(format!("{}[{}]", p.name, channel.name), of_parameter(p));
            }
        }
        for (quantity, estimate) in [
            (Quantity::Crossover, person.crossover_rad_s),
            (Quantity::PhaseMargin, person.phase_margin_deg),
        ] {
            if let (Some(e), Some(name)) = (estimate, quantity.key()) {
                cell.estimates
                    .insert(name, estimated_value(e.value, e.standard_error, runs));
            }
        }
        cell
    }

    fn from_json(person: &Value) -> Self {
        let text = |key: &str| person[key].as_str().unwrap_or_default();
        let runs = person["runs"].as_u64().unwrap_or(1) as usize;
        let mut cell = Self::without_estimates(text("subject"), text("condition"), runs);
        let verdict = Verdict::deserialize(&person["verdict"]).ok();
        cell.set_verdict(verdict.as_ref(), text("reason"));
        cell.form = text("form").to_owned();
        let runs = if text("run") == "all" { runs } else { 1 };
        let estimated = |found: &Value| EstimatedValue {
            determined: found["determined"] != false,
            prior_share: found["prior_share"].as_f64().unwrap_or(0.0),
            ..estimated_value(
                found["value"].as_f64().unwrap_or(f64::NAN),
                found["standard_error"].as_f64(),
                runs,
            )
        };
        let parts = [&person["parameters"], &person["open_loop"]];
        for (name, found) in parts.into_iter().filter_map(Value::as_object).flatten() {
            cell.estimates.insert(name.clone(), estimated(found));
        }
        for channel in person["channels"].as_array().into_iter().flatten() {
            let input = channel["input"].as_str().unwrap_or_default();
            let form = channel["form"].as_str().map(str::to_owned);
            cell.inputs.insert(input.to_owned(), form);
            for (name, found) in channel["parameters"].as_object().into_iter().flatten() {
                cell.estimates.insert(format!("{name}[{input}]"), estimated(found));
            }
        }
        cell
    }
}

/// Returns the forms that occur in some cells, of the operator or of the response to a further input, with the names of
/// the cells that have each form.
pub(super) fn forms<'a>(cells: impl Iterator<Item = &'a Cell>, input: Option<&str>) -> Vec<(&'a str, Vec<String>)> {
    let mut forms: Vec<(&str, Vec<String>)> = Vec::new();
    for cell in cells {
        let form = match input {
            None => Some(cell.form.as_str()).filter(|form| !form.is_empty()),
            Some(input) => cell.inputs.get(input).and_then(Option::as_deref),
        };
        let Some(form) = form else { continue };
        let name = format!("{} in {}", cell.subject, cell.condition);
        match forms.iter_mut().find(|(known, _)| *known == form) {
            Some((_, names)) => names.push(name),
            None => forms.push((form, vec![name])),
        }
    }
    forms
}

/// Formats forms and their cells, such as `lead: P03 in fo, P05 in fo; lead-lag: P09 in fo`.
pub(super) fn forms_text(forms: &[(&str, Vec<String>)]) -> String {
    let all = forms
        .iter()
        .map(|(form, names)| format!("{form}: {}", names.join(", ")));
    all.collect::<Vec<_>>().join("; ")
}

fn estimated_value(value: f64, standard_error: Option<f64>, runs: usize) -> EstimatedValue {
    EstimatedValue {
        value,
        standard_error,
        determined: true,
        prior_share: 0.0,
        runs,
    }
}

/// Returns the mean over runs, with the standard error from the scatter of the runs.
fn mean_over_runs(values: &[f64]) -> EstimatedValue {
    let error = (sample_variance(values) / values.len() as f64).sqrt();
    estimated_value(mean(values), Some(error).filter(|e| e.is_finite()), values.len())
}

/// Merges the cells of the individual runs of a person in one condition into a single cell.
fn merge_runs(cells: Vec<Cell>) -> Vec<Cell> {
    let mut all: Vec<Vec<Cell>> = Vec::new();
    for cell in cells {
        let same = |of: &&mut Vec<Cell>| of[0].subject == cell.subject && of[0].condition == cell.condition;
        match all.iter_mut().find(same) {
            Some(of) => of.push(cell),
            None => all.push(vec![cell]),
        }
    }
    let one = |mut of: Vec<Cell>| {
        if of.len() > 1 {
            let names: Vec<String> = of[0].estimates.keys().cloned().collect();
            let means = names.into_iter().map(|name| {
                let each: Vec<EstimatedValue> = of
                    .iter()
                    .filter_map(|cell| cell.estimates.get(&name).copied())
                    .collect();
                let values: Vec<f64> = each.iter().map(|k| k.value).collect();
                let merged = EstimatedValue {
                    determined: each.iter().all(|k| k.determined),
                    prior_share: each.iter().map(|k| k.prior_share).fold(0.0, f64::max),
                    ..mean_over_runs(&values)
                };
                (name, merged)
            });
            of[0].estimates = means.collect();
            of[0].doubtful = of.iter().any(|cell| cell.doubtful);
        }
        of.swap_remove(0)
    };
    all.into_iter().map(one).collect()
}

pub(super) fn distinct<'a>(names: impl Iterator<Item = &'a String>) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for name in names {
        if !all.contains(name) {
            all.push(name.clone());
        }
    }
    all
}

#[cfg(test)]
pub(super) mod tests {
    #![allow(clippy::unwrap_used)]
    use serde_json::json;

    use super::*;

    /// Returns a group, read from JSON, in which each person has a crossover and its standard error in each condition.
    pub fn group(people: &[(&str, &str, f64, f64)]) -> GroupEstimates {
        let person = |(subject, condition, value, error): &(&str, &str, f64, f64)| {
            json!({
                "subject": subject, "condition": condition, "run": "all", "runs": 5, "form": "lead-lag",
                "parameters": {"tau_e": {"value": 0.1 * value, "standard_error": 0.1 * error, "determined": true}},
                "open_loop": {"crossover_rad_s": {"value": value, "standard_error": error}},
                "verdict": {"level": "trustworthy", "reasons": []},
            })
        };
        let people: Vec<Value> = people.iter().map(person).collect();
        GroupEstimates::from_json(&json!({"group": "test", "people": people})).unwrap()
    }

    #[test]
    fn missing_estimates_have_a_reason() {
        let object = json!({"group": "g", "people": [
            {"subject": "P", "condition": "c", "run": "all", "runs": 0, "status": "failed", "reason": "no run could be read"},
            {"subject": "Q", "condition": "c", "run": "all", "runs": 2, "form": "lead",
             "parameters": {"T_L": {"value": null, "determined": false}, "K_e": {"value": 2.0, "standard_error": 0.1}},
             "verdict": {"level": "doubtful", "reasons": ["it drifts"]}},
            {"subject": "R", "condition": "c", "run": "all", "verdict": {"level": "not determined", "reasons": ["too short"]}},
        ]});
        let group = GroupEstimates::from_json(&object).unwrap();
        let of = |subject: &str, name: &str| {
            let cell = group.cell(subject, "c").unwrap();
            group.estimate(cell, &name.parse().unwrap())
        };
        assert_eq!(of("P", "K_e").unwrap_err(), "it has no operator: no run could be read");
        assert_eq!(of("Q", "T_L").unwrap_err(), "the data do not determine its T_L");
        assert_eq!(of("Q", "T_I").unwrap_err(), "its form lead has no T_I");
        assert!(of("Q", "crossover").unwrap_err().contains("controlled element"));
        assert_eq!((of("Q", "K_e").unwrap().value, of("Q", "K_e").unwrap().runs), (2.0, 2));
        assert!(of("R", "K_e").unwrap_err().ends_with("too short"));
        assert!(of("Q", "rms_e").is_err() && of("Q", "gain_db@1").is_err() && !group.has_runs());
        assert!(GroupEstimates::from_json(&json!({"kind": "operator"})).is_err());
    }

    #[test]
    fn responses_to_further_inputs_are_compared_within_one_form() {
        let person = |subject: &str, condition: &str, form: Option<&str>, tau: f64| {
            let parameters = form.map_or(json!({}), |_| json!({"tau_f": {"value": tau, "standard_error": 0.01}}));
            json!({"subject": subject, "condition": condition, "run": "all", "runs": 5, "form": "gain",
                   "parameters": {}, "channels": [{"input": "r", "form": form, "parameters": parameters}],
                   "verdict": {"level": "trustworthy", "reasons": []}})
        };
        let of = |forms: [Option<&str>; 2]| {
            let people: Vec<Value> = (0..3)
                .flat_map(|k| {
                    let name = format!("P{k}");
                    [
                        person(&name, "a", Some("gain"), 0.2 + 0.01 * f64::from(k)),
                        person(&name, "b", forms[usize::from(k == 2)], 0.3 + 0.02 * f64::from(k)),
                    ]
                })
                .collect();
            let group = GroupEstimates::from_json(&json!({"people": people})).unwrap();
            let comparing = crate::compare::ComparisonOptions {
                quantities: vec!["tau_f[r]".parse().unwrap()],
                ..crate::compare::ComparisonOptions::default()
            };
            (comparing.run(&group).unwrap(), group)
        };
        let (same, group) = of([Some("gain"); 2]);
        assert!(
            (same.differences[0].estimate.value - 0.11).abs() < 0.01,
            "{:?}",
            same.differences
        );
        let none = group.estimate(&group.cells[0], &"K[r]".parse().unwrap()).unwrap_err();
        assert_eq!(none, "the form gain of its response to r has no K");
        let (without, group) = of([Some("gain"), None]);
        assert_eq!(without.differences[0].people.len(), 2);
        let cell = group.cell("P2", "b").unwrap();
        let none = group.estimate(cell, &"tau_f[r]".parse().unwrap()).unwrap_err();
        assert_eq!(none, "no response to r was found");
        let none = group.estimate(cell, &"tau_f[y]".parse().unwrap()).unwrap_err();
        assert_eq!(none, "y is not an input of its model");
        let (other, _) = of([Some("gain"), Some("lead")]);
        let reasons: Vec<String> = other.verdict.reasons().map(ToString::to_string).collect();
        assert!(
            other.differences.is_empty() && reasons.iter().any(|r| r.contains("feedforward/gain")),
            "{reasons:?}"
        );
    }

    #[test]
    fn separate_runs_are_averaged() {
        let row = |run: &str, k: f64| {
            json!({"subject": "P", "condition": "c", "run": run, "runs": 2, "form": "gain",
                   "parameters": {"K": {"value": k, "standard_error": 0.01}},
                   "verdict": {"level": "trustworthy", "reasons": []}})
        };
        let group = GroupEstimates::from_json(&json!({"people": [row("1", 1.0), row("2", 3.0)]})).unwrap();
        let found = group.estimate(&group.cells[0], &"K".parse().unwrap()).unwrap();
        assert_eq!((group.cells.len(), found.value, found.runs), (1, 2.0, 2));
        assert!((found.standard_error.unwrap() - 1.0).abs() < 1e-15);
    }
}
