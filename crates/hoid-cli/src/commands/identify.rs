//! `hoid identify`: records to a model and the operator's parameters.

use std::path::{Path, PathBuf};

use hoid_ident::{
    Choice, Estimator, Fit, Loss, MarginEstimates, SearchOptions,
    order_search::{Criterion, OrderRanges, choose_orders_with},
    validation::{nrmse_fit, vaf},
};
use hoid_io::{ReadOptions, Repair, make_directory, read_record, write_atomically};
use hoid_model::{ContinuousTransferFunction, Detrend, Record, Structure, margins::MANUAL_CONTROL_RANGE_RAD_S};
use hoid_report::{ModelSection, Report, numbers};

use crate::{
    args::{IdentifyArgs, ReadArgs},
    error::CliError,
    json::{self, Identified},
    orders, output, text,
};

pub fn run(args: &IdentifyArgs) -> Result<(), CliError> {
    let structure = Structure::from(args.structure);
    let read = |path: &PathBuf| read(path, &args.read, structure.has_input());
    let records = args.records.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let ranges = orders::ranges(
        structure,
        args.orders.as_deref(),
        args.nk.as_ref(),
        records[0].sample_time(),
    )?;
    let (fit, choice) = fit(args, structure, &ranges, &records)?;
    // Read before anything is written: a bad validation file leaves nothing behind.
    let validation = match &args.validate {
        Some(path) => Some((path.display().to_string(), fit.quality(&[read(path)?])?)),
        None => None,
    };
    let files: Vec<String> = args.records.iter().map(|p| p.display().to_string()).collect();
    let settings = settings(args, structure, &ranges);
    let operator = fit.operator();
    let remnant = (fit.orders().nd > 0).then(|| fit.remnant(args.remnant_discretisation.into()));
    let margins = args
        .controlled_element
        .as_ref()
        .map(|element| loop_margins(&fit, element));
    let validations = records.iter().map(|r| fit.validate(r)).collect::<Result<Vec<_>, _>>()?;
    let ahead = args.horizon.map(|k| prediction_ahead(&fit, &records, k)).transpose()?;
    let identified = Identified {
        files: &files,
        records: &records,
        quality: fit.quality(&records)?,
        fit: &fit,
        choice: choice.as_ref(),
        operator: &operator,
        remnant: remnant.as_ref(),
        margins: margins.as_ref(),
        validations: &validations,
        ahead,
        validation: validation.as_ref().map(|(file, q)| (file.as_str(), *q)),
        settings: &settings,
    };
    if let Some(directory) = &args.report {
        let title = match records.as_slice() {
            [only] => format!("Identification of {}", only.label()),
            all => format!("Identification of {} records", all.len()),
        };
        let mut facts = vec![
            ("hoid".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
            ("records".to_owned(), files.join(", ")),
        ];
        facts.extend(settings.iter().cloned());
        let report = Report {
            title,
            settings: facts,
            models: vec![ModelSection {
                name: format!("{}({})", fit.model().structure(), fit.orders()),
                fit: &fit,
                records: &records,
                candidates: choice.as_ref(),
                truth: super::known_operator(&records),
                margins,
            }],
            notes: Vec::new(),
        };
        let page = write_report(directory, &report)?;
        output::complain(&format!("report: {}", page.display()));
    }
    if args.json {
        json::print(&identified.to_json());
    } else {
        output::print(&page(&identified));
    }
    Ok(())
}

/// Reads a record as the options say; what was repaired or left out goes to standard error.
fn read(path: &Path, args: &ReadArgs, with_input: bool) -> Result<Record, CliError> {
    let column = |text: &str| text.parse().map_err(CliError::from);
    let options = ReadOptions {
        input: if with_input { Some(column(&args.input)?) } else { None },
        output: column(&args.output)?,
        sampling_hz: args.fs,
        span_s: (args.from, args.to),
        repair: Repair {
            resample: args.resample,
            fill: args.fill,
        },
    };
    let read = read_record(path, &options)?;
    for note in &read.notes {
        output::complain(&format!("{}: {note}", path.display()));
    }
    Ok(read.record.detrended(Detrend::from(args.detrend)))
}

fn fit(
    args: &IdentifyArgs,
    structure: Structure,
    ranges: &OrderRanges,
    records: &[Record],
) -> Result<(Fit, Option<Choice>), CliError> {
    let combinations = ranges.combinations()?;
    let mut estimator = Estimator {
        initial_state: args.initial_state.into(),
        search: SearchOptions {
            method: args.search_method.into(),
            max_iterations: args.max_iterations,
            tolerance: args.tolerance,
        },
        constraints: orders::constraints(args.fix.as_deref(), args.bound.as_deref())?,
        priors: orders::priors(args.prior.as_deref())?,
        loss: args
            .robust
            .map_or(Loss::Quadratic, |threshold| Loss::Huber { threshold }),
        focus: args.focus.into(),
        stable: args.stable,
        ..Estimator::new(structure, combinations[0])
    };
    if let [orders] = combinations.as_slice() {
        estimator.start = args
            .start
            .as_deref()
            .map(|text| orders::theta(orders, text))
            .transpose()?;
        return Ok((estimator.fit(records)?, None));
    }
    if args.start.is_some() {
        return Err(CliError::Usage(
            "--start belongs to one model, but a range of orders or delays is searched; give --nk and --orders as single \
             numbers"
                .to_owned(),
        ));
    }
    let bar = output::progress(combinations.len());
    let choice = choose_orders_with(&estimator, ranges, Criterion::from(args.criterion), records, &|| {
        bar.inc(1)
    });
    bar.finish_and_clear();
    let choice = choice?;
    Ok((choice.fit.clone(), Some(choice)))
}

/// VAF and NRMSE of the prediction k samples ahead, over all records together.
fn prediction_ahead(fit: &Fit, records: &[Record], k: usize) -> Result<(usize, f64, f64), CliError> {
    let (mut measured, mut predicted) = (Vec::new(), Vec::new());
    for record in records {
        let series = fit.predict_ahead(record, k)?;
        measured.extend_from_slice(&record.output()[series.first..]);
        predicted.extend(series.values);
    }
    Ok((k, vaf(&measured, &predicted), nrmse_fit(&measured, &predicted)))
}

fn loop_margins(fit: &Fit, element: &ContinuousTransferFunction) -> MarginEstimates {
    let (low, high) = MANUAL_CONTROL_RANGE_RAD_S;
    // The sampled model says nothing above half the sampling frequency.
    let high = high.min(fit.model().sample_time().nyquist_rad_s());
    fit.margins(|omega| element.response(omega), (low, high))
}

/// Every option that shaped the result, defaults included.
fn settings(args: &IdentifyArgs, structure: Structure, ranges: &OrderRanges) -> Vec<(String, String)> {
    let read = &args.read;
    let or_all = |bound: Option<f64>, all: &str| bound.map_or(all.to_owned(), |v| v.to_string());
    let mut list = vec![
        ("structure".to_owned(), structure.name().to_owned()),
        ("orders".to_owned(), ranges.to_string()),
        ("criterion".to_owned(), format!("{:?}", args.criterion).to_lowercase()),
        (
            "initial state".to_owned(),
            format!("{:?}", args.initial_state).to_lowercase(),
        ),
        ("input".to_owned(), read.input.clone()),
        ("output".to_owned(), read.output.clone()),
        (
            "sampling".to_owned(),
            read.fs.map_or("column t".to_owned(), |fs| format!("{fs} Hz")),
        ),
        (
            "span in s".to_owned(),
            format!("{} to {}", or_all(read.from, "start"), or_all(read.to, "end")),
        ),
        ("detrend".to_owned(), format!("{:?}", read.detrend).to_lowercase()),
        ("focus".to_owned(), format!("{:?}", args.focus).to_lowercase()),
        ("start".to_owned(), args.start.clone().unwrap_or("own".to_owned())),
        (
            "search".to_owned(),
            format!(
                "{}, relative tolerance {}",
                format!("{:?}", args.search_method).to_lowercase(),
                args.tolerance
            ),
        ),
        ("largest number of steps".to_owned(), args.max_iterations.to_string()),
    ];
    let given = [("fixed", &args.fix), ("bounds", &args.bound), ("prior", &args.prior)];
    for (name, text) in given {
        if let Some(text) = text {
            list.push((name.to_owned(), text.clone()));
        }
    }
    if let Some(threshold) = args.robust {
        list.push((
            "robust loss".to_owned(),
            format!("Huber, {threshold} standard deviations"),
        ));
    }
    if args.stable {
        list.push(("stable models only".to_owned(), "yes".to_owned()));
    }
    if read.resample || read.fill {
        list.push((
            "repair".to_owned(),
            format!("resample {}, fill {}", read.resample, read.fill),
        ));
    }
    if let Some(h) = &args.controlled_element {
        list.push((
            "controlled element".to_owned(),
            format!("{:?} / {:?}", h.num(), h.den()),
        ));
    }
    list
}

fn page(found: &Identified<'_>) -> String {
    let fit = found.fit;
    let mut page = String::new();
    for (file, record) in found.files.iter().zip(found.records) {
        page.push_str(&format!(
            "{file}: {} samples of {} s from t = {:.4} s\n",
            record.len(),
            numbers::plain(record.sample_time().s()),
            record.time_s(0)
        ));
    }
    page.push('\n');
    if let Some(choice) = found.choice {
        page.push_str(&text::candidates(choice));
        page.push('\n');
    }
    page.push_str(&text::model(fit));
    page.push_str(&text::quality(fit, &found.quality));
    page.push('\n');
    page.push_str(&text::operator(found.operator));
    if let Some(remnant) = found.remnant {
        page.push_str(&text::remnant(remnant));
    }
    if let Some(m) = found.margins {
        page.push_str(&format!(
            "Open loop with the given controlled element: {}",
            text::margins(m)
        ));
    }
    page.push('\n');
    page.push_str(&text::roots(fit));
    for (file, v) in found.files.iter().zip(found.validations) {
        let tests = text::residual_tests(v);
        let of = if found.files.len() > 1 {
            format!("{file}: ")
        } else {
            String::new()
        };
        page.push_str(&format!("{of}{tests}"));
    }
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
    let defaults: Vec<String> = found.settings.iter().map(|(k, v)| format!("{k}: {v}")).collect();
    page.push_str(&format!("\nSettings: {}.\n", defaults.join("; ")));
    page
}

/// Writes `report.html` into a directory, which is made if it is not there.
pub fn write_report(directory: &Path, report: &Report<'_>) -> Result<PathBuf, CliError> {
    let html = report.to_html()?;
    make_directory(directory)?;
    let path = directory.join("report.html");
    write_atomically(&path, |out| out.write_all(html.as_bytes()))?;
    Ok(path)
}
