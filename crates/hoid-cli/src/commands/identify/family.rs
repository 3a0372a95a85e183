//! `hoid identify` by default: the operator of a person, of the family of operators.

use std::path::Path;

use hoid::analysis::{Excitation, Identification, Identified, Reading, Recordings, prior_of_text};
use hoid::ident::{
    SearchOptions,
    family::{FamilyEstimator, HIGHEST_NOISE_ORDER},
    frequency::Description,
};
use hoid::model::{Detrend, operator_family::Coordinate};
use hoid::report::{
    ModelSection, Picture, Report,
    figures::{ModelCurve, describing},
    write_report,
};

use super::{family_form::Found, picture::of_polynomials};
use crate::{
    args::IdentifyArgs,
    commands::{figure, reading},
    error::CliError,
    json, orders, output,
};

pub fn run(args: &IdentifyArgs, reading: &Reading, read: Recordings) -> Result<(), CliError> {
    let identification = identification(args)?;
    // Read before anything is written: a bad validation file leaves nothing behind.
    let other = args.validate.as_deref();
    let other = other.map(|path| reading.file(path, reading::told)).transpose()?;
    let identified = output::watched("fitting", || identification.run(read))?;
    let validation = other.map(|other| identified.validated(other)).transpose()?;
    let Identified {
        fit,
        data,
        described,
        settings,
        ..
    } = identified;
    let found = Found {
        fit: &fit,
        files: &data.names,
        records: &data.records,
        accounts: &data.accounts,
        element: args.controlled_element.as_ref(),
        validation: validation.as_ref().map(|v| (v.name.as_str(), v.quality)),
        settings: &reading::rows(settings),
    };
    if let Some(path) = &args.picture.figure {
        let svg = match &described {
            Some(described) => picture(&found, described),
            None => of_polynomials(&fit.operator(0).polynomial_fit, &data.records, None),
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
    CliError::of_verdict(&fit.verdict)
}

fn identification(args: &IdentifyArgs) -> Result<Identification, CliError> {
    Ok(Identification {
        operator: estimator(args)?,
        excitation: Excitation::of_text(args.excitation.as_deref()),
        period_s: args.period,
        faults: args.faults.faults,
        rate: args.read.prepare.rate.decimate,
        controlled_element: args.controlled_element.clone(),
    })
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
        prior: args.prior.as_deref().map_or(Ok(usual.prior), prior_of_text)?,
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
