//! The run of the command: start fit, recursion, files.

use std::path::Path;

use hoid::analysis::{Of, Recordings, Setting, findings_of_quality};
use hoid::io::{check_table_path, write_table};
use hoid::model::Record;
use hoid::track::{
    CovarianceUpdates, StartAt, TrackOptions, choose_covariance, track, track_validated, usual_start_span,
};

use super::{report, result::Tracked};
use crate::{
    args::TrackArgs,
    commands::{figure, places, reading},
    error::CliError,
    json, output, recursion,
    recursion::Plan,
};

pub fn run(args: &TrackArgs) -> Result<(), CliError> {
    check_table_path(&args.out)?;
    let given = |name: &str| args.recursion.settings.given().any(|(option, _)| option == name);
    if args.validate.is_some() && !args.update_covariance && given("covariance") {
        return Err(CliError::Usage(
            "--covariance gives the start covariance, and --validate chooses it; drop one, or add --update-covariance"
                .to_owned(),
        ));
    }
    if !args.batch.is_empty() && args.report.is_none() {
        return Err(CliError::Usage("--batch belongs to --report".to_owned()));
    }
    if let Some(path) = &args.picture.figure {
        figure::check(path)?;
    }
    let inputs: Vec<&Path> = [
        Some(args.record.as_path()),
        args.validate.as_deref(),
        recursion::prior_file(&args.recursion),
    ]
    .into_iter()
    .flatten()
    .collect();
    places::check(
        &inputs,
        &[Some(&args.out), args.picture.figure.as_deref()],
        &[args.report.as_deref()],
    )?;
    let with_input = recursion::structure(&args.recursion)?.has_input();
    let reading = reading::of(&args.read, None, with_input)?;
    let rate = args.read.prepare.rate.decimate;
    let read = reading.file(&args.record, reading::told)?;
    let counts_samples = recursion::counts_samples(&args.recursion)?;
    let read_ts = read.records[0].sample_time();
    reading::say_kept(read.kept_rate(rate, counts_samples));
    let Recordings { records, accounts, .. } = read.at_rate(rate, counts_samples)?;
    let (record, account) = (&records[0], &accounts[0]);
    // Rows as far apart as samples of the file were to be.
    let every = ((args.every as f64 * read_ts.s() / record.sample_time().s()).round() as usize).max(1);
    let every = if args.read.prepare.new_fs.is_some() {
        args.every
    } else {
        every
    };
    let plan = Plan::new(&args.recursion, record.sample_time())?;
    let span_s = start_span(args, &plan, record)?;
    let span = record.span(span_s.0, span_s.1);
    let (options, choice) = if plan.is_settled() {
        (plan.options().clone(), None)
    } else {
        plan.choose(span.as_ref().map_err(|e| e.clone())?)?
    };
    let start = match options.start {
        StartAt::Span(_) => StartAt::Span(Some(span_s)),
        other => other,
    };
    let options = TrackOptions {
        start,
        update_from_s: update_from(args, record)?,
        ..options
    };
    let validation = match &args.validate {
        Some(path) => Some((
            path.display().to_string(),
            reading
                .file(path, reading::told)?
                .at_rate(rate, counts_samples)?
                .records
                .swap_remove(0),
        )),
        None => None,
    };
    let mut covariance = None;
    let mut options = options;
    let trace = match &validation {
        Some((_, other)) if args.update_covariance => {
            track_validated(record, other, &options, &CovarianceUpdates::default(), every)?
        }
        Some((file, other)) => {
            let choice;
            (options, choice) = choose_covariance(record, other, &options)?;
            covariance = Some((file.clone(), choice));
            track(record, &options, every)?
        }
        None => track(record, &options, every)?,
    };
    let rows = averaged_rows(args, every, record)?;
    let trace = trace.moving_average(rows);

    let mut settings = plan.settings(&options, choice.as_ref());
    if let Some((file, choice)) = &covariance {
        let words = format!(
            "of {} values that whose trace explains most of {file} from {:.2} to {:.2} s, VAF {:.2} %",
            choice.candidates.len(),
            choice.span_s.0,
            choice.span_s.1,
            choice.vaf()
        );
        settings.push(Setting::new("covariance chosen", words));
    }
    if let (Some((file, _)), true) = (&validation, args.update_covariance) {
        let words = format!("by what the estimate explains of {file}, VAF");
        settings.push(Setting::new("covariance updated", words).given(true));
    }
    let words = match &options.start {
        _ if options.method.starts_itself() => options.start_in_words(),
        StartAt::Span(Some((from, to))) => format!("batch fit of {from:.2} to {to:.2} s"),
        StartAt::Span(None) => "batch fit of the first third".to_owned(),
        StartAt::Theta(_) => "given".to_owned(),
        StartAt::Nothing => "nothing".to_owned(),
    };
    let given = args.recursion.start.is_some() || args.start_span.is_some();
    settings.push(Setting::new("start", words).given(given));
    if trace.idle_s() > 0.0 {
        let words = format!("{:.2} s, in which neither e nor u moves", trace.idle_s());
        settings.push(Setting::new("idle head", words));
    }
    if options.method.smooths() {
        settings.push(Setting::new("estimate", "two-sided, of the whole record"));
    } else {
        let words = format!("{:.2} s", trace.updated_from_s());
        settings.push(Setting::new("estimate moves from", words).given(args.update_from.is_some()));
    }
    if rows > 1 {
        let lag = (rows - 1) as f64 / 2.0 * every as f64 * record.sample_time().s();
        settings.push(Setting::new("moving average", format!("{rows} rows, lags by {lag:.3} s")).given(true));
    }
    settings.extend(reading.settings(rate));
    settings.push(Setting::new("rows of the trace", format!("every {every} samples")).given(args.every != 1));

    let verdict = trace.verdict(record, choice.as_ref())?;
    let verdict = verdict.behind(findings_of_quality(account, record, Of::Person));
    let tracked = Tracked {
        verdict: &verdict,
        file: args.record.display().to_string(),
        span: span.ok().filter(|_| trace.start().is_some()),
        operators: trace.operators(),
        out: args.out.display().to_string(),
        record,
        account,
        trace: &trace,
        choice: choice.as_ref(),
        covariance: covariance.as_ref(),
        settings: &settings,
    };
    let batch = report::batch_fits(args, &tracked)?;
    write_table(&args.out, &tracked.table())?;
    if let Some(page) = report::write(args, &tracked, &batch)? {
        output::notice("", format!("report: {}", page.display()));
    }
    if args.show.json {
        json::print(&tracked.to_json()?)?;
    } else {
        output::show(&tracked.page(args.show.verbose)?)?;
    }
    CliError::of_verdict(&verdict)
}

/// The span of the start fit and of the search: as typed, else the first third behind the idle head.
fn start_span(args: &TrackArgs, plan: &Plan, record: &Record) -> Result<(f64, f64), CliError> {
    if args.start_span.is_some() && matches!(plan.options().start, StartAt::Theta(_)) {
        return Err(CliError::Usage(
            "--start-span is the span of the start fit, and --start gives the start itself; drop one".to_owned(),
        ));
    }
    if args.start_span.is_some() && plan.options().method.starts_itself() {
        return Err(CliError::Usage(format!(
            "--start-span is the span of a start fit, and {} has none; drop it, or name --method physical",
            plan.options().method
        )));
    }
    Ok(args.start_span.unwrap_or_else(|| usual_start_span(record)))
}

fn update_from(args: &TrackArgs, record: &Record) -> Result<Option<f64>, CliError> {
    let end = record.time_s(record.len());
    match args.update_from {
        Some(t) if t.is_nan() || t >= end => Err(CliError::Usage(format!(
            "--update-from {t}: the record ends at {end:.4} s; give a time before"
        ))),
        other => Ok(other),
    }
}

/// Rows of the moving average.
fn averaged_rows(args: &TrackArgs, every: usize, record: &Record) -> Result<usize, CliError> {
    let Some(length) = args.moving_average else {
        return Ok(1);
    };
    let row = every as f64 * record.sample_time().s();
    if !(length >= 0.0 && length <= record.len() as f64 * record.sample_time().s()) {
        return Err(CliError::Usage(format!(
            "--moving-average {length}: expected a length in s up to that of the record"
        )));
    }
    Ok((length / row).round().max(1.0) as usize)
}
