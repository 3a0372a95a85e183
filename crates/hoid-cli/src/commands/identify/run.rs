//! Execution of `hoid identify`: reading, fit, verdict, output.

use std::path::{Path, PathBuf};

use hoid::analysis::{
    Excitation, IdentifiedModel, PolynomialFit, Recordings, ResolvedRequest,
    json::{JsonFit, PolynomialResult},
};
use hoid::ident::{
    Choice, Fit, GreyBoxFit,
    frequency::Description,
    validation::{nrmse_fit, vaf},
};
use hoid::model::{GainUnit, Record};
use hoid::report::{FitSummary, ModelSection, Report, known_operator, model_figure, model_picture, write_report};
use serde_json::Value;

use super::{axes, family, request, several_inputs, sigmoid};
use crate::{
    args::IdentifyArgs,
    commands::{figure, output_paths, paper_table, reading},
    error::CliError,
    family_operator, json, output, text,
};

pub fn run(args: &IdentifyArgs) -> Result<(), CliError> {
    if let Some(structure) = several_inputs::structure(args) {
        check_paths(args)?;
        return several_inputs::run(args, structure);
    }
    if !args.pair.is_empty() {
        return axes::run(args);
    }
    let asked = request::resolve_request(args)?;
    check_paths(args)?;
    paper_table::check(&args.show)?;
    if let Some(path) = &args.picture.figure {
        figure::check(path)?;
    }
    let first = args.read.with_one_input();
    let reading = reading::of(&first, Some(&args.mask), asked.has_input())?;
    let read = reading.read_files(&args.records, reading::report_problems)?;
    let (rate, counts) = (args.read.prepare.rate.decimate, asked.counts_samples());
    reading::report_kept_rate(read.kept_rate_message(rate, counts));
    // The validation file is read before anything is written, so an invalid file leaves no output.
    let other = args.validate.as_deref();
    let other = other
        .map(|path| reading.read_file(path, reading::report_problems))
        .transpose()?;
    match asked {
        ResolvedRequest::Operator(identification) => family::run(args, &identification, read, other),
        ResolvedRequest::Change(identification) => sigmoid::run(args, &identification, read),
        ResolvedRequest::Remnant(identification) => {
            let found = output::run_with_spinner("fitting", || identification.run(read))?;
            show(
                args,
                &found,
                found.fit.polynomial_fit(0),
                (None, Some(&found.fit)),
                other,
            )
        }
        ResolvedRequest::Polynomials(identification) => {
            let found = output::run_with_spinner("fitting", || identification.run(read))?;
            let PolynomialFit { fit, choice } = &found.fit;
            show(args, &found, fit, (choice.as_ref(), None), other)
        }
    }
}

/// Writes and prints the fit of a polynomial model.
fn show<F: JsonFit>(
    args: &IdentifyArgs,
    found: &IdentifiedModel<F>,
    fit: &Fit,
    (choice, grey_box): (Option<&Choice>, Option<&GreyBoxFit>),
    other: Option<Recordings>,
) -> Result<(), CliError> {
    let (data, verdict) = (&found.data, &found.verdict);
    let validation = other.map(|other| found.validated(fit, other)).transpose()?;
    let (records, with_input) = (&data.records, fit.model().structure().has_input());
    let mut answer = PolynomialResult::of(found, fit)?;
    (answer.choice, answer.grey_box) = (choice, grey_box);
    if let Some(found) = &mut answer.remnant {
        *found = fit.remnant(args.remnant_discretisation);
    }
    answer.ahead = args.horizon.map(|k| prediction_quality(fit, records, k)).transpose()?;
    answer.validation = validation.as_ref().map(|v| (v.name.as_str(), v.quality));
    let pictured = with_input && (args.report.is_some() || args.picture.figure.is_some());
    let described = pictured.then(|| describing_function(args, data)).flatten();
    if let Some(path) = &args.picture.figure {
        figure::write(
            path,
            &model_figure(fit, records, described.as_ref()),
            args.picture.width,
        )?;
    }
    if let Some(directory) = &args.report {
        let report = Report {
            models: vec![ModelSection {
                name: fit.title(),
                fit,
                records,
                candidates: choice,
                truth: known_operator(records),
                margins: answer.margins,
            }],
            fit_summary: Some(FitSummary {
                verdict: verdict.clone(),
                sentence: sentence(&answer),
                parameters: Vec::new(),
            }),
            pictures: model_picture(fit, records, described.as_ref()).into_iter().collect(),
            ..Report::from_identified(found)
        };
        let page = write_report(directory, &report.to_html()?)?;
        output::add_notice("", format!("report: {}", page.display()));
    }
    paper_table::write(&args.show, || Ok(answer.object()))?;
    if args.show.json {
        json::print(&Value::Object(found.complete(answer.object())))?;
    } else {
        output::show(&page(&answer, args.show.verbose))?;
    }
    CliError::check_verdict(verdict)
}

/// Returns the describing function of the records; `None` if they contain no recorded excitation or the computation
/// fails.
fn describing_function(args: &IdentifyArgs, data: &Recordings) -> Option<Description> {
    data.describe(&Excitation::default(), None, args.faults.faults)
        .ok()
        .flatten()
}

/// Checks that outputs do not overwrite inputs, which may include the file of `--prior`.
fn check_paths(args: &IdentifyArgs) -> Result<(), CliError> {
    let mut inputs: Vec<&Path> = args.records.iter().map(PathBuf::as_path).collect();
    inputs.extend(args.validate.as_deref());
    inputs.extend(args.options.text("prior").map(Path::new));
    output_paths::check(
        &inputs,
        &[
            args.picture.figure.as_deref(),
            args.trace.as_deref(),
            args.show.table.as_deref(),
        ],
        &[args.report.as_deref()],
    )
}

/// Returns k with the VAF and NRMSE of the prediction k samples ahead, over all records together.
fn prediction_quality(fit: &Fit, records: &[Record], k: usize) -> Result<(usize, f64, f64), CliError> {
    let (mut measured, mut predicted) = (Vec::new(), Vec::new());
    for record in records {
        let series = fit.predict_ahead(record, k)?;
        measured.extend_from_slice(&record.output()[series.first..]);
        predicted.extend(series.values);
    }
    Ok((k, vaf(&measured, &predicted), nrmse_fit(&measured, &predicted)))
}

/// Returns the result as a sentence.
fn sentence(found: &PolynomialResult<'_>) -> Option<String> {
    let of = found.operator.as_ref().ok().filter(|_| found.has_operator());
    let named = of.iter().flat_map(|o| o.rows()).map(|(name, _, e)| (name, e.value));
    let margins = found.margins.as_ref();
    hoid::report::sentence(
        named,
        margins.and_then(|m| m.crossover_rad_s),
        margins.and_then(|m| m.phase_margin_deg),
    )
}

/// Returns the page; `verbose` adds details.
fn page(found: &PolynomialResult<'_>, verbose: bool) -> String {
    let mut page = summary(found);
    if verbose {
        page.push_str(&details(found));
    } else {
        page.push_str(text::MORE_HINT);
    }
    page
}

/// Returns the verdict, the parameters with their intervals, the fit, and the records that were analysed.
fn summary(found: &PolynomialResult<'_>) -> String {
    let fit = found.fit;
    let gain = found.records.first().map(GainUnit::of).unwrap_or_default();
    let mut page = text::verdict(found.verdict);
    page.push_str(&format!("{}\n", fit.title()));
    if let Some(words) = sentence(found) {
        page.push_str(&format!("{words}\n"));
    }
    let operator = match &found.family {
        _ if !fit.model().structure().has_input() => None,
        Some(family) => Some(family_operator::to_text(family, &gain)),
        None => Some(text::operator(&found.operator, &gain)),
    };
    // If there is no operator, the coefficients are the result.
    if !found.has_operator() {
        page.push_str(&text::coefficients(fit));
    }
    page.push_str(&operator.unwrap_or_default());
    page.push_str(text::instability(fit));
    if let Some(grey_box) = found.grey_box {
        page.push_str(&text::other_records(grey_box, found.files, &gain));
    }
    if let Some(remnant) = &found.remnant {
        page.push_str(&text::remnant(remnant));
    }
    if let Some(choice) = found.choice {
        page.push_str(&text::delay(choice));
    }
    if let Some(m) = &found.margins {
        let whose = match found.grey_box {
            Some(_) if found.files.len() > 1 => format!(" (operator of {})", found.files[0]),
            _ => String::new(),
        };
        page.push_str(&format!(
            "Open loop with the given controlled element{whose}: {}",
            text::margins(m)
        ));
    }
    page.push_str(&text::fit_line(fit, &found.quality));
    if let Some((k, vaf, nrmse)) = found.ahead {
        page.push_str(&format!(
            "Prediction {k} samples ahead: VAF {vaf:.2} %, NRMSE fit {nrmse:.2} %.\n"
        ));
    }
    if let Some((file, q)) = &found.validation {
        page.push_str(&format!(
            "On {file}: VAF simulation {:.2} %, prediction {:.2} %; NRMSE fit simulation {:.2} %, prediction {:.2} %.\n",
            q.vaf_simulation, q.vaf_prediction, q.nrmse_simulation, q.nrmse_prediction
        ));
    }
    page.push_str(&text::records(found.files, found.records, found.accounts, false));
    page
}

/// Returns the candidates tried, coefficients, roots, residual tests and settings.
fn details(found: &PolynomialResult<'_>) -> String {
    let fit = found.fit;
    let mut page = "\n".to_owned();
    if let Some(choice) = found.choice {
        page.push_str(&text::candidates(choice));
        page.push('\n');
    }
    if let Some(grey_box) = found.grey_box {
        page.push_str(&text::remnant_orders(grey_box));
    }
    if found.has_operator() {
        page.push_str(&text::coefficients(fit));
    }
    page.push_str(&text::search(fit));
    page.push_str(&text::quality(fit, &found.quality));
    page.push('\n');
    page.push_str(&text::roots(fit));
    // Residuals of the size of rounding errors contain no information.
    if fit.covariance().is_some() {
        page.push_str(&text::residual_tests(found.files, &found.validations));
    }
    page.push_str(&text::output_levels(found.files, found.accounts));
    page.push_str(&text::settings(found.settings));
    page
}
