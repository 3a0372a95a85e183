//! From the options of `hoid track` and `hoid stream` to those of the library.

use std::path::Path;

use hoid::analysis::Setting;
use hoid::ident::{
    Choice, IdentError, OrderRanges,
    settings::{DelayRange, named_pairs},
};
use hoid::io::{is_fit_file, read_fit};
use hoid::model::{Record, SampleTime, Structure, theta_of};
use hoid::track::{Method, StartAt, TrackOptions, TrackPlan, ranges_of};

use crate::{
    args::{RecursionArgs, flag, methods_with},
    error::CliError,
    orders, output,
};

/// The option that may be a file.
const PRIOR: &str = "prior";

/// A recursion as it was typed, its options checked against each other; of the orders some may
/// still be ranges.
pub struct Plan {
    plan: TrackPlan,
    delay: Option<DelayRange>,
    sample_time: SampleTime,
    /// What was typed of that which has a default.
    typed: Typed,
}

/// Whether it was typed.
struct Typed {
    method: bool,
    structure: bool,
    orders: bool,
    memory: bool,
    largest: bool,
}

impl Typed {
    fn of(args: &RecursionArgs) -> Self {
        Self {
            method: args.method != Method::default().name(),
            structure: args.structure.is_some(),
            orders: args.orders.is_some() || args.nk.is_some() || args.delay.is_some(),
            memory: args.settings.given().any(|(name, _)| name.starts_with("memory")),
            largest: args.largest != TrackOptions::LARGEST,
        }
    }
}

/// The structure as typed, or that of the method.
///
/// # Errors
/// As [`method`].
pub fn structure(args: &RecursionArgs) -> Result<Structure, CliError> {
    match args.structure {
        Some(structure) => Ok(structure),
        None => Ok(method(args)?.usual_structure()),
    }
}

/// Whether the recursion is of polynomials, or its delay was typed in samples: such takes the samples as
/// they are.
///
/// # Errors
/// As [`method`].
pub fn counts_samples(args: &RecursionArgs) -> Result<bool, CliError> {
    Ok(matches!(args.nk, Some(DelayRange::Samples(_))) || method(args)?.counts_samples())
}

/// The method of a name as typed; of an earlier name it is said what it is called now.
///
/// # Errors
/// A name that no method has.
pub fn method_of(name: &str) -> Result<Method, CliError> {
    if let Some((_, renamed)) = Method::renamed(name) {
        output::notice("", format!("note: {renamed}"));
    }
    Ok(name.parse()?)
}

/// The method with the options that were typed.
///
/// # Errors
/// [`CliError::Usage`] for an option of another method, or a text that is no value of it.
fn method(args: &RecursionArgs) -> Result<Method, CliError> {
    let usage = |name: &str, text: &str| CliError::Usage(format!("--{} {text}", flag(name)));
    let mut method = method_of(&args.method)?;
    for (name, text) in args.settings.given() {
        let of = methods_with(name, &Method::registry()).join(" or ");
        if !method.settings().list().iter().any(|setting| setting.name == name) {
            return Err(usage(name, &format!("belongs to --method {of}")));
        }
        if name == PRIOR && is_fit_file(text) {
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

/// The file of `--prior`, where it is one.
pub fn prior_file(args: &RecursionArgs) -> Option<&Path> {
    let prior = args.settings.given().find(|(name, _)| *name == PRIOR);
    prior
        .map(|(_, text)| text)
        .filter(|text| is_fit_file(text))
        .map(Path::new)
}

impl Plan {
    /// The recursion that was asked for.
    ///
    /// # Errors
    /// [`CliError::Usage`].
    pub fn new(args: &RecursionArgs, sample_time: SampleTime) -> Result<Self, CliError> {
        let (method, structure) = (method(args)?, structure(args)?);
        let ranges = ranges(args, &method, structure, sample_time)?;
        let combinations = ranges.combinations()?;
        // The largest of each order: what is not known there is not known at all.
        let largest = combinations[combinations.len() - 1];
        let start = match args.start.as_deref().map(str::trim) {
            None => StartAt::Span(None),
            Some("nothing") => StartAt::Nothing,
            Some(_) if combinations.len() > 1 => {
                return Err(CliError::Usage(
                    "--start belongs to one model; give --nk and --orders as single numbers".to_owned(),
                ));
            }
            Some(text) => {
                let theta = theta_of(&largest.parameter_names(), &orders::start(text)?);
                StartAt::Theta(theta.map_err(|reason| CliError::Usage(format!("--start {reason}")))?)
            }
        };
        let options = TrackOptions {
            start,
            largest: args.largest,
            at_rad_s: args.at.clone(),
            controlled_element: args.controlled_element.clone(),
            ..TrackOptions::new(method, structure, largest)
        };
        let plan =
            TrackPlan::new(options, ranges, args.criterion, sample_time).map_err(|e| CliError::Usage(e.to_string()))?;
        Ok(Self {
            plan,
            delay: DelayRange::given(args.nk.as_ref(), args.delay),
            sample_time,
            typed: Typed::of(args),
        })
    }

    /// True when no order is left to be searched.
    pub fn is_settled(&self) -> bool {
        self.plan.is_settled()
    }

    /// The options; until [`Plan::choose`] with the largest orders of the ranges.
    pub fn options(&self) -> &TrackOptions {
        self.plan.options()
    }

    /// Searches what is left open on a record, nothing when all is settled.
    ///
    /// # Errors
    /// Those of the search.
    pub fn choose(&self, span: &Record) -> Result<(TrackOptions, Option<Choice>), IdentError> {
        if self.is_settled() {
            return Ok((self.options().clone(), None));
        }
        let candidates = self.plan.ranges().combinations()?.len();
        let bar = output::progress(candidates, "candidates");
        let chosen = self.plan.choose(span, &|| bar.inc(1));
        bar.finish_and_clear();
        chosen
    }

    /// Every option that shapes the result, defaults included, with units.
    pub fn settings(&self, options: &TrackOptions, choice: Option<&Choice>) -> Vec<Setting> {
        let (ts, typed) = (self.sample_time, &self.typed);
        let mut orders = options.orders.to_string();
        if let Some(choice) = choice {
            orders.push_str(&format!(
                " (chosen from {} by {})",
                self.plan.ranges(),
                choice.criterion.label()
            ));
        }
        let mut list = vec![
            Setting::new("method", options.method.name()).given(typed.method),
            Setting::new("structure", options.structure.name()).given(typed.structure),
            Setting::new("orders", orders).given(typed.orders),
        ];
        if let Some(delay @ DelayRange::Seconds(..)) = &self.delay {
            list.push(Setting::new("delay", delay.to_string()).given(true));
        }
        list.push(Setting::new("memory", options.memory_in_words(ts)).given(typed.memory));
        for own in options.method.settings().list() {
            // The memory stands above with the defaults of all parameters.
            if let Some(text) = options.method.settings().get(own.name).filter(|text| !text.is_empty()) {
                let given = text != own.default;
                list.push(Setting::new(own.name.replace('_', " "), text).given(given));
            }
        }
        if options.method.limit().is_finite() {
            list.push(Setting::new(
                "limit of innovations",
                format!("{} standard deviations", options.method.limit()),
            ));
        }
        if !options.at_rad_s.is_empty() {
            let each: Vec<String> = options.at_rad_s.iter().map(f64::to_string).collect();
            list.push(Setting::new("response at", format!("{} rad/s", each.join(", "))).given(true));
        }
        if let Some(element) = &options.controlled_element {
            list.push(Setting::new("controlled element", element.to_string()).given(true));
        }
        let fault = format!("not a finite number, or beyond {}", options.largest);
        list.push(Setting::new("fault", fault).given(typed.largest));
        list
    }
}

/// Orders as typed; what would be searched is that of the start where one was typed, and the delay
/// lies within the range that is tracked.
fn ranges(
    args: &RecursionArgs,
    method: &Method,
    structure: Structure,
    sample_time: SampleTime,
) -> Result<OrderRanges, CliError> {
    let usage = |error: IdentError| CliError::Usage(error.to_string());
    let delay = DelayRange::given(args.nk.as_ref(), args.delay);
    let mut named = orders::named_orders(args.orders.as_deref(), delay.as_ref())?;
    if let Some(delay) = &delay {
        named.insert("nk".to_owned(), delay.samples(sample_time));
    }
    let start = args.start.as_deref().filter(|text| text.trim() != "nothing");
    let names: Vec<String> = start
        .map_or(Ok(Vec::new()), named_pairs)
        .map_err(|expected| CliError::Usage(format!("--start: expected {expected}")))?
        .into_iter()
        .map(|(name, _)| name)
        .collect();
    let ranges = ranges_of(method, structure, &named, &names, sample_time).map_err(usage)?;
    ranges.candidates().map_err(usage)?;
    Ok(ranges)
}
