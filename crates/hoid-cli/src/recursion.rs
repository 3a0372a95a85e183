//! Converts the options of `hoid track` and `hoid stream` to options of the library.

use std::path::Path;

use hoid::analysis::{Tracking, two_inputs};
use hoid::ident::{Choice, IdentError, NamedOrders, settings::DelayRange};
use hoid::io::{is_fit_file, read_fit};
use hoid::model::Record;
use hoid::survey;
use hoid::track::{Method, RequestedStart, TrackOptions, TrackPlan, TrackRequest};

use crate::{
    args::{RecursionArgs, TrackArgs, flag, methods_with},
    error::CliError,
    orders, output,
};

/// Name of the option whose value may be a file.
const PRIOR_OPTION: &str = "prior";

/// Returns the requested recursion.
///
/// # Errors
/// [`CliError::Usage`] if an option is invalid.
pub fn request(args: &RecursionArgs) -> Result<TrackRequest, CliError> {
    let nk = match args.nk.as_slice() {
        [] => None,
        [one] => Some(one),
        several => {
            return Err(CliError::Usage(format!(
                "--nk: found {} numbers, but there is one input; give one number",
                several.len()
            )));
        }
    };
    let delay = DelayRange::from_options(nk, args.delay);
    let orders = orders::named_orders(args.orders.as_deref(), delay.as_ref())?;
    request_from_orders(args, orders, delay)
}

/// Returns the requested recursion of a model with two inputs.
fn two_input_request(args: &TrackArgs) -> Result<TrackRequest, CliError> {
    let typed = &args.recursion;
    let samples = |delay: &DelayRange| match delay {
        DelayRange::Samples(range) if range.start() == range.end() => Ok(range.start().to_string()),
        other => Err(CliError::Usage(format!(
            "--nk: found {other}; give one number of samples for each of the two inputs, such as 29,12"
        ))),
    };
    if typed.delay.is_some() {
        return Err(CliError::Usage(
            "--delay applies only to models with one input; use --nk, such as --nk 29,12".to_owned(),
        ));
    }
    let nk = typed.nk.iter().map(samples).collect::<Result<Vec<_>, _>>()?.join(",");
    let (orders, further) = two_inputs(
        &method_with_settings(typed)?,
        typed.structure,
        typed.orders.as_deref().unwrap_or_default(),
        Some(nk.as_str()).filter(|nk| !nk.is_empty()),
        &args.read.inputs,
        args.role.as_deref().unwrap_or_default(),
    )
    .map_err(CliError::from_options)?;
    Ok(TrackRequest {
        further: Some(further),
        ..request_from_orders(typed, orders, None)?
    })
}

fn request_from_orders(
    args: &RecursionArgs,
    orders: NamedOrders,
    delay: Option<DelayRange>,
) -> Result<TrackRequest, CliError> {
    Ok(TrackRequest {
        method: method_with_settings(args)?,
        structure: args.structure,
        orders,
        delay,
        further: None,
        start: match args.start.as_deref().map(str::trim) {
            None => RequestedStart::Default,
            Some("nothing") => RequestedStart::Nothing,
            Some(text) => RequestedStart::Coefficients(orders::parse_start(text)?),
        },
        criterion: args.criterion,
        largest: args.largest,
        at_rad_s: args.at.clone(),
        controlled_element: args.controlled_element.clone(),
    })
}

/// Returns the requested recursion over a record.
///
/// # Errors
/// Same as [`request`].
pub fn tracking(args: &TrackArgs) -> Result<Tracking, CliError> {
    let recursion = match (args.read.inputs.len(), &args.role) {
        (2.., _) => two_input_request(args)?,
        (_, None) => request(&args.recursion)?,
        (_, Some(role)) => {
            return Err(CliError::Usage(format!(
                "--role {role} names a second input; add it with --input"
            )));
        }
    };
    Ok(Tracking {
        recursion,
        start_span_s: args.start_span,
        update_from_s: args.update_from,
        moving_average_s: args.moving_average,
        every: args.every,
        rate: args.read.prepare.rate.decimate,
        update_covariance: args.update_covariance,
    })
}

/// Selects the orders that a plan leaves open, with a progress display.
///
/// # Errors
/// The errors of the search.
pub fn choose(plan: &TrackPlan, span: &Record) -> Result<(TrackOptions, Option<Choice>), IdentError> {
    run_search(plan, |each| plan.choose(span, each))
}

/// Runs a computation that selects the open orders of a plan, with a progress display. `work` must call its argument
/// after every candidate.
pub fn run_search<T>(plan: &TrackPlan, work: impl FnOnce(&(dyn Fn() + Sync)) -> T) -> T {
    if plan.has_fixed_orders() {
        return work(&|| {});
    }
    let candidates = plan.ranges().combinations().map_or(0, |all| all.len());
    let bar = output::progress_bar(candidates, "candidates");
    let done = work(&|| bar.inc(1));
    bar.finish_and_clear();
    done
}

/// Returns the method with a given name. If the name is an earlier one, the current name is reported.
///
/// # Errors
/// [`CliError::Usage`] for an unknown name.
pub fn parse_method(name: &str) -> Result<Method, CliError> {
    if let Some((_, renamed)) = survey::renamed_method(name) {
        output::add_notice("", format!("note: {renamed}"));
    }
    Ok(survey::method(name)?)
}

/// Returns the method with the given options.
///
/// # Errors
/// [`CliError::Usage`] if an option belongs to another method or a value is invalid.
fn method_with_settings(args: &RecursionArgs) -> Result<Method, CliError> {
    let usage = |name: &str, text: &str| CliError::Usage(format!("--{} {text}", flag(name)));
    let mut method = parse_method(&args.method)?;
    for (name, text) in args.settings.given_settings() {
        let of = methods_with(name, &survey::registry()).join(" or ");
        if !method.settings().list().iter().any(|setting| setting.name == name) {
            return Err(usage(name, &format!("applies only to --method {of}")));
        }
        if name == PRIOR_OPTION && is_fit_file(text) {
            let fit = read_fit(Path::new(text))?.operator()?;
            method
                .start_from(fit)
                .map_err(|error| usage(name, &error.to_string()))?;
            continue;
        }
        method
            .set(name, text)
            .map_err(|error| usage(name, &format!("{text}: {error}")))?;
    }
    Ok(method)
}

/// Returns the path given by `--prior`, if its value is a file.
pub fn prior_file(args: &RecursionArgs) -> Option<&Path> {
    let prior = args.settings.given_settings().find(|(name, _)| *name == PRIOR_OPTION);
    prior
        .map(|(_, text)| text)
        .filter(|text| is_fit_file(text))
        .map(Path::new)
}
