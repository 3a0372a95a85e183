//! The words of Python, those of the command line, and what they stand for in the libraries.

use std::{collections::BTreeMap, ops::RangeInclusive};

use hoid_ident::{
    Constraint, Focus, InitialState, IvMethod, NamedOrders, Prior, SearchMethod, order_selection::Criterion,
};
use hoid_io::QualityIssueKind;
use hoid_model::{
    Detrend, NamedChoice, SampleTime, Structure, discretise, remnant::RemnantDiscretisation,
    remnant_gain::NoiseDefinition, scenario::Realisation, theta_of,
};

use crate::errors::{Outcome, bad_option};

/// The meaning of a word from a list.
pub fn word<T: Clone>(option: &str, found: &str, words: &[(&str, T)]) -> Outcome<T> {
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

/// A choice of the library by its name.
pub fn choice<T: NamedChoice>(option: &str, found: &str) -> Outcome<T> {
    let words: Vec<_> = T::CHOICES
        .iter()
        .map(|choice| (choice.choice_name(), *choice))
        .collect();
    word(option, found, &words)
}

/// What can be left out of a record.
pub fn quality_issue_kind(found: &str) -> Outcome<QualityIssueKind> {
    let kinds = [
        QualityIssueKind::Missing,
        QualityIssueKind::Gap,
        QualityIssueKind::Stalled,
        QualityIssueKind::Saturated,
    ];
    word("mask", found, &kinds.map(|kind| (kind.name(), kind)))
}

/// What `identify` fits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Polynomial(Structure),
    GreyBox,
    TimeVarying,
}

/// The structures by name.
fn structures() -> impl Iterator<Item = (&'static str, Structure)> {
    Structure::ALL
        .into_iter()
        .map(|structure| (structure.name(), structure))
}

pub fn structure(found: &str) -> Outcome<Structure> {
    choice("structure", found)
}

pub fn kind(found: &str) -> Outcome<Kind> {
    let mut all: Vec<(&str, Kind)> = structures().map(|(w, s)| (w, Kind::Polynomial(s))).collect();
    all.extend([("grey-box", Kind::GreyBox), ("time-varying", Kind::TimeVarying)]);
    word("structure", found, &all)
}

/// None is the prediction error method.
pub fn fit_method(found: &str) -> Outcome<Option<IvMethod>> {
    let instruments = IvMethod::ALL.map(|method| (method.name(), Some(method)));
    let words: Vec<_> = [("pem", None)].into_iter().chain(instruments).collect();
    word("method", found, &words)
}

pub fn focus(found: &str) -> Outcome<Focus> {
    choice("focus", found)
}

pub fn search_method(found: &str) -> Outcome<SearchMethod> {
    choice("search_method", found)
}

pub fn criterion(found: &str) -> Outcome<Criterion> {
    choice("criterion", found)
}

pub fn initial_state(found: &str) -> Outcome<Option<InitialState>> {
    let rules = InitialState::ALL.map(|rule| (rule.name(), Some(rule)));
    let words: Vec<_> = [("auto", None)].into_iter().chain(rules).collect();
    word("initial_state", found, &words)
}

pub fn detrend(found: &str) -> Outcome<Detrend> {
    choice("detrend", found)
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

/// The keyword of an option: its name, but for a word that Python keeps for itself.
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
    word("method", found, &words)
}

/// Both ends included.
pub fn range(option: &str, ends: (usize, usize)) -> Outcome<RangeInclusive<usize>> {
    if ends.0 > ends.1 {
        return Err(bad_option(format!(
            "{option}: the range {} to {} is empty; give the smaller number first",
            ends.0, ends.1
        )));
    }
    Ok(ends.0..=ends.1)
}

/// Orders by name, with a delay in s in the place of nk.
pub fn with_delay(
    orders: &BTreeMap<String, (usize, usize)>,
    delay_s: Option<(f64, f64)>,
    sample_time: SampleTime,
) -> Outcome<NamedOrders> {
    let mut all = named_orders(orders)?;
    if let Some((low, high)) = delay_s {
        if all.contains_key("nk") {
            return Err(bad_option(
                "nk and delay are one thing in samples and in s; give one of them",
            ));
        }
        if low < 0.0 {
            return Err(bad_option(format!("delay is {low} to {high} s, expected 0 s or more")));
        }
        all.insert("nk".to_owned(), sample_time.nk(low)..=sample_time.nk(high));
    }
    Ok(all)
}

/// Orders by name, each a range.
pub fn named_orders(orders: &BTreeMap<String, (usize, usize)>) -> Outcome<NamedOrders> {
    let one = |(name, ends): (&String, &(usize, usize))| Ok((name.clone(), range(name, *ends)?));
    orders.iter().map(one).collect()
}

/// Fixed values and bounds, by name.
pub fn constraints(
    fixed: BTreeMap<String, f64>,
    bounds: BTreeMap<String, (f64, f64)>,
) -> Outcome<BTreeMap<String, Constraint>> {
    let mut all: BTreeMap<String, Constraint> = BTreeMap::new();
    for (name, value) in fixed {
        if !value.is_finite() {
            return Err(bad_option(format!("fix: {name} is {value}, expected a finite number")));
        }
        all.insert(name, Constraint::Fixed(value));
    }
    for (name, (low, high)) in bounds {
        if low.is_nan() || high.is_nan() || low > high {
            return Err(bad_option(format!(
                "bound: {name} is {low} to {high}, expected the lower bound first"
            )));
        }
        if all.insert(name.clone(), Constraint::Between(low, high)).is_some() {
            return Err(bad_option(format!("{name} is both fixed and bounded; drop one")));
        }
    }
    Ok(all)
}

/// Guesses with their weights, by name.
pub fn priors(guesses: BTreeMap<String, (f64, f64)>) -> Outcome<BTreeMap<String, Prior>> {
    let one = |(name, (value, weight)): (String, (f64, f64))| {
        if value.is_finite() && weight.is_finite() && weight >= 0.0 {
            Ok((name, Prior { value, weight }))
        } else {
            Err(bad_option(format!(
                "coefficient_prior: {name} is {value} with the weight {weight}, \
                 expected finite numbers and a weight of zero or more"
            )))
        }
    };
    guesses.into_iter().map(one).collect()
}

/// Theta of a model with these names: every coefficient, each once.
pub fn theta(names: &[String], start: &BTreeMap<String, f64>) -> Outcome<Vec<f64>> {
    theta_of(names, start).map_err(|reason| bad_option(format!("start {reason}")))
}
