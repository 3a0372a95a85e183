//! From the options of `hoid identify` to a fit.

use hoid::ident::{
    Choice, Estimator, Fit, Focus, GreyBox, GreyBoxFit, InstrumentalVariable, Instruments, Loss, SearchMethod,
    SearchOptions, estimators,
    order_selection::{OrderRanges, fit_or_choose},
};
use hoid::model::{Record, Structure};

use crate::{
    args::{IdentifyArgs, ModelKind, estimators_with, flag},
    error::CliError,
    orders::{self, DelayRange},
    output,
};

/// A fit, how it was chosen, and the options that were special to it.
pub struct Estimated {
    pub fit: Fit,
    pub choice: Option<Choice>,
    pub grey_box: Option<GreyBoxFit>,
    /// What fitted it by the prediction error, with the loss of squares.
    pub estimator: Option<FittedBy>,
    pub settings: Vec<(String, String)>,
}

/// What fitted a model by the prediction error.
pub enum FittedBy {
    Polynomials(Estimator),
    GreyBox(GreyBox),
}

/// What is to be fitted, the options checked against each other.
pub fn kind(args: &IdentifyArgs) -> Result<ModelKind, CliError> {
    let method = args.method;
    let typed = args.structure;
    let kind = match (typed, method) {
        (Some(ModelKind::Family), None) if is_grey_box(args) => ModelKind::GreyBox,
        (Some(kind), None) => kind,
        (None, None) if is_polynomial(args) => ModelKind::Polynomial(Structure::BoxJenkins),
        (None, None) if is_grey_box(args) => ModelKind::GreyBox,
        (None, None) => ModelKind::Family,
        (typed, Some(method)) => {
            let own = ModelKind::Polynomial(method.structure());
            if typed.is_some_and(|kind| kind != own) {
                return Err(CliError::Usage(format!(
                    "--method {method} fits the structure {}; drop --structure, or take --method pem",
                    method.structure().name()
                )));
            }
            own
        }
    };
    match misplaced(args, kind) {
        Some((option, with)) => Err(CliError::Usage(format!("{option} belongs to {with}"))),
        None => Ok(kind),
    }
}

/// True with an option that only a polynomial model has.
fn is_polynomial(args: &IdentifyArgs) -> bool {
    let of_polynomials = |text: &str| {
        let names = text.split(',').filter_map(|part| part.split('=').next());
        names.map(str::trim).any(|name| !matches!(name, "nc" | "nd"))
    };
    args.nk.is_some()
        || args.orders.as_deref().is_some_and(of_polynomials)
        || args.start.is_some()
        || args.fix.is_some()
        || args.bound.is_some()
        || args.coefficient_prior.is_some()
        || args.robust.is_some()
        || args.focus != Focus::default()
        || args.stable
}

/// True with an option that only the grey box with a remnant of order m has.
fn is_grey_box(args: &IdentifyArgs) -> bool {
    let own = |name: &String| matches!(name.as_str(), "K_e_dot" | "T_n");
    args.remnant_order.is_some() || args.fix.is_some() || args.bound.is_some() || args.individual.iter().any(own)
}

/// The first option that has no meaning for this kind of fit, and what it belongs to.
fn misplaced(args: &IdentifyArgs, kind: ModelKind) -> Option<(String, String)> {
    let estimator = match (kind, args.method) {
        (ModelKind::Family, _) => "family",
        (ModelKind::GreyBox, _) => "grey-box",
        (ModelKind::TimeVarying, _) => "time-varying",
        (_, Some(method)) => method.name(),
        (_, None) => "pem",
    };
    let given = [
        ("instruments", args.instruments.is_some()),
        ("remnant_order", args.remnant_order.is_some()),
        ("individual", !args.individual.is_empty()),
        ("delay", args.delay.is_some()),
        ("nk", args.nk.is_some()),
        ("orders", args.orders.is_some()),
        ("initial_state", args.initial_state.is_some()),
        ("start", args.start.is_some()),
        ("fix", args.fix.is_some()),
        ("bound", args.bound.is_some()),
        ("form", args.form.is_some()),
        ("neuromuscular", !args.neuromuscular),
        ("prior", args.prior.is_some()),
        ("excitation", args.excitation.is_some()),
        ("period", args.period.is_some()),
        ("run_to_run", args.run_to_run.is_some()),
        ("coefficient_prior", args.coefficient_prior.is_some()),
        ("robust", args.robust.is_some()),
        ("focus", args.focus != Focus::default()),
        ("stable", args.stable),
        ("search_method", args.search_method != SearchMethod::default()),
    ];
    let all = estimators();
    for (name, _) in given.into_iter().filter(|(_, given)| *given) {
        let of = estimators_with(name, &all);
        if !of.contains(&estimator) {
            return Some((format!("--{}", flag(name)), belongs_to(name, &of)));
        }
    }
    let changing = kind == ModelKind::TimeVarying;
    let input = !matches!(kind, ModelKind::Polynomial(structure) if !structure.has_input());
    let steady = "a model that does not change";
    let others = [
        (
            args.controlled_element.is_some() && !input,
            "--controlled-element",
            "a structure with an input",
        ),
        (
            args.picture.figure.is_some() && (changing || !input),
            "--figure",
            "a model that does not change, of a structure with an input",
        ),
        (args.trace.is_some() && !changing, "--trace", "--structure time-varying"),
        (args.validate.is_some() && changing, "--validate", steady),
        (args.horizon.is_some() && changing, "--horizon", steady),
        (
            args.controlled_element.is_some() && changing,
            "--controlled-element",
            steady,
        ),
        (
            args.report.is_some() && changing,
            "--report",
            "a model that does not change; --trace writes the gains",
        ),
    ];
    let found = others.into_iter().find(|(wrong, _, _)| *wrong);
    found.map(|(_, option, with)| (option.to_owned(), with.to_owned()))
}

/// What an option belongs to, and what to give in its place.
fn belongs_to(name: &str, of: &[&str]) -> String {
    let flag = |name: &&str| match *name {
        "family" => "--structure grey-box".to_owned(),
        "grey-box" => "--structure grey-box --remnant-order M".to_owned(),
        "time-varying" => format!("--structure {name}"),
        _ => format!("--method {name}"),
    };
    let instead = match name {
        "nk" => "; else give --delay in s",
        _ => "",
    };
    let flags: Vec<String> = of.iter().map(flag).collect();
    format!("{}{instead}", flags.join(", "))
}

/// Fits what was asked for.
pub fn fit(args: &IdentifyArgs, kind: ModelKind, records: &[Record]) -> Result<Estimated, CliError> {
    match kind {
        ModelKind::Polynomial(structure) => polynomial(args, structure, records),
        ModelKind::Family | ModelKind::GreyBox | ModelKind::TimeVarying => grey_box(args, records),
    }
}

/// Method and limits of the search as typed.
pub fn search(args: &IdentifyArgs) -> SearchOptions {
    SearchOptions {
        method: args.search_method,
        max_iterations: args.max_iterations,
        tolerance: args.tolerance,
    }
}

fn polynomial(args: &IdentifyArgs, structure: Structure, records: &[Record]) -> Result<Estimated, CliError> {
    let delay = DelayRange::given(args.nk.as_ref(), args.delay);
    let ranges = orders::ranges(
        structure,
        args.orders.as_deref(),
        delay.as_ref(),
        records[0].sample_time(),
    )?;
    let mut settings = vec![
        ("structure".to_owned(), structure.name().to_owned()),
        ("orders".to_owned(), ranges.to_string()),
        ("criterion".to_owned(), args.criterion.to_string()),
        ("focus".to_owned(), args.focus.to_string()),
        ("start".to_owned(), args.start.clone().unwrap_or("own".to_owned())),
    ];
    settings.extend(delay.as_ref().and_then(DelayRange::setting));
    if let Some(prior) = &args.coefficient_prior {
        settings.push(("prior of coefficients".to_owned(), prior.clone()));
    }
    if let Some(threshold) = args.robust {
        let text = format!("Huber, {threshold} standard deviations");
        settings.push(("robust loss".to_owned(), text));
    }
    if args.stable {
        settings.push(("stable models only".to_owned(), "yes".to_owned()));
    }
    let (mut fit, choice, estimator) = prediction_error(args, structure, &ranges, records)?;
    let by_squares = args.method.is_none() && args.robust.is_none();
    let estimator = by_squares.then_some(FittedBy::Polynomials(estimator));
    if let Some(method) = args.method {
        let instruments = instruments(args, records);
        settings.push(("method".to_owned(), format!("{method}, {instruments}")));
        if choice.is_some() {
            settings.push(("orders chosen by".to_owned(), "the prediction error method".to_owned()));
        }
        let estimator = InstrumentalVariable {
            instruments,
            max_iterations: args.max_iterations,
            ..InstrumentalVariable::new(method, fit.orders())
        };
        fit = estimator.fit(records)?;
    }
    Ok(Estimated {
        fit,
        choice,
        grey_box: None,
        estimator,
        settings,
    })
}

fn instruments(args: &IdentifyArgs, records: &[Record]) -> Instruments {
    match args.instruments.as_deref() {
        Some("simulated") => Instruments::Simulated,
        Some(channel) => Instruments::External(channel.to_owned()),
        None => Instruments::usual(records),
    }
}

fn prediction_error(
    args: &IdentifyArgs,
    structure: Structure,
    ranges: &OrderRanges,
    records: &[Record],
) -> Result<(Fit, Option<Choice>, Estimator), CliError> {
    let combinations = ranges.combinations()?;
    let mut estimator = Estimator {
        initial_state: args.initial_state,
        search: search(args),
        constraints: orders::constraints(args.fix.as_deref(), args.bound.as_deref())?,
        priors: orders::priors(args.coefficient_prior.as_deref())?,
        loss: args
            .robust
            .map_or(Loss::Quadratic, |threshold| Loss::Huber { threshold }),
        focus: args.focus,
        stable: args.stable,
        ..Estimator::new(structure, combinations[0])
    };
    if let [orders] = combinations.as_slice() {
        estimator.start = args
            .start
            .as_deref()
            .map(|text| orders::theta(orders, text))
            .transpose()?;
        let fit = output::watched("fitting", || estimator.fit(records))?;
        return Ok((fit, None, estimator));
    }
    if args.start.is_some() {
        return Err(CliError::Usage(
            "--start belongs to one model, but a range of orders or delays is searched; give --nk and --orders as single \
             numbers"
                .to_owned(),
        ));
    }
    let bar = output::progress(combinations.len(), "candidates");
    let found = fit_or_choose(&estimator, ranges, args.criterion, records, &|| bar.inc(1));
    bar.finish_and_clear();
    let (fit, choice) = found?;
    Ok((fit, choice, estimator))
}

fn grey_box(args: &IdentifyArgs, records: &[Record]) -> Result<Estimated, CliError> {
    let m = args.remnant_order.clone().unwrap_or(1..=4);
    let mut estimator = GreyBox {
        constraints: orders::constraints(args.fix.as_deref(), args.bound.as_deref())?,
        individual: args.individual.clone(),
        initial_state: args.initial_state.unwrap_or_default(),
        search: search(args),
        ..GreyBox::new(m.clone())
    };
    if let Some(delay) = args.delay {
        estimator.delay_range_s = delay;
    }
    let (low, high) = estimator.delay_range_s;
    let mut settings = vec![
        ("structure".to_owned(), "grey-box".to_owned()),
        (
            "remnant order m".to_owned(),
            if m.start() == m.end() {
                m.start().to_string()
            } else {
                format!("{}..{}, by BIC", m.start(), m.end())
            },
        ),
        ("delay in s".to_owned(), format!("{low}..{high}")),
    ];
    if !args.individual.is_empty() {
        settings.push(("individual".to_owned(), args.individual.join(", ")));
    }
    let found = output::watched("fitting", || estimator.fit(records))?;
    Ok(Estimated {
        fit: found.polynomial_fit(0).clone(),
        choice: None,
        grey_box: Some(found),
        estimator: Some(FittedBy::GreyBox(estimator)),
        settings,
    })
}
