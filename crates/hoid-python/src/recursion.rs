//! Conversion of the options of `pyhoid.track` and `pyhoid.Tracker` to those of the library.

use std::collections::BTreeMap;

use hoid_analysis::two_inputs;
use hoid_ident::{
    IdentError,
    settings::{DelayRange, MethodSpec},
};
use hoid_io::{FitFile, parse_fit};
use hoid_track::{Method, RequestedStart, TrackRequest};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    controlled_element::ControlledElement,
    errors::{Outcome, bad_option},
    names,
};

/// Returns the value of a keyword; `None` if it was not given.
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

/// Creates the request of a recursion from its keywords.
pub fn request(options: &Bound<'_, PyDict>) -> Outcome<TrackRequest> {
    let text = |name: &str| get::<String>(options, name);
    let delay: Option<(f64, f64)> = get(options, "delay")?;
    let orders: BTreeMap<String, (usize, usize)> = get(options, "orders")?.unwrap_or_default();
    let start: Option<BTreeMap<String, f64>> = get(options, "start")?;
    let from_nothing = get(options, "from_nothing")?.unwrap_or(false);
    let default = TrackRequest::of(method(options)?);
    let structure = text("structure")?.map(|name| names::structure(&name)).transpose()?;
    let inputs: Vec<String> = get(options, "inputs")?.unwrap_or_default();
    let (orders, further) = match inputs.is_empty() {
        true => (names::named_orders(&orders)?, None),
        false => {
            let orders = text("orders_of_inputs")?.unwrap_or_default();
            let role = text("role")?.unwrap_or_default();
            let (orders, further) = two_inputs(&default.method, structure, &orders, None, &inputs, &role)?;
            (orders, Some(further))
        }
    };
    Ok(TrackRequest {
        structure,
        orders,
        further,
        delay: delay.map(|(low, high)| DelayRange::Seconds(low, high)),
        start: match start {
            Some(start) => RequestedStart::Coefficients(start),
            None if from_nothing => RequestedStart::Nothing,
            None => RequestedStart::Default,
        },
        criterion: text("criterion")?.map_or(Ok(default.criterion), |name| names::criterion(&name))?,
        largest: get(options, "largest")?.unwrap_or(default.largest),
        at_rad_s: get(options, "at")?.unwrap_or_default(),
        controlled_element: get::<ControlledElement>(options, "controlled_element")?
            .map(|element| element.transfer_function())
            .transpose()?,
        ..default
    })
}

/// Returns the method with its options, which are given as text by name.
fn method(options: &Bound<'_, PyDict>) -> Outcome<Method> {
    let mut method = match get::<String>(options, "method")? {
        Some(name) => {
            // A pickle may contain an earlier name of a method.
            let name = renamed_method(&name).map_or(name, |(now, _)| now.to_owned());
            if let Some(reason) = hoid_thesis::comparators::untracked_comparator_message(&name) {
                return Err(bad_option(reason));
            }
            let words = hoid_survey::methods().into_iter().map(|method| (method.name(), method));
            names::value_of_name("method", &name, &words.collect::<Vec<_>>())?
        }
        None => Method::default(),
    };
    let mut given: BTreeMap<String, String> = get(options, "settings")?.unwrap_or_default();
    // Options are set in the order of the registry, in which the kind of forgetting precedes the options that depend on
    // it.
    for setting in hoid_survey::registry().into_iter().flat_map(|spec| spec.settings) {
        let Some(text) = given.remove(setting.name) else {
            continue;
        };
        let keyword = names::keyword(setting.name);
        if !method.settings().list().iter().any(|own| own.name == setting.name) {
            let has = |spec: &MethodSpec| spec.settings.iter().any(|own| own.name == setting.name);
            let of = hoid_survey::registry()
                .into_iter()
                .filter(has)
                .map(|spec| format!("\"{}\"", spec.name));
            let of = of.collect::<Vec<_>>().join(", ");
            return Err(bad_option(format!("{keyword} applies only to method={of}")));
        }
        let wrong = |error: IdentError| bad_option(format!("{keyword}: {error}"));
        method.set(setting.name, &text).map_err(wrong)?;
    }
    // An earlier fit of the person, given as text with its source.
    if let Some((text, source)) = get::<(String, String)>(options, "fit")? {
        let fit = parse_fit(&text, &source).and_then(FitFile::operator)?;
        method.start_from(fit)?;
    }
    Ok(method)
}

/// Returns, for an earlier name of a recursive method, the current name and a sentence that reports the change.
#[pyfunction]
pub fn renamed_method(name: &str) -> Option<(&'static str, String)> {
    hoid_survey::renamed_method(name)
}

/// Returns the name, the help text and the literature of each recursive method, and the keywords that it accepts.
#[pyfunction]
pub fn recursive_methods() -> Vec<(&'static str, &'static str, &'static str, Vec<String>)> {
    let keywords = |spec: &MethodSpec| {
        spec.settings
            .iter()
            .map(|s| names::keyword(s.name).to_owned())
            .collect()
    };
    let of = |spec: MethodSpec| (spec.name, spec.help, spec.source, keywords(&spec));
    hoid_survey::registry().into_iter().map(of).collect()
}
