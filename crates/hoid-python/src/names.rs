//! Names used in the Python interface and on the command line, and their values in the libraries.

use std::{collections::BTreeMap, ops::RangeInclusive};

use hoid_ident::{NamedOrders, order_selection::Criterion};
use hoid_io::{QualityIssueKind, SparseTreatment};
use hoid_model::{
    Detrend, NamedChoice, Structure, discretise, remnant::RemnantDiscretisation, remnant_gain::NoiseDefinition,
    scenario::Realisation,
};

use crate::errors::{Outcome, bad_option};

/// Returns the value that belongs to a name in a list.
pub fn value_of_name<T: Clone>(option: &str, found: &str, words: &[(&str, T)]) -> Outcome<T> {
    let lower = found.to_ascii_lowercase().replace('_', "-");
    match words.iter().find(|(word, _)| *word == lower) {
        Some((_, value)) => Ok(value.clone()),
        None => {
            let known: Vec<String> = words.iter().map(|(word, _)| format!("{word:?}")).collect();
            Err(bad_option(format!(
                "{option} is {found:?}, expected one of {}",
                known.join(", ")
            )))
        }
    }
}

/// Returns the value of a choice, given by its name.
pub fn choice<T: NamedChoice>(option: &str, found: &str) -> Outcome<T> {
    let words: Vec<_> = T::CHOICES
        .iter()
        .map(|choice| (choice.choice_name(), *choice))
        .collect();
    value_of_name(option, found, &words)
}

/// Returns the kind of fault that can be excluded from a record, given by its name.
pub fn quality_issue_kind(found: &str) -> Outcome<QualityIssueKind> {
    let kinds = [
        QualityIssueKind::Missing,
        QualityIssueKind::Gap,
        QualityIssueKind::Stalled,
        QualityIssueKind::Saturated,
    ];
    value_of_name("mask", found, &kinds.map(|kind| (kind.name(), kind)))
}

pub fn structure(found: &str) -> Outcome<Structure> {
    choice("structure", found)
}

pub fn criterion(found: &str) -> Outcome<Criterion> {
    choice("criterion", found)
}

pub fn detrend(found: &str) -> Outcome<Detrend> {
    choice("detrend", found)
}

/// Parses the treatment of each sparse column.
pub fn sparse_treatments(found: BTreeMap<String, String>) -> Outcome<BTreeMap<String, SparseTreatment>> {
    let of = |(name, how): (String, String)| Ok((name, choice("sparse", &how)?));
    found.into_iter().map(of).collect()
}

pub fn noise_definition(found: &str) -> Outcome<NoiseDefinition> {
    choice("noise_definition", found)
}

pub fn realisation(found: &str) -> Outcome<Realisation> {
    choice("realisation", found)
}

pub fn remnant_discretisation(found: &str) -> Outcome<RemnantDiscretisation> {
    choice("discretisation", found)
}

/// Returns the keyword of an option: its name, or another word if the name is reserved in Python.
pub fn keyword(name: &'static str) -> &'static str {
    match name {
        "lambda" => "forgetting_factor",
        name => name,
    }
}

pub fn discretisation(found: &str, prewarp_rad_s: Option<f64>) -> Outcome<discretise::Method> {
    let words = [
        ("zoh", discretise::Method::ZeroOrderHold),
        ("foh", discretise::Method::FirstOrderHold),
        ("tustin", discretise::Method::Tustin),
        (
            "prewarped",
            discretise::Method::TustinPrewarped {
                omega_rad_s: prewarp_rad_s.unwrap_or(f64::NAN),
            },
        ),
        ("forward-euler", discretise::Method::ForwardEuler),
        ("backward-euler", discretise::Method::BackwardEuler),
        ("matched", discretise::Method::Matched),
    ];
    value_of_name("method", found, &words)
}

/// Returns the range between two ends, both included.
pub fn range(option: &str, ends: (usize, usize)) -> Outcome<RangeInclusive<usize>> {
    if ends.0 > ends.1 {
        return Err(bad_option(format!(
            "{option}: the range {} to {} is empty; give the smaller number first",
            ends.0, ends.1
        )));
    }
    Ok(ends.0..=ends.1)
}

/// Returns orders by name, each as a range.
pub fn named_orders(orders: &BTreeMap<String, (usize, usize)>) -> Outcome<NamedOrders> {
    let one = |(name, ends): (&String, &(usize, usize))| Ok((name.clone(), range(name, *ends)?));
    orders.iter().map(one).collect()
}
