//! Two standard deviations that an experiment cannot reduce: of a difference between two conditions over people, which
//! determines how many people are needed, and of one person from run to run, which determines how many runs.
//!
//! | source | standard deviation b of the difference between two conditions |
//! |---|---|
//! | a number | that fraction of the quantity |
//! | a comparison (`hoid compare --json`) | tau of its difference within people, which excludes the errors of the estimates; if there are several differences, the root mean square of their tau |
//! | the result of a group with several conditions | tau as for a comparison, after the conditions have been compared |
//! | the population of one condition (`hoid group --pool`) | sigma between its people, as an upper bound |
//!
//! If rho is the correlation of two conditions over people, b is `sigma sqrt(2 (1 - rho))`, which is at most sigma if
//! rho is one half or more. A population of one condition does not determine rho.
//!
//! The variation from run to run comes from a number, or from the crossover frequencies of the runs in the result of a
//! group ([`GroupEstimates::run_to_run_variation`]), as an upper bound. It is applied to all quantities, because the
//! prior of a fit reduces the scatter of the other parameters.

use std::{
    convert::Infallible,
    fmt,
    path::{Path, PathBuf},
    str::FromStr,
};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{DesignError, People};
use crate::compare::{Comparison, ComparisonOptions, GroupEstimates, Quantity, Variation};

/// Source of a standard deviation over people or over the runs of a person.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum SpreadSource {
    /// A fraction of the quantity.
    Part(f64),
    /// The result of a group; for the spread of a difference over people, also a file with a comparison or a
    /// population.
    File(PathBuf),
}

impl SpreadSource {
    /// Parses a number or the path of a file.
    pub fn from_text(text: &str) -> Self {
        match text.parse() {
            Ok(part) => Self::Part(part),
            Err(_) => Self::File(text.into()),
        }
    }
}

impl FromStr for SpreadSource {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(Self::from_text(text))
    }
}

impl fmt::Display for SpreadSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Part(part) => part.fmt(f),
            Self::File(path) => path.display().fmt(f),
        }
    }
}

/// A standard deviation with a description of its source.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Spread {
    pub value: f64,
    pub source: String,
}

/// Returns a given fraction of `unit`, or the value that `read` finds in the given file. If nothing is given, `read` is
/// tried on the people of the design; if this gives no value, the result is the default fraction.
fn resolve_spread(
    given: Option<&SpreadSource>,
    people: &People,
    (default, unit): (f64, f64),
    read: impl Fn(&Path) -> Result<Spread, DesignError>,
) -> Result<Spread, DesignError> {
    let part = |part: f64, source: &str| Spread {
        value: part * unit,
        source: source.to_owned(),
    };
    match given {
        Some(SpreadSource::Part(given)) => Ok(part(*given, "as given")),
        Some(SpreadSource::File(path)) => read(path),
        None => {
            let known = people.path().and_then(|path| read(path).ok());
            Ok(known.unwrap_or_else(|| part(default, "a default")))
        }
    }
}

/// Returns the standard deviation, over people, of a difference in the quantity with this name and value.
///
/// # Errors
/// [`DesignError::NoSpread`] if a given file does not provide it.
pub(super) fn between_people_spread(
    given: Option<&SpreadSource>,
    people: &People,
    (name, value): (&str, f64),
    default: f64,
) -> Result<Spread, DesignError> {
    resolve_spread(given, people, (default, value), |path| read_spread(path, (name, value)))
}

/// Returns the relative standard deviation of one person from run to run.
///
/// # Errors
/// [`DesignError::NoRunToRun`] if a given directory does not provide it.
pub(super) fn run_to_run_spread(
    given: Option<&SpreadSource>,
    people: &People,
    default: f64,
) -> Result<Spread, DesignError> {
    resolve_spread(given, people, (default, 1.0), |path| {
        let none = |reason: String| DesignError::NoRunToRun {
            path: path.display().to_string(),
            reason,
        };
        let group = GroupEstimates::read(path).map_err(|error| none(error.to_string()))?;
        let (value, people) = group
            .run_to_run_variation()
            .ok_or_else(|| none("no person has a crossover from three runs in one condition".to_owned()))?;
        Ok(Spread {
            value,
            source: format!("of {people} people in {}", path.display()),
        })
    })
}

fn read_spread(path: &Path, (name, value): (&str, f64)) -> Result<Spread, DesignError> {
    let none = |reason: String| DesignError::NoSpread {
        path: path.display().to_string(),
        name: name.to_owned(),
        reason,
    };
    let quantity: Quantity = name
        .parse()
        .map_err(|error: crate::compare::CompareError| none(error.to_string()))?;
    let shown = path.display();
    if !path.is_dir() {
        let text = hoid_io::read_settings(path)?;
        let object: Value = serde_json::from_str(&text).map_err(|error| none(format!("it is not JSON: {error}")))?;
        if object["kind"] == "population" {
            let spread = population_spread(&object, name).ok_or_else(|| none("it lacks this parameter".to_owned()))?;
            return Ok(Spread {
                value: spread * value,
                source: format!("at most the spread between people within one condition, from {shown}"),
            });
        }
        if object["kind"] == "comparison" {
            let found = Comparison::from_json(&text).map_err(|error| none(error.to_string()))?;
            return comparison_spread(&found, &quantity, &shown.to_string()).map_err(none);
        }
    }
    let group = GroupEstimates::read(path).map_err(|error| none(error.to_string()))?;
    let comparing = ComparisonOptions {
        quantities: vec![quantity.clone()],
        ..ComparisonOptions::default()
    };
    let found = comparing.run(&group).map_err(|error| none(error.to_string()))?;
    comparison_spread(&found, &quantity, &shown.to_string()).map_err(none)
}

/// Returns the standard deviation between people of the logarithm of a parameter.
fn population_spread(object: &Value, name: &str) -> Option<f64> {
    let parameters = object["parameters"].as_array()?;
    parameters.iter().find(|p| p["name"] == name)?["spread"].as_f64()
}

fn comparison_spread(found: &Comparison, quantity: &Quantity, shown: &str) -> Result<Spread, String> {
    let within = (found.differences.iter())
        .filter(|d| d.quantity == *quantity && d.variation == Variation::Within && d.effect.is_none());
    let all: Vec<(f64, usize)> = within.map(|d| (d.tau, d.people.len())).collect();
    let Some(people) = all.iter().map(|(_, people)| *people).max() else {
        let known: Vec<String> = found.quantities().iter().map(ToString::to_string).collect();
        return Err(format!(
            "it contains differences within people only for {}",
            known.join(", ")
        ));
    };
    let square = all.iter().map(|(tau, _)| tau * tau).sum::<f64>() / all.len() as f64;
    Ok(Spread {
        value: square.sqrt(),
        source: format!("of the differences of {people} people in {shown}"),
    })
}
