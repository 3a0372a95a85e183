//! The options of `pyhoid.track` and `pyhoid.Tracker`: from plain form to that of the library.

use std::collections::BTreeMap;

use hoid_ident::order_selection::default_operator_ranges;
use hoid_model::SampleTime;
use hoid_track::{
    ForgettingRule, Memory, Method, Regressor, StartAt, StartCovariance, TrackOptions, TrackPlan, narrowed,
};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    errors::{Failure, Outcome, bad_option},
    names,
};

/// Rate of the gradient when none is given, as on the command line.
const USUAL_RATE: f64 = 0.1;

/// A keyword, None for one that was not given.
fn get<'py, T>(options: &Bound<'py, PyDict>, name: &str) -> Outcome<Option<T>>
where
    T: for<'a> FromPyObject<'a, 'py>,
{
    match options.get_item(name)? {
        None => Ok(None),
        Some(value) if value.is_none() => Ok(None),
        Some(value) => match value.extract::<T>() {
            Ok(value) => Ok(Some(value)),
            Err(error) => {
                let error: PyErr = error.into();
                Err(bad_option(format!("{name}: {error}")))
            }
        },
    }
}

/// A recursion from its keywords.
pub fn plan(options: &Bound<'_, PyDict>, sample_time: SampleTime) -> Outcome<TrackPlan> {
    let text = |name: &str| get::<String>(options, name);
    let method = match text("method")? {
        Some(name) => names::tracking_method(&name)?,
        None => Method::Physical,
    };
    let structure = match text("structure")? {
        Some(name) => names::structure(&name)?,
        None => method.usual_structure(),
    };
    let orders: BTreeMap<String, (usize, usize)> = get(options, "orders")?.unwrap_or_default();
    let start: Option<BTreeMap<String, f64>> = get(options, "start")?;
    let from_nothing = get(options, "from_nothing")?.unwrap_or(false);
    let track_delay: Option<(f64, f64)> = get(options, "track_delay")?;
    let mut usual = default_operator_ranges(structure, sample_time);
    if method == Method::Adaptive {
        let nd = method.usual_orders(1).nd;
        usual.nd = nd..=nd;
    }
    let usual = names::with_orders(usual, &orders)?;
    let delay = track_delay.filter(|_| !orders.contains_key("nk"));
    let named: Vec<String> = match &start {
        Some(start) if orders.keys().all(|name| name == "nk") => start.keys().cloned().collect(),
        _ => Vec::new(),
    };
    let ranges = narrowed(usual, delay, &named, sample_time);
    let combinations = ranges.combinations()?;
    let largest = combinations[combinations.len() - 1];
    let start = match start {
        Some(start) => StartAt::Theta(names::theta(&largest.parameter_names(), &start)?),
        None if from_nothing => StartAt::Nothing,
        None => StartAt::Span(None),
    };
    let memory = match (memory(options, "memory")?, get::<f64>(options, "forgetting_factor")?) {
        (Some(_), Some(_)) => return Err(bad_option("give memory or forgetting_factor, not both")),
        (memory, None) => memory,
        (None, Some(1.0)) => Some(Memory::Infinite),
        (None, Some(lambda)) if lambda > 0.0 && lambda < 1.0 => Some(Memory::Samples(1.0 / (1.0 - lambda))),
        (None, Some(lambda)) => {
            return Err(bad_option(format!(
                "forgetting_factor is {lambda}, expected above 0 and up to 1, such as 0.996"
            )));
        }
    };
    let mut memory_of = BTreeMap::new();
    for (name, text) in get::<BTreeMap<String, String>>(options, "memory_of")?.unwrap_or_default() {
        memory_of.insert(name, text.parse::<Memory>()?);
    }
    let defaults = TrackOptions::new(method, structure, largest);
    let kept = match text("stable")? {
        Some(name) => names::kept_stable(&name)?,
        None => defaults.stable,
    };
    let covariance: Option<f64> = get(options, "covariance")?;
    let pseudo_linear: bool = get(options, "pseudo_linear")?.unwrap_or(false);
    let track_options = TrackOptions {
        forgetting: forgetting(options)?,
        memory,
        memory_of,
        start,
        covariance: covariance.map_or(StartCovariance::OfFit, StartCovariance::Multiple),
        regressor: if pseudo_linear {
            Regressor::PseudoLinear
        } else {
            Regressor::Gradient
        },
        stable: kept,
        bounds: names::constraints(BTreeMap::new(), get(options, "bound")?.unwrap_or_default())?,
        track_delay_s: track_delay,
        limit: get(options, "limit")?,
        largest: get(options, "largest")?.unwrap_or(defaults.largest),
        window: self::memory(options, "window")?.unwrap_or(defaults.window),
        smooth: get(options, "smooth")?.unwrap_or(false),
        alarm: get(options, "alarm")?.unwrap_or(defaults.alarm),
        every: get(options, "refit")?.unwrap_or(defaults.every),
        ..defaults
    };
    let criterion = names::criterion(&text("criterion")?.unwrap_or_else(|| "bic".to_owned()))?;
    TrackPlan::new(track_options, ranges, criterion, sample_time).map_err(Failure::from)
}

/// A memory as text: samples, seconds or inf.
fn memory(options: &Bound<'_, PyDict>, name: &str) -> Outcome<Option<Memory>> {
    match get::<String>(options, name)? {
        None => Ok(None),
        Some(text) => Ok(Some(text.parse::<Memory>()?)),
    }
}

fn forgetting(options: &Bound<'_, PyDict>) -> Outcome<ForgettingRule> {
    let name = get::<String>(options, "forgetting")?.unwrap_or_else(|| "exponential".to_owned());
    let drift: Option<BTreeMap<String, f64>> = get(options, "drift")?;
    let rate: Option<f64> = get(options, "rate")?;
    let words = [
        ("exponential", 0),
        ("random-walk", 1),
        ("window", 2),
        ("variable", 3),
        ("directional", 4),
        ("gradient", 5),
    ];
    Ok(match names::word("forgetting", &name, &words)? {
        0 => ForgettingRule::Exponential,
        1 => ForgettingRule::RandomWalk(drift.ok_or_else(|| {
            bad_option(
                "forgetting=\"random-walk\" needs drift, such as {\"K_e\": 0.01}: \
                 the standard deviation of the drift in one second",
            )
        })?),
        2 => ForgettingRule::Window,
        3 => ForgettingRule::Variable,
        4 => ForgettingRule::Directional,
        _ => ForgettingRule::Gradient(rate.unwrap_or(USUAL_RATE)),
    })
}
