//! From the options of `hoid track` and `hoid stream` to those of the library.

use std::collections::BTreeMap;

use hoid_ident::{Choice, IdentError, OrderRanges};
use hoid_model::{Record, SampleTime, Structure};
use hoid_track::{
    ForgettingRule, Memory, Method, Regressor, Stable, StartAt, StartCovariance, TrackOptions, TrackPlan, narrowed,
};

use crate::{
    args::{ForgettingName, RecursionArgs},
    error::CliError,
    orders, output,
};

/// Rate of the gradient when none is typed.
const USUAL_RATE: f64 = 0.1;

/// A recursion as it was typed, its options checked against each other; of the orders some may still be ranges.
pub struct Plan {
    plan: TrackPlan,
    sample_time: SampleTime,
}

/// The structure as typed, or that of the method.
pub fn structure(args: &RecursionArgs) -> Structure {
    args.structure
        .map_or_else(|| Method::from(args.method).usual_structure(), Structure::from)
}

impl Plan {
    /// The recursion that was asked for.
    ///
    /// # Errors
    /// [`CliError::Usage`].
    pub fn new(args: &RecursionArgs, sample_time: SampleTime) -> Result<Self, CliError> {
        let (method, structure) = (Method::from(args.method), structure(args));
        misplaced(args, method)?;
        let ranges = ranges(args, structure, sample_time)?;
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
            Some(text) => StartAt::Theta(orders::theta(&largest, text)?),
        };
        let options = TrackOptions {
            forgetting: forgetting(args)?,
            memory: args.memory.or(args.lambda),
            memory_of: unique("--memory-of", args.memory_of.as_deref())?,
            start,
            covariance: args
                .covariance
                .map_or(StartCovariance::OfFit, StartCovariance::Multiple),
            regressor: if args.pseudo_linear {
                Regressor::PseudoLinear
            } else {
                Regressor::Gradient
            },
            stable: args.stable.into(),
            bounds: orders::constraints(None, args.bound.as_deref())?,
            track_delay_s: args.track_delay,
            limit: args.limit,
            largest: args.largest,
            ..TrackOptions::new(method, structure, largest)
        };
        let options = TrackOptions {
            window: args.window.unwrap_or(options.window),
            alarm: args.alarm.unwrap_or(options.alarm),
            every: args.refit.unwrap_or(options.every),
            ..options
        };
        let plan = TrackPlan::new(options, ranges, args.criterion.into(), sample_time)
            .map_err(|e| CliError::Usage(e.to_string()))?;
        Ok(Self { plan, sample_time })
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
    pub fn settings(&self, options: &TrackOptions, choice: Option<&Choice>) -> Vec<(String, String)> {
        let ts = self.sample_time;
        let setting = |name: &str, text: String| (name.to_owned(), text);
        let mut orders = options.orders.to_string();
        if let Some(choice) = choice {
            orders.push_str(&format!(
                " (chosen from {} by {})",
                self.plan.ranges(),
                choice.criterion.name()
            ));
        }
        let mut list = vec![
            setting("method", options.method.name().to_owned()),
            setting("structure", options.structure.name().to_owned()),
            setting("orders", orders),
        ];
        if options.method == Method::Window {
            list.push(setting("window", memory_text(options.window, ts)));
            list.push(setting("fit again every", format!("{} samples", options.every)));
        } else if options.method == Method::Adaptive {
            list.push(setting(
                "memory",
                "since the last change, by a bank of hypotheses".to_owned(),
            ));
            list.push(setting(
                "a change is declared at",
                format!("log odds of {}", options.alarm),
            ));
        } else if options.method.is_model_of_change() {
            list.push(setting("memory", "by a random walk of the parameters".to_owned()));
        } else {
            list.push(setting("memory", memories_text(options, ts)));
            list.push(setting("forgetting", forgetting_text(&options.forgetting)));
            list.push(setting(
                "covariance at the start",
                match (options.covariance, &options.start) {
                    (StartCovariance::Multiple(p), _) => format!("{p} I"),
                    (StartCovariance::OfFit, StartAt::Span(_)) => "of the start fit".to_owned(),
                    (StartCovariance::OfFit, _) => "1e6 I".to_owned(),
                },
            ));
        }
        if options.regressor == Regressor::PseudoLinear {
            list.push(setting("regressor", "pseudo-linear".to_owned()));
        }
        list.push(setting(
            "kept stable",
            match options.stable {
                Stable::Predictor => "C and F",
                Stable::PredictorAndNoise => "C, D and F",
            }
            .to_owned(),
        ));
        for (name, constraint) in &options.bounds {
            let (low, high) = constraint.limits();
            list.push(setting(&format!("bounds of {name}"), format!("{low}..{high}")));
        }
        if let Some((low, high)) = options.track_delay_s {
            list.push(setting("delay tracked within", format!("{low}..{high} s")));
        }
        if options.limit_in_use().is_finite() {
            list.push(setting(
                "limit of innovations",
                format!("{} standard deviations", options.limit_in_use()),
            ));
        }
        list.push(setting(
            "fault",
            format!("not a finite number, or beyond {}", options.largest),
        ));
        list
    }
}

/// Options that have no meaning beside the others.
fn misplaced(args: &RecursionArgs, method: Method) -> Result<(), CliError> {
    let (windowed, adaptive) = (method == Method::Window, method == Method::Adaptive);
    let remembers = !windowed && !method.is_model_of_change() && args.forgetting != ForgettingName::Gradient;
    let options = [
        (args.window.is_some() && !windowed, "--window", "--method window"),
        (args.refit.is_some() && !windowed, "--refit", "--method window"),
        (
            (args.memory.is_some() || args.lambda.is_some()) && !remembers,
            "--memory",
            "a recursion that forgets; window has --window, --forgetting gradient has --rate, adaptive, ekf and ukf a model of the change",
        ),
        (
            args.memory_of.is_some() && !remembers,
            "--memory-of",
            "a recursion that forgets; window has --window, --forgetting gradient has --rate, adaptive, ekf and ukf a model of the change",
        ),
        (
            args.bound.is_some() && !method.is_physical(),
            "--bound",
            "--method physical, adaptive, ekf or ukf",
        ),
        (args.alarm.is_some() && !adaptive, "--alarm", "--method adaptive"),
        (
            args.track_delay.is_some() && !(adaptive || method == Method::Physical),
            "--track-delay",
            "--method physical or adaptive",
        ),
        (
            args.drift.is_some() && args.forgetting != ForgettingName::RandomWalk,
            "--drift",
            "--forgetting random-walk",
        ),
        (
            args.rate.is_some() && args.forgetting != ForgettingName::Gradient,
            "--rate",
            "--forgetting gradient",
        ),
    ];
    match options.into_iter().find(|(wrong, _, _)| *wrong) {
        Some((_, option, with)) => Err(CliError::Usage(format!("{option} belongs to {with}"))),
        None => Ok(()),
    }
}

/// Orders as typed; what would be searched is that of the start where one was typed, and the delay lies within the range that is tracked.
fn ranges(args: &RecursionArgs, structure: Structure, sample_time: SampleTime) -> Result<OrderRanges, CliError> {
    let mut ranges = orders::ranges(structure, args.orders.as_deref(), args.nk.as_ref(), sample_time)?;
    let method = Method::from(args.method);
    if method == Method::Adaptive && !args.orders.as_deref().is_some_and(|o| o.contains("nd")) {
        let nd = method.usual_orders(1).nd;
        ranges.nd = nd..=nd;
    }
    let typed_nk = args.nk.is_some() || args.orders.as_deref().is_some_and(|o| o.contains("nk"));
    let start = args.start.as_deref().filter(|text| text.trim() != "nothing");
    let names: Vec<String> = match (start, &args.orders) {
        (Some(text), None) => orders::parse_pairs(text)
            .map_err(|e| CliError::Usage(format!("--start: {e}")))?
            .into_iter()
            .map(|(name, _)| name)
            .collect(),
        _ => Vec::new(),
    };
    let delay = args.track_delay.filter(|_| !typed_nk);
    Ok(narrowed(ranges, delay, &names, sample_time))
}

fn forgetting(args: &RecursionArgs) -> Result<ForgettingRule, CliError> {
    Ok(match args.forgetting {
        ForgettingName::Exponential => ForgettingRule::Exponential,
        ForgettingName::RandomWalk => match &args.drift {
            None => {
                return Err(CliError::Usage(
                    "--forgetting random-walk needs --drift, as K_e=.01: the standard deviation of the drift in one second"
                        .to_owned(),
                ));
            }
            Some(drift) => ForgettingRule::RandomWalk(unique("--drift", Some(drift))?),
        },
        ForgettingName::Window => ForgettingRule::Window,
        ForgettingName::Variable => ForgettingRule::Variable,
        ForgettingName::Directional => ForgettingRule::Directional,
        ForgettingName::Gradient => ForgettingRule::Gradient(args.rate.unwrap_or(USUAL_RATE)),
    })
}

/// Each name once.
fn unique<T: Copy>(option: &str, list: Option<&[(String, T)]>) -> Result<BTreeMap<String, T>, CliError> {
    let mut all = BTreeMap::new();
    for (name, value) in list.unwrap_or_default() {
        if all.insert(name.clone(), *value).is_some() {
            return Err(CliError::Usage(format!("{option}: {name} is given twice")));
        }
    }
    Ok(all)
}

fn memory_text(memory: Memory, sample_time: SampleTime) -> String {
    let ts = sample_time.s();
    let round = |v: f64| (v * 1e6).round() / 1e6;
    match memory {
        Memory::Samples(n) => format!("{} samples ({} s)", round(n), round(n * ts)),
        Memory::Seconds(s) => format!("{s} s ({} samples)", round(s / ts)),
        Memory::Infinite => "without end".to_owned(),
    }
}

/// The memories, parameters of the same memory together.
fn memories_text(options: &TrackOptions, sample_time: SampleTime) -> String {
    let mut groups: Vec<(Memory, Vec<String>)> = Vec::new();
    let names = options.parameter_names();
    for (name, memory) in names.into_iter().zip(options.memories().unwrap_or_default()) {
        match groups.iter_mut().find(|(m, _)| *m == memory) {
            Some((_, of)) => of.push(name),
            None => groups.push((memory, vec![name])),
        }
    }
    let each = |(memory, of): &(Memory, Vec<String>)| format!("{} {}", of.join(" "), memory_text(*memory, sample_time));
    match groups.as_slice() {
        [(memory, _)] => memory_text(*memory, sample_time),
        all => all.iter().map(each).collect::<Vec<_>>().join(", "),
    }
}

fn forgetting_text(rule: &ForgettingRule) -> String {
    match rule {
        ForgettingRule::Exponential => "exponential".to_owned(),
        ForgettingRule::RandomWalk(drift) => {
            let each: Vec<String> = drift.iter().map(|(name, d)| format!("{name} {d}")).collect();
            format!("random walk, drift in one second: {}", each.join(", "))
        }
        ForgettingRule::Window => "sliding window of the shortest memory".to_owned(),
        ForgettingRule::Variable => "variable, with the shortest memory".to_owned(),
        ForgettingRule::Directional => "directional, with the shortest memory".to_owned(),
        ForgettingRule::Gradient(rate) => format!("normalised gradient of rate {rate}"),
    }
}
