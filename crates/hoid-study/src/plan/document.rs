//! A plan as a whole: reading, expansion into cells and estimators, and checks.

use std::{collections::BTreeSet, path::Path};

use hoid_io::ScenarioFileError;
use hoid_model::{
    ModelError,
    scenario::{RemnantStrength, ResolvedScenario, Scenario},
};
use serde::Deserialize;
use sha2::{Digest, Sha256};
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{
    estimator::EstimatorCell,
    estimator_table,
    grid::{Axis, Variant, line_at, variants},
    problem::PlanProblem,
    top_level_keys::Head,
};
use crate::StudyError;

/// A plan that has been checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Name of the study.
    pub name: String,
    /// Description in one line.
    pub title: String,
    /// Description of the study, or notes on it.
    pub description: String,
    /// Seed of the random streams.
    pub seed: u64,
    /// Number of replications of each cell.
    pub replications: u64,
    /// Number of replications that are run and stored together.
    pub block: u64,
    /// Number of samples from one stored point of a trace to the next; `None` if traces are not stored.
    pub trace_every: Option<usize>,
    /// True if the points of traces are stored, and not only their summary.
    pub trace_points: bool,
    /// True if standard errors are stored.
    pub standard_errors: bool,
    /// True if bias, bands and declared changes of recursions are evaluated.
    pub changes: bool,
    /// The scenarios of the grid.
    pub cells: Vec<Cell>,
    /// The estimators of the grid.
    pub estimators: Vec<EstimatorCell>,
    text: String,
}

/// One scenario of the grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Number of the cell in the study, counted from 0.
    pub index: u64,
    /// Name of the scenario.
    pub scenario: String,
    /// Name of the condition on which the scenario is based; empty if there is none.
    pub condition: String,
    /// For each list in the scenario's table, the selected entry.
    pub axes: Vec<Axis>,
    /// The scenario, ready to be simulated.
    pub resolved: ResolvedScenario,
    /// Number of replications: the number in the plan, or one if there is no remnant.
    pub replications: u64,
}

/// Additional keys of a scenario in a plan.
#[derive(Debug, Deserialize)]
struct AdditionalKeys {
    name: Option<String>,
    condition: Option<String>,
}

/// Largest number of replications of a cell.
const MAX_REPLICATIONS: u64 = 100_000_000;

/// Largest number of estimates of a study.
const MAX_ESTIMATES: u128 = 10_000_000_000;

/// Largest number of blocks of a study; each block is stored as a few files.
const MAX_BLOCKS: u128 = 1_000_000;

impl Plan {
    /// Reads and checks a plan.
    ///
    /// # Errors
    /// [`StudyError::Plan`] with the file, the line and the remedy; [`StudyError::Io`] if the file cannot be read.
    pub fn read(path: &Path) -> Result<Self, StudyError> {
        let text = hoid_io::read_settings(path)?;
        Self::parse(&text, &path.display().to_string())
    }

    /// Parses the text of a plan; `path` is used in messages.
    ///
    /// # Errors
    /// [`StudyError::Plan`] if the plan is invalid.
    pub fn parse(text: &str, path: &str) -> Result<Self, StudyError> {
        Self::from_text(text).map_err(|problem| StudyError::Plan {
            path: path.to_owned(),
            line: problem.line,
            reason: hoid_io::escape_control_characters(&problem.reason),
        })
    }

    fn from_text(text: &str) -> Result<Self, PlanProblem> {
        let document = DeTable::parse(text).map_err(|error| PlanProblem {
            line: Some(error.span().map_or(1, |span| line_at(text, span.start))),
            reason: error.message().trim_end().to_owned(),
        })?;
        let mut scenarios = Vec::new();
        let mut estimators = Vec::new();
        for (key, tables) in [("scenarios", &mut scenarios), ("estimators", &mut estimators)] {
            *tables = tables_of(&document, key, text)?;
        }
        let mut rest = document.clone();
        for key in ["scenarios", "estimators"] {
            rest.get_mut().remove(key);
        }
        let keys: Vec<String> = rest.get_ref().keys().map(|key| key.get_ref().to_string()).collect();
        let keys: Vec<&str> = keys.iter().map(String::as_str).filter(|key| *key != "keep").collect();
        let head = single_variant(&rest, text, &keys)?;
        let at_head = |key: &str| head.line_of_key(key);
        let head_text: Head = head.read()?;
        check_head(&head_text, &at_head)?;
        let mut plan = Self {
            name: head_text.name,
            title: head_text.title,
            description: head_text.description,
            seed: head_text.seed,
            replications: head_text.replications,
            block: head_text.block,
            trace_every: head_text.keep.trace_every,
            trace_points: head_text.keep.trace_points,
            standard_errors: head_text.keep.standard_errors,
            changes: head_text.keep.changes,
            cells: Vec::new(),
            estimators: Vec::new(),
            text: text.to_owned(),
        };
        for table in &scenarios {
            for variant in variants(table, text, &hoid_io::LIST_VALUED_KEYS)? {
                let index = plan.cells.len() as u64;
                plan.cells.push(cell(&variant, index, plan.replications)?);
            }
        }
        let known: BTreeSet<&str> = plan.cells.iter().map(|cell| cell.scenario.as_str()).collect();
        let mut names = BTreeSet::new();
        let whole = estimator_table::non_axis_keys();
        let whole: Vec<&str> = whole.iter().map(String::as_str).collect();
        for table in &estimators {
            let first_line = line_at(text, table.span().start);
            for (i, variant) in variants(table, text, &whole)?.into_iter().enumerate() {
                let estimator = EstimatorCell::of(&variant)?;
                let problem = |key: &str, reason: String| PlanProblem {
                    line: variant.line_of_key(key).or(Some(first_line)),
                    reason,
                };
                if i == 0 && !names.insert(estimator.name.clone()) {
                    return Err(problem(
                        "name",
                        format!("two estimators are called {}: rename one", estimator.name),
                    ));
                }
                if let Some(name) = estimator
                    .scenarios
                    .iter()
                    .flatten()
                    .find(|name| !known.contains(name.as_str()))
                {
                    let known: Vec<&str> = known.iter().copied().collect();
                    return Err(problem(
                        "scenarios",
                        format!("no scenario is called {name}, expected one of {}", known.join(", ")),
                    ));
                }
                if let Some(name) = estimator
                    .versus
                    .as_ref()
                    .filter(|name| !plan.estimators.iter().any(|e| e.name == **name))
                {
                    return Err(problem(
                        "versus",
                        format!("versus is {name}, expected the name of an estimator above this one"),
                    ));
                }
                for cell in plan.cells.iter().filter(|cell| estimator.applies_to(&cell.scenario)) {
                    estimator
                        .check(&cell.resolved)
                        .map_err(|(key, reason)| problem(key, format!("{}: {reason}", estimator.label)))?;
                }
                plan.estimators.push(estimator);
            }
        }
        for cell in &plan.cells {
            if !plan
                .estimators
                .iter()
                .any(|estimator| estimator.applies_to(&cell.scenario))
            {
                return Err(PlanProblem {
                    line: None,
                    reason: format!(
                        "no estimator uses the scenario {}: remove the scenario or add an estimator",
                        cell.scenario
                    ),
                });
            }
        }
        plan.check_size().map_err(|reason| PlanProblem { line: None, reason })?;
        Ok(plan)
    }

    /// Sets the number of replications.
    ///
    /// # Errors
    /// [`StudyError::Plan`] if the number is zero.
    pub fn with_replications(mut self, replications: u64) -> Result<Self, StudyError> {
        if !(1..=MAX_REPLICATIONS).contains(&replications) {
            return Err(StudyError::Plan {
                path: self.name,
                line: None,
                reason: format!("replications is {replications}, expected 1 to {MAX_REPLICATIONS}"),
            });
        }
        for cell in &mut self.cells {
            cell.replications = if cell.replications == 1 && is_noise_free(&cell.resolved) {
                1
            } else {
                replications
            };
        }
        self.replications = replications;
        self.check_size().map_err(|reason| StudyError::Plan {
            path: self.name.clone(),
            line: None,
            reason,
        })?;
        Ok(self)
    }

    /// Checks that the study does not have too many estimates or blocks.
    fn check_size(&self) -> Result<(), String> {
        let estimates = |cell: &Cell| u128::from(cell.replications) * self.estimators_of(cell).count() as u128;
        let estimates: u128 = self.cells.iter().map(estimates).sum();
        if estimates > MAX_ESTIMATES {
            return Err(format!(
                "the plan has {estimates} estimates, expected at most {MAX_ESTIMATES}: reduce replications or split the plan"
            ));
        }
        let blocks = |cell: &Cell| u128::from(cell.replications.div_ceil(self.block.max(1)));
        let blocks: u128 = self.cells.iter().map(blocks).sum();
        if blocks > MAX_BLOCKS {
            return Err(format!(
                "the plan has {blocks} blocks, expected at most {MAX_BLOCKS}: increase `block` or split the plan"
            ));
        }
        Ok(())
    }

    /// Returns the text of the plan as it was read.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the SHA-256 of everything that determines the results: the text of the plan and the number of
    /// replications.
    pub fn hash(&self) -> String {
        let mut hasher = Sha256::new();
        hasher.update(self.text.as_bytes());
        hasher.update(format!("\0replications {}", self.replications).as_bytes());
        hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Returns the estimators that are applied to the records of a cell, with their indices.
    pub fn estimators_of<'a>(&'a self, cell: &'a Cell) -> impl Iterator<Item = (usize, &'a EstimatorCell)> {
        self.estimators
            .iter()
            .enumerate()
            .filter(|(_, estimator)| estimator.applies_to(&cell.scenario))
    }

    /// Returns the number of estimates of the whole study: one per replication and estimator.
    pub fn estimate_count(&self) -> u64 {
        let of = |cell: &Cell| cell.replications * self.estimators_of(cell).count() as u64;
        self.cells.iter().map(of).sum()
    }
}

fn check_head(head: &Head, at: &impl Fn(&str) -> Option<usize>) -> Result<(), PlanProblem> {
    let bad = |key: &str, reason: String| {
        Err(PlanProblem {
            line: at(key),
            reason: format!("{key} is {reason}"),
        })
    };
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if head.name.is_empty() || !head.name.chars().all(is_plain) {
        return bad(
            "name",
            format!(
                "{:?}, expected letters, digits, - and _: the name is part of file names",
                head.name
            ),
        );
    }
    for (key, n) in [("replications", head.replications), ("block", head.block)] {
        if !(1..=MAX_REPLICATIONS).contains(&n) {
            return bad(key, format!("{n}, expected 1 to {MAX_REPLICATIONS}"));
        }
    }
    if head.keep.trace_every == Some(0) {
        return bad(
            "keep.trace_every",
            "0, expected 1 or more; leave it out to keep no traces".to_owned(),
        );
    }
    Ok(())
}

/// Returns the tables `[[key]]` of a plan.
fn tables_of<'a>(
    document: &Spanned<DeTable<'a>>,
    key: &str,
    text: &str,
) -> Result<Vec<Spanned<DeTable<'a>>>, PlanProblem> {
    let missing = |line| PlanProblem {
        line,
        reason: format!("expected at least one table [[{key}]]"),
    };
    let found = document.get_ref().iter().find(|(k, _)| k.get_ref().as_ref() == key);
    let (at, value) = found.ok_or_else(|| missing(None))?;
    let line = Some(line_at(text, at.span().start));
    let DeValue::Array(array) = value.get_ref() else {
        return Err(missing(line));
    };
    if array.is_empty() {
        return Err(missing(line));
    }
    array
        .iter()
        .map(|entry| match entry.get_ref() {
            DeValue::Table(table) => Ok(Spanned::new(entry.span(), table.clone())),
            _ => Err(missing(Some(line_at(text, entry.span().start)))),
        })
        .collect()
}

/// Reads a table in which lists are not allowed.
fn single_variant(table: &Spanned<DeTable<'_>>, text: &str, whole: &[&str]) -> Result<Variant, PlanProblem> {
    let mut all = variants(table, text, whole)?;
    match (all.pop(), all.is_empty()) {
        (Some(one), true) => Ok(one),
        _ => Err(PlanProblem {
            line: Some(1),
            reason: "[keep] has a list, expected single values".to_owned(),
        }),
    }
}

fn cell(variant: &Variant, index: u64, replications: u64) -> Result<Cell, PlanProblem> {
    let own: AdditionalKeys = variant.read()?;
    let default = own.condition.clone().unwrap_or_else(|| "scenario".to_owned());
    let name = own.name.unwrap_or_else(|| default.clone());
    let scenario: Scenario =
        hoid_io::parse_scenario(&variant.text, "", &name).map_err(|error| scenario_problem(error, variant))?;
    let resolved = scenario.resolve().map_err(|error| model_problem(&error, variant))?;
    Ok(Cell {
        index,
        scenario: name,
        condition: own.condition.unwrap_or_default(),
        axes: variant.axes.clone(),
        replications: if is_noise_free(&resolved) { 1 } else { replications },
        resolved,
    })
}

fn is_noise_free(resolved: &ResolvedScenario) -> bool {
    match resolved.scenario().remnant.strength {
        RemnantStrength::Level { level, .. } => level == 0.0,
        RemnantStrength::Gain { initial, last } => initial == 0.0 && last == 0.0,
    }
}

/// Converts an error of a scenario to a problem at a line of the plan.
fn scenario_problem(error: ScenarioFileError, variant: &Variant) -> PlanProblem {
    match error {
        ScenarioFileError::Syntax { line, reason, .. } => PlanProblem {
            line: Some(variant.line(line)),
            reason,
        },
        ScenarioFileError::Value {
            line,
            key,
            found,
            expected,
            ..
        } => PlanProblem {
            line: Some(variant.line(line)),
            reason: format!("{key} is {found}, expected {expected}"),
        },
        ScenarioFileError::Keys { reason, .. } => PlanProblem {
            line: Some(variant.line(1)),
            reason,
        },
        ScenarioFileError::Model { source, .. } => model_problem(&source, variant),
        other => PlanProblem {
            line: Some(variant.line(1)),
            reason: other.to_string(),
        },
    }
}

fn model_problem(error: &ModelError, variant: &Variant) -> PlanProblem {
    let line = match error {
        ModelError::UnreachableNoiseLevel { .. } => variant.line_of_key("remnant.noise_level"),
        ModelError::OutOfRange { quantity, .. } if quantity.starts_with("noise level") => {
            variant.line_of_key("remnant.noise_level")
        }
        _ => None,
    };
    PlanProblem {
        line: line.or_else(|| variant.lines.first().copied()),
        reason: error.to_string(),
    }
}
