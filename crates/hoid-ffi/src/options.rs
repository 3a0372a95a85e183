//! Request for a tracker: method, sample time, options in JSON, and an earlier fit.
//!
//! The options are one object with the keywords of `pyhoid.Tracker`: `structure`; `na` to `nk` (a number, or a pair of
//! limits between which the order is searched during the warm-up); `criterion`; `start` (coefficients by name, or
//! "nothing"); `largest`; `at`; `controlled_element` ("90/(s(s+6))", or a pair of coefficient lists); `decimate`
//! ("auto", "off" or a factor; by default, rates above 200 Hz are decimated to about 100 Hz); `warm_up` in s; and the
//! options of the method. These options have the same values as on the command line: a number, a string, true, a pair,
//! or values by name. `prior` may be a fit itself, as printed by `hoid identify --json`, or the name of its file.

use std::{ops::RangeInclusive, path::Path};

use hoid_ident::{NamedOrders, order_selection::Criterion};
use hoid_io::{FitFile, is_fit_file, parse_fit, read_fit};
use hoid_model::{
    ContinuousTransferFunction, Decimation, FittedOperator, MAX_DELAY, MAX_ORDER, ModelError, NamedChoice, SampleTime,
    Structure,
};
use hoid_track::{DEFAULT_WARM_UP_S, Live, Method, RequestedStart, TrackOptions, TrackRequest};
use serde_json::{Map, Value};

use crate::status::Failure;

/// Request for a tracker, in the form in which it is saved.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TrackerRequest {
    /// Name of the method; `None` for the default method.
    pub method: Option<String>,
    pub sample_time_s: f64,
    /// Options in JSON.
    pub options: Option<String>,
    /// Earlier fit of the person, in JSON.
    pub fit: Option<String>,
}

impl TrackerRequest {
    /// Builds the requested recursion in its initial state.
    pub fn live(&self) -> Result<Live, Failure> {
        let sample_time = SampleTime::new(self.sample_time_s)?;
        let mut options = parse_object(self.options.as_deref().unwrap_or("{}"))?;
        let mut method = match &self.method {
            Some(name) => hoid_survey::method(name)?,
            None => Method::default(),
        };
        let structure: Option<Structure> = take_option(&mut options, "structure", choice)?;
        let criterion: Option<Criterion> = take_option(&mut options, "criterion", choice)?;
        let largest = take_option(&mut options, "largest", number)?;
        let at_rad_s = take_option(&mut options, "at", numbers)?;
        let controlled_element = take_option(&mut options, "controlled_element", element)?;
        let start = take_option(&mut options, "start", start)?;
        let decimation = take_option(&mut options, "decimate", decimation)?.unwrap_or_default();
        let warm_up_s = take_option(&mut options, "warm_up", number)?.unwrap_or(DEFAULT_WARM_UP_S);
        let mut orders = NamedOrders::new();
        for name in ["na", "nb", "nc", "nd", "nf", "nk"] {
            if let Some(range) = take_option(&mut options, name, |value| range(value, name))? {
                orders.insert(name.to_owned(), range);
            }
        }
        set_method_options(&mut method, options, self.fit.as_deref())?;
        let asked = TrackRequest {
            structure,
            orders,
            start: start.unwrap_or_default(),
            criterion: criterion.unwrap_or(Criterion::Bic),
            largest: largest.unwrap_or(TrackOptions::DEFAULT_MAX_MAGNITUDE),
            at_rad_s: at_rad_s.unwrap_or_default(),
            controlled_element,
            ..TrackRequest::of(method)
        };
        Ok(Live::new(&asked, sample_time, decimation, warm_up_s)?)
    }
}

/// Sets the options of the method, in an order in which each option follows those on which it depends, and then the
/// fit.
fn set_method_options(method: &mut Method, mut options: Map<String, Value>, fit: Option<&str>) -> Result<(), Failure> {
    let mut fitted = fit.map(|text| operator(text, "the fit")).transpose()?;
    if let Some(prior) = options.get("prior") {
        let other = match prior {
            Value::Object(object) if object.contains_key("parameters") => {
                Some(operator(&prior.to_string(), "the fit")?)
            }
            Value::String(name) if is_fit_file(name) => Some(read_fit(Path::new(name))?.operator()?),
            _ => None,
        };
        if fit.is_some() {
            return Err(Failure::bad_option(
                "prior is given twice, as a fit and in the options; remove one",
            ));
        }
        if other.is_some() {
            options.remove("prior");
            fitted = other;
        }
    }
    let listed = hoid_survey::registry().into_iter().flat_map(|spec| spec.settings);
    for name in listed.map(|setting| setting.name) {
        if let Some(text) = options.remove(name).and_then(|value| text(&value)) {
            hoid_survey::set(method, name, &text)?;
        }
    }
    if let Some((unknown, _)) = options.into_iter().next() {
        let own: Vec<&str> = method.settings().list().iter().map(|own| own.name).collect();
        return Err(Failure::bad_option(format!(
            "there is no option {unknown}; the options are structure, na to nk, criterion, start, largest, at, \
             controlled_element, decimate, warm_up, and for {method} {}",
            own.join(", ")
        )));
    }
    match fitted {
        Some(fit) => Ok(method.start_from(fit)?),
        None => Ok(()),
    }
}

fn operator(text: &str, source: &str) -> Result<FittedOperator, Failure> {
    Ok(parse_fit(text, source).and_then(FitFile::operator)?)
}

fn parse_object(text: &str) -> Result<Map<String, Value>, Failure> {
    let text = if text.trim().is_empty() { "{}" } else { text };
    serde_json::from_str(text).map_err(|error| {
        Failure::bad_option(format!(
            "the options are not a JSON object ({error}); write them as {{\"nk\": 29, \"memory\": \"4s\"}}"
        ))
    })
}

/// Removes an option from the object and returns it; `None` if it is missing or null.
fn take_option<T>(
    options: &mut Map<String, Value>,
    name: &str,
    read: impl FnOnce(&Value) -> Result<T, String>,
) -> Result<Option<T>, Failure> {
    match options.remove(name) {
        None | Some(Value::Null) => Ok(None),
        Some(value) => match read(&value) {
            Ok(read) => Ok(Some(read)),
            Err(expected) => Err(Failure::bad_option(format!("{name} is {value}, expected {expected}"))),
        },
    }
}

fn choice<T: NamedChoice>(value: &Value) -> Result<T, String> {
    let name = value.as_str().ok_or("its name as text")?;
    T::from_name(name).map_err(|error| error.to_string())
}

fn decimation(value: &Value) -> Result<Decimation, String> {
    let text = text(value).unwrap_or_default();
    text.parse().map_err(|error: ModelError| error.to_string())
}

fn number(value: &Value) -> Result<f64, String> {
    value.as_f64().ok_or_else(|| "a number".to_owned())
}

fn numbers(value: &Value) -> Result<Vec<f64>, String> {
    let all = value.as_array().ok_or("a list of numbers")?;
    all.iter().map(number).collect()
}

fn element(value: &Value) -> Result<ContinuousTransferFunction, String> {
    let expected = "text such as \"90/(s(s+6))\", or a pair of coefficients in descending powers of s";
    match value {
        Value::String(text) => text.parse().map_err(|error| format!("{expected} ({error})")),
        Value::Array(pair) if pair.len() == 2 => {
            let (num, den) = (numbers(&pair[0])?, numbers(&pair[1])?);
            ContinuousTransferFunction::new(&num, &den).map_err(|error| format!("{expected} ({error})"))
        }
        _ => Err(expected.to_owned()),
    }
}

fn start(value: &Value) -> Result<RequestedStart, String> {
    match value {
        Value::String(text) if text == "nothing" => Ok(RequestedStart::Nothing),
        Value::Object(named) => {
            let each = named.iter().map(|(name, value)| Ok((name.clone(), number(value)?)));
            each.collect::<Result<_, String>>().map(RequestedStart::Coefficients)
        }
        _ => Err("\"nothing\", or all coefficients by name".to_owned()),
    }
}

fn range(value: &Value, name: &str) -> Result<RangeInclusive<usize>, String> {
    let most = if name == "nk" { MAX_DELAY } else { MAX_ORDER };
    let one = |value: &Value| {
        let number = value.as_u64().and_then(|n| usize::try_from(n).ok());
        number.filter(|n| *n <= most)
    };
    let ends = match value {
        Value::Array(pair) if pair.len() == 2 => one(&pair[0]).zip(one(&pair[1])),
        single => one(single).map(|n| (n, n)),
    };
    match ends {
        Some((low, high)) if low <= high => Ok(low..=high),
        _ => Err(format!(
            "a whole number up to {most}, or two such numbers, the smaller first"
        )),
    }
}

/// Returns a value in the notation of the command line; `None` for null, false and an empty object, which set nothing.
fn text(value: &Value) -> Option<String> {
    Some(match value {
        Value::Null | Value::Bool(false) => return None,
        Value::Bool(true) => "true".to_owned(),
        Value::Number(number) => number.to_string(),
        Value::String(text) => text.clone(),
        Value::Array(ends) => {
            let ends: Vec<String> = ends.iter().map(|end| text(end).unwrap_or_default()).collect();
            ends.join("..")
        }
        Value::Object(named) if named.is_empty() => return None,
        Value::Object(named) => {
            let each: Vec<String> = (named.iter())
                .map(|(name, value)| format!("{name}={}", text(value).unwrap_or_default()))
                .collect();
            each.join(",")
        }
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_track::Stage;

    use super::*;

    fn live(method: &str, options: &str) -> Result<Live, Failure> {
        let asked = TrackerRequest {
            method: Some(method.to_owned()),
            sample_time_s: 0.01,
            options: Some(options.to_owned()),
            fit: None,
        };
        asked.live()
    }

    #[test]
    fn options_match_those_of_python() {
        let found = live(
            "rpem",
            r#"{"structure": "bj", "nk": 29, "nd": [1, 2], "memory": 256, "memory_of": {"b": "inf"}, "largest": 50,
                "at": [1, 2.5], "controlled_element": "90/(s(s+6))", "warm_up": 10, "forgetting": "exponential",
                "criterion": "aicc", "limit": null}"#,
        )
        .unwrap();
        let options = found.plan().options();
        let Stage::Collecting(warm_up) = found.stage() else {
            panic!("no warm-up")
        };
        assert_eq!((options.orders.nk, options.orders.nd, warm_up.needed), (29, 2, 1000));
        assert_eq!((options.largest, options.at_rad_s.clone()), (50.0, vec![1.0, 2.5]));
        let memory = options.method.settings().get("memory_of").unwrap();
        assert_eq!(memory, "b=inf");
        assert!(!found.plan().has_fixed_orders());
        let pair = live("adaptive", r#"{"controlled_element": [[90], [1, 6, 0]]}"#).unwrap();
        assert_eq!(pair.plan().options().controlled_element, options.controlled_element);
        let none = live("adaptive", " ").unwrap();
        assert_eq!(none.plan().options().method, Method::adaptive());
    }

    #[test]
    fn invalid_options_give_the_reason() {
        for (method, options, reason) in [
            ("kalman", "{}", "adaptive"),
            ("rpem", "[1]", "not a JSON object"),
            ("rpem", "{\"nk\": -1}", "whole number"),
            ("rpem", "{\"nk\": [30, 20]}", "smaller first"),
            ("rpem", "{\"nd\": 65}", "64"),
            ("rpem", "{\"colour\": 1}", "no option colour"),
            ("rpem", "{\"at\": 1}", "list of numbers"),
            ("rpem", "{\"structure\": \"curve\"}", "curve"),
            ("rpem", "{\"prior\": \"none\"}", "adaptive"),
            ("rpem", "{\"start\": {\"b0\": 1}, \"nk\": 29, \"nd\": 1}", "it lacks"),
            ("rpem", "{\"warm_up\": 0}", "expected 1 to 10 million samples"),
            ("rpem", "{\"controlled_element\": \"9/\"}", "coefficients"),
            ("multiple-model", "{\"smooth\": true}", "no future samples"),
            ("adaptive", "{\"prior\": \"nowhere.json\"}", "nowhere.json"),
            ("adaptive", "{\"prior\": {\"parameters\": []}}", "no operator form"),
        ] {
            let failure = live(method, options).err().unwrap();
            assert!(failure.text.contains(reason), "{options}: {}", failure.text);
        }
        let mut asked = TrackerRequest {
            method: None,
            sample_time_s: f64::NAN,
            options: None,
            fit: None,
        };
        assert!(asked.live().is_err());
        asked.sample_time_s = 0.01;
        assert!(asked.live().is_ok());
    }
}
