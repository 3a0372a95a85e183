//! The people of a group: from the directory that `hoid group --out` wrote, from its JSON, or from `population.json`,
//! which `hoid group --pool` writes.
//!
//! The typical person has the most frequent form, and the median of each parameter over the people with this form. If a
//! parameter was pooled, the typical person has the median of the population, and each person has their pooled
//! estimate. Parameters that the data of too few people determine are not pooled.

use std::path::Path;

use hoid_model::{ContinuousTransferFunction, FamilyOperator, FamilyState, Form, VerdictLevel};
use hoid_numerics::statistics::upper_median;
use hoid_study::group::{GroupSummary, MANIFEST_FILE, Manifest};
use serde_json::Value;

use super::{
    DesignError,
    design_people::{ChosenPeople, GivenOptions, NamedState, exclusion_finding},
};

/// A person in a condition, with parameters by name.
#[derive(Debug, Clone, PartialEq)]
struct Row {
    subject: String,
    condition: String,
    form: String,
    parameters: Vec<(String, f64)>,
}

/// The pooled population of a condition.
struct PooledPopulation {
    centre: Row,
    people: Vec<Row>,
}

pub(super) fn from_directory(directory: &Path, given: &GivenOptions<'_>) -> Result<ChosenPeople, DesignError> {
    let manifest = directory.join(MANIFEST_FILE);
    if !manifest.exists() {
        return Err(no_people_error(directory, format!("there is no {MANIFEST_FILE} in it")));
    }
    let manifest = Manifest::read(&manifest)?;
    let summary = GroupSummary::read(&manifest, directory)?;
    let determined = |p: &&hoid_study::group::Person| {
        p.covers_all_runs() && p.verdict.is_some_and(|level| level != VerdictLevel::NotDetermined)
    };
    let row = |p: &hoid_study::group::Person| Row {
        subject: p.subject.clone(),
        condition: p.condition.clone(),
        form: p.form.clone(),
        parameters: p.parameters.iter().map(|q| (q.name.clone(), q.value)).collect(),
    };
    let rows: Vec<Row> = summary.people.iter().filter(determined).map(row).collect();
    let condition = condition_of(&rows, directory, given)?;
    let element = match given.controlled_element {
        Some(element) => element.clone(),
        None => element_of(&manifest, &condition, directory)?,
    };
    let pooled = read_pooled(directory, &condition)?;
    let rows = rows.into_iter().filter(|row| row.condition == condition).collect();
    from_rows(rows, pooled.as_ref(), directory, &element)
}

pub(super) fn from_json(object: &Value, path: &Path, given: &GivenOptions<'_>) -> Result<ChosenPeople, DesignError> {
    let people = object["people"].as_array().map(Vec::as_slice).unwrap_or_default();
    let of_all = |p: &&Value| p["run"] == "all" && p["verdict"]["level"] != VerdictLevel::NotDetermined.name();
    let text = |p: &Value, key: &str| p[key].as_str().unwrap_or_default().to_owned();
    let row = |p: &Value| Row {
        subject: text(p, "subject"),
        condition: text(p, "condition"),
        form: text(p, "form"),
        parameters: match p["parameters"].as_object() {
            // JSON cannot represent infinity, so an infinite value is read as NaN.
            Some(all) => all
                .iter()
                .map(|(name, q)| (name.clone(), q["value"].as_f64().unwrap_or(f64::NAN)))
                .collect(),
            None => Vec::new(),
        },
    };
    let rows: Vec<Row> = people.iter().filter(of_all).map(row).collect();
    let condition = condition_of(&rows, path, given)?;
    let element = given.element(&path.display().to_string())?;
    let rows = rows.into_iter().filter(|row| row.condition == condition).collect();
    from_rows(rows, None, path, &element)
}

pub(super) fn from_population(
    object: &Value,
    path: &Path,
    given: &GivenOptions<'_>,
) -> Result<ChosenPeople, DesignError> {
    let element = given.element(&path.display().to_string())?;
    let missing: Vec<&str> = object["left_out"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(|entry| entry[0].as_str())
        .collect();
    if !missing.is_empty() {
        let names = missing.join(", ");
        let reason = format!(
            "{names} could not be pooled; give the directory of the group, which contains the operator of each person"
        );
        return Err(no_people_error(path, reason));
    }
    from_pooled(&read_pooled_population(object), path, &element)
}

fn no_people_error(place: &Path, reason: impl Into<String>) -> DesignError {
    DesignError::NoPeople {
        people_source: place.display().to_string(),
        reason: reason.into(),
    }
}

/// Returns the condition: the given one, or the only one of the group.
fn condition_of(rows: &[Row], place: &Path, given: &GivenOptions<'_>) -> Result<String, DesignError> {
    let mut all: Vec<&str> = Vec::new();
    for row in rows {
        if !all.contains(&row.condition.as_str()) {
            all.push(&row.condition);
        }
    }
    match (given.condition, all.as_slice()) {
        (_, []) => Err(no_people_error(
            place,
            "the data do not determine the operator of any person",
        )),
        (Some(wanted), _) if all.contains(&wanted) => Ok(wanted.to_owned()),
        (None, [one]) => Ok((*one).to_owned()),
        (wanted, _) => Err(DesignError::Condition {
            found: wanted.unwrap_or("none").to_owned(),
            expected: all.join(", "),
        }),
    }
}

fn element_of(
    manifest: &Manifest,
    condition: &str,
    directory: &Path,
) -> Result<ContinuousTransferFunction, DesignError> {
    let known = manifest.conditions.get(condition);
    let text = known.and_then(|settings| settings.controlled_element.as_deref());
    let missing = || DesignError::NoElement {
        people: format!("the condition {condition:?} in {}", directory.display()),
    };
    Ok(text.ok_or_else(missing)?.parse()?)
}

/// Reads the pooled population of a condition from the files of a directory; `None` if there is none.
fn read_pooled(directory: &Path, condition: &str) -> Result<Option<PooledPopulation>, DesignError> {
    let unreadable = |error: std::io::Error| no_people_error(directory, error.to_string());
    let mut names: Vec<_> = std::fs::read_dir(directory)
        .map_err(unreadable)?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.starts_with("population") && hoid_io::is_fit_file(&name)
        })
        .collect();
    names.sort();
    for path in names {
        let object: Value = serde_json::from_str(&hoid_io::read_settings(&path)?).unwrap_or_default();
        if object["kind"] == "population" && object["condition"] == condition {
            return Ok(Some(read_pooled_population(&object)));
        }
    }
    Ok(None)
}

fn read_pooled_population(object: &Value) -> PooledPopulation {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let row = |subject: String| Row {
        subject,
        condition: text(&object["condition"]),
        form: text(&object["form"]),
        parameters: Vec::new(),
    };
    let mut all = PooledPopulation {
        centre: row("typical".to_owned()),
        people: Vec::new(),
    };
    for parameter in object["parameters"].as_array().into_iter().flatten() {
        let name = text(&parameter["name"]);
        all.centre
            .parameters
            .extend(parameter["value"].as_f64().map(|v| (name.clone(), v)));
        for person in parameter["people"].as_array().into_iter().flatten() {
            let subject = text(&person["subject"]);
            let place = all.people.iter().position(|row| row.subject == subject);
            let place = place.unwrap_or_else(|| {
                all.people.push(row(subject));
                all.people.len() - 1
            });
            let value = person["value"].as_f64().map(|v| (name.clone(), v));
            all.people[place].parameters.extend(value);
        }
    }
    all
}

fn from_pooled(
    pooled: &PooledPopulation,
    place: &Path,
    element: &ContinuousTransferFunction,
) -> Result<ChosenPeople, DesignError> {
    let state = state_of(&pooled.centre, element).map_err(|reason| no_people_error(place, reason))?;
    let name = format!("typical of {} people", pooled.people.len());
    Ok(with_others(NamedState { name, state }, &pooled.people, element))
}

impl Row {
    /// Replaces each parameter that the row `pooled` contains by its pooled value.
    fn with_pooled_values(mut self, pooled: &Self) -> Self {
        for (name, value) in &mut self.parameters {
            if let Some((_, better)) = pooled.parameters.iter().find(|(n, _)| n == name) {
                *value = *better;
            }
        }
        self
    }
}

fn from_rows(
    rows: Vec<Row>,
    pooled: Option<&PooledPopulation>,
    place: &Path,
    element: &ContinuousTransferFunction,
) -> Result<ChosenPeople, DesignError> {
    let with_pooled = |row: Row| match pooled.and_then(|p| p.people.iter().find(|q| q.subject == row.subject)) {
        Some(own) => row.with_pooled_values(own),
        None => row,
    };
    let rows: Vec<Row> = rows.into_iter().map(with_pooled).collect();
    let count = |form: &str| rows.iter().filter(|row| row.form == form).count();
    // If two forms have equally many people, the form of the first person is chosen.
    let first = rows.iter().rev().max_by_key(|row| count(&row.form));
    let form = first.map(|row| row.form.clone()).unwrap_or_default();
    let alike: Vec<&Row> = rows.iter().filter(|row| row.form == form).collect();
    let centre = |name: &String| {
        let of = |row: &&Row| row.parameters.iter().find(|(n, _)| n == name).map(|(_, v)| *v);
        let mut values: Vec<f64> = alike.iter().filter_map(of).collect();
        // NaN represents an infinite T_I, which JSON cannot contain.
        values
            .iter_mut()
            .filter(|v| v.is_nan())
            .for_each(|v| *v = f64::INFINITY);
        (name.clone(), upper_median(&mut values).unwrap_or(f64::NAN))
    };
    let names = alike.first().map(|row| row.parameters.iter().map(|(name, _)| name));
    let typical = Row {
        subject: "typical".to_owned(),
        condition: String::new(),
        parameters: names.into_iter().flatten().map(centre).collect(),
        form,
    };
    let typical = match pooled {
        Some(pooled) => typical.with_pooled_values(&pooled.centre),
        None => typical,
    };
    let state = state_of(&typical, element).map_err(|reason| no_people_error(place, reason))?;
    let name = match alike.len() == rows.len() {
        true => format!("typical of {} people", rows.len()),
        false => format!("typical of {} of {} people", alike.len(), rows.len()),
    };
    Ok(with_others(NamedState { name, state }, &rows, element))
}

fn with_others(typical: NamedState, rows: &[Row], element: &ContinuousTransferFunction) -> ChosenPeople {
    let (mut others, mut findings) = (Vec::new(), Vec::new());
    for row in rows {
        match state_of(row, element) {
            Ok(state) => others.push(NamedState {
                name: row.subject.clone(),
                state,
            }),
            Err(reason) => findings.push(exclusion_finding(&row.subject, &reason)),
        }
    }
    ChosenPeople {
        typical,
        others,
        feedforward: None,
        findings,
    }
}

/// Returns the operator and element of a person, or the reason why they cannot be used.
fn state_of(row: &Row, element: &ContinuousTransferFunction) -> Result<FamilyState, String> {
    let form: Form = row.form.parse().map_err(|_| match row.form.is_empty() {
        true => {
            "the people have no common form: write form = \"lead\" or another under [analysis] in group.toml".to_owned()
        }
        false => format!("its form is {:?}, which is not known", row.form),
    })?;
    let value = |name: &str| row.parameters.iter().find(|(n, _)| n == name).map(|(_, v)| *v);
    let neuromuscular = value("omega_nm").is_some();
    let dependent = |name: &&str| *name == "K_e_dot" || (*name == "K" && form.has_lag());
    let pair = |name: &str| match value(name) {
        Some(v) if v.is_finite() => Ok((name.to_owned(), v)),
        // An infinite lag time constant represents a pure integration.
        Some(_) if name == "T_I" => Ok((name.to_owned(), f64::INFINITY)),
        _ => Err(format!("{name} of the form {form} is not known")),
    };
    let names = form.parameters(neuromuscular);
    let pairs: Result<Vec<(String, f64)>, String> = names.iter().filter(|n| !dependent(n)).map(|n| pair(n)).collect();
    let operator = FamilyOperator::from_names(form, &pairs?).map_err(|error| error.to_string())?;
    Ok(FamilyState {
        operator,
        controlled_element: element.clone(),
    })
}
