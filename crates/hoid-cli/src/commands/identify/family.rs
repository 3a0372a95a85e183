//! `hoid identify` by default: the operator of a person, of the family of operators.

use std::path::Path;

use hoid::ident::{
    IdentError, SearchOptions,
    family::{FamilyEstimator, HIGHEST_NOISE_ORDER, OperatorPrior},
    frequency::Description,
    judgement::second_opinion,
};
use hoid::io::{IoError, is_fit_file, read_fit};
use hoid::model::{Detrend, Record, VerdictLevel, operator_family::Coordinate};
use hoid::report::{
    ModelSection, Picture, Report,
    figures::{ModelCurve, describing},
    write_report,
};

use super::{
    family_form::Found,
    level,
    picture::{description, of_polynomials},
    settings::common_settings,
};
use crate::{
    args::IdentifyArgs,
    commands::{
        faults, figure,
        reading::{self, Account},
    },
    error::CliError,
    json, orders, output,
};

pub fn run(args: &IdentifyArgs, files: &[String], records: &[Record], accounts: &[Account]) -> Result<(), CliError> {
    let mut estimator = estimator(args)?;
    let described = description(args, records);
    // What was found, or what was named: instruments need no lines.
    estimator.excitation = match &described {
        Ok(found) => found.channel.clone(),
        Err(_) => args.excitation.clone().filter(|e| e != "none"),
    };
    let of_lines = match &described {
        Ok(found) => Some(Ok(found.function.clone())),
        // What was looked for by name is missed; what was looked for by itself is not.
        Err(CliError::Ident(error)) if args.excitation.as_deref().is_some_and(|e| e != "none") => {
            Some(Err(error.clone()))
        }
        Err(_) => None,
    };
    let mut fit = output::watched("fitting", || estimator.fit_beside(records, of_lines))?;
    if args.faults.looks() {
        let element = args.controlled_element.as_ref();
        let opinions = output::watched("a second opinion", || {
            second_opinion::of_family(&estimator, &fit, records, element)
        });
        fit.verdict = fit.verdict.and(opinions);
    }
    if let Some(element) = &args.controlled_element {
        fit.verdict = fit.verdict.clone().and(fit.loop_finding(0, element));
    }
    fit.verdict = faults::judged(fit.verdict, files, accounts);
    let described = described.ok();
    let validation = match &args.validate {
        Some(path) => {
            let other = reading::read(path, &args.read, true)?.0;
            let other = reading::decimated(other, &args.read, false)?
                .0
                .detrended(estimator.detrend);
            Some((
                path.display().to_string(),
                fit.operator(0).polynomial_fit.quality(&[other])?,
            ))
        }
        None => None,
    };
    let mut settings = settings(args, &estimator);
    settings.extend(common_settings(args, true));
    if let Some(channel) = described.as_ref().and_then(|d| d.channel.clone()) {
        settings.push(("excitation".to_owned(), channel));
    }
    let mut accounts = accounts.to_vec();
    if estimator.detrend == Detrend::Mean {
        level::into_accounts(&mut accounts, records, |k, record| {
            fit.operator(k).polynomial_fit.level(record)
        });
    }
    let prepared: Vec<Record> = records.iter().map(|r| r.clone().detrended(estimator.detrend)).collect();
    let found = Found {
        fit: &fit,
        files,
        records: &prepared,
        accounts: &accounts,
        element: args.controlled_element.as_ref(),
        validation: validation.as_ref().map(|(file, q)| (file.as_str(), *q)),
        settings: &settings,
    };
    if let Some(path) = &args.picture.figure {
        let svg = match &described {
            Some(described) => picture(&found, described),
            None => of_polynomials(&fit.operator(0).polynomial_fit, &prepared, None),
        };
        figure::write(path, &svg, args.picture.width)?;
    }
    if let Some(directory) = &args.report {
        report(&found, described.as_ref(), directory)?;
    }
    if args.show.json {
        json::print(&found.to_json()?)?;
    } else {
        output::show(&found.page(args.show.verbose)?)?;
    }
    if fit.verdict.level == VerdictLevel::NotDetermined {
        let reasons: Vec<&str> = fit.verdict.reasons().collect();
        return Err(CliError::NotDetermined(reasons.join("; ")));
    }
    Ok(())
}

fn estimator(args: &IdentifyArgs) -> Result<FamilyEstimator, CliError> {
    let usual = FamilyEstimator::default();
    let (nc, nd) = noise_orders(args)?;
    let typed = SearchOptions {
        method: args.search_method,
        max_iterations: args.max_iterations,
        tolerance: args.tolerance,
    };
    Ok(FamilyEstimator {
        forms: args.form.map_or(usual.forms, |form| vec![form]),
        neuromuscular: args.neuromuscular,
        prior: args.prior.as_deref().map_or(Ok(usual.prior), prior)?,
        delay_range_s: args.delay.unwrap_or(usual.delay_range_s),
        nc,
        nd,
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
        search: if typed == SearchOptions::default() {
            usual.search
        } else {
            typed
        },
        ..usual
    })
}

/// nc and nd from `--orders nc=..,nd=..`.
fn noise_orders(
    args: &IdentifyArgs,
) -> Result<(std::ops::RangeInclusive<usize>, std::ops::RangeInclusive<usize>), CliError> {
    let (mut nc, mut nd) = (0..=0, 0..=HIGHEST_NOISE_ORDER);
    for (name, value) in orders::parse_pairs(args.orders.as_deref().unwrap_or_default()).map_err(CliError::Usage)? {
        let range = orders::parse_range(&value).map_err(|e| CliError::Usage(format!("--orders {name}: {e}")))?;
        match name.as_str() {
            "nc" | "nd" if *range.end() > HIGHEST_NOISE_ORDER => {
                return Err(CliError::Usage(format!(
                    "--orders {name}: found {value}; expected orders of 0 to {HIGHEST_NOISE_ORDER}"
                )));
            }
            "nc" => nc = range,
            "nd" => nd = range,
            _ => {
                return Err(CliError::Usage(format!(
                    "--orders {name}: the operator of the family has the noise orders nc and nd alone; its form says the others"
                )));
            }
        }
    }
    // An ARMA model is searched over few autoregressive orders.
    if *nc.end() > 0 && args.orders.as_deref().is_none_or(|text| !text.contains("nd")) {
        nd = 0..=8;
    }
    Ok((nc, nd))
}

fn coordinate(name: &str) -> Result<Coordinate, CliError> {
    Coordinate::of_parameter(name).ok_or_else(|| {
        CliError::Usage(format!(
            "--individual: there is no parameter {name}; expected K, T_L, T_I, omega_nm, zeta_nm or tau_e"
        ))
    })
}

/// `population`, `none`, `NAME=CENTRE:SPREAD,...`, or the JSON of another fit.
pub(super) fn prior(text: &str) -> Result<OperatorPrior, CliError> {
    let usage = |reason: String| CliError::Usage(format!("--prior: {reason}"));
    if !is_fit_file(text) {
        return text.parse().map_err(|error: IdentError| usage(error.to_string()));
    }
    let found = read_fit(Path::new(text)).map_err(|error| match error {
        unreadable @ IoError::Unreadable { .. } => unreadable.into(),
        other => usage(other.to_string()),
    })?;
    let parameters = found.parameters.iter();
    let prior = OperatorPrior::of_parameters(parameters.map(|p| (p.name.as_str(), p.estimate, p.determined)), text)?;
    if prior.entries().is_empty() {
        return Err(usage(format!(
            "{text}: no parameter in it is determined and has an error"
        )));
    }
    Ok(prior)
}

fn settings(args: &IdentifyArgs, estimator: &FamilyEstimator) -> Vec<(String, String)> {
    let forms: Vec<&str> = estimator.forms.iter().map(|form| form.name()).collect();
    let range = |r: &std::ops::RangeInclusive<usize>| {
        if r.start() == r.end() {
            r.start().to_string()
        } else {
            format!("{}..{}", r.start(), r.end())
        }
    };
    let (low, high) = estimator.delay_range_s;
    let mut list = vec![
        ("structure".to_owned(), "grey-box".to_owned()),
        (
            "form".to_owned(),
            match args.form {
                Some(form) => form.to_string(),
                None => format!("auto of {}", forms.join(", ")),
            },
        ),
        (
            "neuromuscular".to_owned(),
            if estimator.neuromuscular { "yes" } else { "no" }.to_owned(),
        ),
        ("prior".to_owned(), estimator.prior.to_string()),
        (
            "noise orders".to_owned(),
            format!("nc={}, nd={}, by AIC", range(&estimator.nc), range(&estimator.nd)),
        ),
        ("delay in s".to_owned(), format!("{low}..{high}")),
        ("taken out of e and u".to_owned(), estimator.detrend.to_string()),
        ("variation from run to run".to_owned(), estimator.run_to_run.to_string()),
    ];
    if !args.individual.is_empty() {
        list.push(("individual".to_owned(), args.individual.join(", ")));
    }
    list
}

/// The fitted operator, by prediction error and at the lines.
fn curves(found: &Found<'_>, described: &Description) -> Vec<ModelCurve> {
    let operator = &found.fit.operator(0).operator;
    let half = 0.5 * found.fit.sample_time.s();
    let curve = |name: &str, operator: &hoid::model::FamilyOperator| {
        let turn = |omega: f64| hoid::model::Complex64::from_polar(1.0, -omega * half);
        ModelCurve::over(described, name, operator.tau_e_s() + half, |omega| {
            operator.response(omega) * turn(omega)
        })
    };
    let mut all = vec![curve("prediction error", operator)];
    if let Some(lines) = &found.fit.lines {
        all.push(curve("fit at the lines", &lines.operator));
    }
    if let Some(instrumental) = found.fit.instrumental.as_ref().filter(|i| i.termination.converged()) {
        all.push(curve("RIV-BJ", &instrumental.operator));
    }
    all
}

fn through_describing_function(found: &Found<'_>, described: &Description) -> Picture {
    Picture {
        svg: picture(found, described),
        caption:
            "The describing function at the lines of the excitation, with 95 % by its scatter, and the operator of the \
                  chosen form: by prediction error, fitted at the lines, and by instrumental variables (RIV-BJ) where these converge."
                .to_owned(),
    }
}

/// The operator through the describing function.
fn picture(found: &Found<'_>, described: &Description) -> String {
    let title = format!("{} through the describing function", found.fit.form);
    describing("describing", &title, described, &curves(found, described))
}

fn report(found: &Found<'_>, described: Option<&Description>, directory: &Path) -> Result<(), CliError> {
    let fit = &found.fit.operator(0).polynomial_fit;
    let title = match found.records {
        [only] => format!("Identification of {}", only.label()),
        all => format!("Identification of {} records", all.len()),
    };
    let mut facts = vec![
        ("hoid".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ("records".to_owned(), found.files.join(", ")),
    ];
    facts.extend(found.settings.iter().cloned());
    facts.extend(reading::accounts(found.files, found.accounts));
    let report = Report {
        title,
        settings: facts,
        models: vec![ModelSection {
            name: found.fit.title(),
            fit,
            records: found.records,
            candidates: None,
            truth: None,
            margins: found.margins(),
        }],
        notes: Vec::new(),
        answer: Some(found.answer_of_page()),
        pictures: described
            .map(|d| through_describing_function(found, d))
            .into_iter()
            .collect(),
    };
    let page = write_report(directory, &report.to_html()?)?;
    output::notice("", format!("report: {}", page.display()));
    Ok(())
}
