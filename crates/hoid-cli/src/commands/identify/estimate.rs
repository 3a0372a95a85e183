//! From the options of `hoid identify` to an estimator.

use hoid::analysis::{BatchEstimator, Excitation, Identification, Polynomials, prior_of_text};
use hoid::ident::{
    Estimator, Focus, GreyBox, IdentError, InitialState, Instruments, Loss, NamedOrders, SearchMethod, SearchOptions,
    SigmoidChange, estimators, family::FamilyEstimator,
};
use hoid::model::{Detrend, Structure, operator_family::Coordinate};

use crate::{
    args::{IdentifyArgs, ModelKind, estimators_with, flag},
    error::CliError,
    orders::{self, DelayRange},
};

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

/// How it is identified.
pub fn identification<E: BatchEstimator>(args: &IdentifyArgs, estimator: E) -> Identification<E> {
    Identification {
        estimator,
        excitation: Excitation::of_text(args.excitation.as_deref()),
        period_s: args.period,
        faults: args.faults.faults,
        rate: args.read.prepare.rate.decimate,
        controlled_element: args.controlled_element.clone(),
    }
}

/// Method and limits of the search: as typed, else as the estimator has them.
fn search(args: &IdentifyArgs, usual: SearchOptions) -> SearchOptions {
    SearchOptions {
        method: args.search_method,
        max_iterations: args.max_iterations.unwrap_or(usual.max_iterations),
        tolerance: args.tolerance.unwrap_or(usual.tolerance),
    }
}

/// The operator of a person.
pub fn operator(args: &IdentifyArgs) -> Result<FamilyEstimator, CliError> {
    let usual = FamilyEstimator::default();
    let usual = usual.with_noise_orders(&noise_orders(args)?).map_err(wrong_orders)?;
    Ok(FamilyEstimator {
        forms: args.form.map_or(usual.forms, |form| vec![form]),
        neuromuscular: args.neuromuscular,
        prior: args.prior.as_deref().map_or(Ok(usual.prior), prior_of_text)?,
        delay_range_s: args.delay.unwrap_or(usual.delay_range_s),
        individual: args
            .individual
            .iter()
            .map(|name| coordinate(name))
            .collect::<Result<_, _>>()?,
        run_to_run: args.run_to_run.unwrap_or(usual.run_to_run),
        // What was asked for in reading has been done.
        detrend: if args.read.detrend == Detrend::None {
            usual.detrend
        } else {
            Detrend::None
        },
        initial_state: args.initial_state.unwrap_or_default(),
        search: search(args, usual.search),
        ..usual
    })
}

/// The orders of the noise from `--orders`.
fn noise_orders(args: &IdentifyArgs) -> Result<NamedOrders, CliError> {
    let pairs = orders::parse_pairs(args.orders.as_deref().unwrap_or_default()).map_err(CliError::Usage)?;
    let of = |(name, value): (String, String)| match orders::parse_range(&value) {
        Ok(range) => Ok((name, range)),
        Err(reason) => Err(CliError::Usage(format!("--orders {name}: {reason}"))),
    };
    pairs.into_iter().map(of).collect()
}

/// An option that does not fit the estimator.
fn wrong_orders(error: IdentError) -> CliError {
    CliError::Usage(format!("--orders: {error}"))
}

fn coordinate(name: &str) -> Result<Coordinate, CliError> {
    Coordinate::of_parameter(name).ok_or_else(|| {
        CliError::Usage(format!(
            "--individual: there is no parameter {name}; expected K, T_L, T_I, omega_nm, zeta_nm or tau_e"
        ))
    })
}

/// A polynomial structure.
pub fn polynomials(args: &IdentifyArgs, structure: Structure) -> Result<Polynomials, CliError> {
    let usual = Polynomials::new(structure);
    let delay = DelayRange::given(args.nk.as_ref(), args.delay);
    let template = Estimator {
        initial_state: args.initial_state,
        search: search(args, usual.template.search),
        constraints: orders::constraints(args.fix.as_deref(), args.bound.as_deref())?,
        priors: orders::priors(args.coefficient_prior.as_deref())?,
        loss: args
            .robust
            .map_or(Loss::Quadratic, |threshold| Loss::Huber { threshold }),
        focus: args.focus,
        stable: args.stable,
        ..usual.template
    };
    Ok(Polynomials {
        template,
        orders: orders::named_orders(args.orders.as_deref(), delay.as_ref())?,
        delay_s: delay.as_ref().and_then(DelayRange::seconds),
        criterion: args.criterion,
        start: args.start.as_deref().map(orders::start).transpose()?,
        method: args.method,
        instruments: args.instruments.as_deref().map(Instruments::of_text),
    })
}

/// The operator of a gain and a lead with its remnant.
pub fn remnant(args: &IdentifyArgs) -> Result<GreyBox, CliError> {
    let usual = GreyBox::new(args.remnant_order.clone().unwrap_or(1..=4));
    Ok(GreyBox {
        delay_range_s: args.delay.unwrap_or(usual.delay_range_s),
        constraints: orders::constraints(args.fix.as_deref(), args.bound.as_deref())?,
        individual: args.individual.clone(),
        initial_state: args.initial_state.unwrap_or_default(),
        search: search(args, usual.search),
        ..usual
    })
}

/// The operator whose gains change once.
pub fn sigmoid(args: &IdentifyArgs) -> Result<SigmoidChange, CliError> {
    if args.initial_state.is_some_and(|rule| rule != InitialState::Estimate) {
        return Err(CliError::Usage(
            "--initial-state: the time-varying fit estimates the initial states; give auto or estimate".to_owned(),
        ));
    }
    let usual = SigmoidChange::default()
        .with_noise_orders(&noise_orders(args)?)
        .map_err(wrong_orders)?;
    Ok(SigmoidChange {
        form: args.form.unwrap_or(usual.form),
        neuromuscular: args.neuromuscular,
        prior: args.prior.as_deref().map_or(Ok(usual.prior.clone()), prior_of_text)?,
        delay_range_s: args.delay.unwrap_or(usual.delay_range_s),
        constraints: orders::constraints(args.fix.as_deref(), args.bound.as_deref())?,
        search: search(args, usual.search),
        ..usual
    })
}
