//! Execution of `hoid track`: reading, tracking, output.

use std::path::Path;

use hoid::io::{check_table_path, write_table};
use serde_json::Value;

use super::{methods, page, report};
use crate::{
    args::TrackArgs,
    commands::{figure, output_paths, paper_table, reading},
    error::CliError,
    json, output, recursion,
};

pub fn run(args: &TrackArgs) -> Result<(), CliError> {
    let record = match &args.record {
        Some(record) if !args.methods => record.as_path(),
        _ => return methods::list(args.show.json),
    };
    if let Some(path) = &args.out {
        check_table_path(path)?;
    }
    let given = |name: &str| {
        args.recursion
            .settings
            .given_settings()
            .any(|(option, _)| option == name)
    };
    if args.validate.is_some() && !args.update_covariance && given("covariance") {
        return Err(CliError::Usage(
            "--covariance gives the start covariance, and --validate chooses it; drop one, or add --update-covariance"
                .to_owned(),
        ));
    }
    if !args.batch.is_empty() && args.report.is_none() {
        return Err(CliError::Usage("--batch requires --report".to_owned()));
    }
    if let Some(path) = &args.picture.figure {
        figure::check(path)?;
    }
    let inputs: Vec<&Path> = [
        Some(record),
        args.validate.as_deref(),
        recursion::prior_file(&args.recursion),
    ]
    .into_iter()
    .flatten()
    .collect();
    paper_table::check(&args.show)?;
    output_paths::check(
        &inputs,
        &[
            args.out.as_deref(),
            args.picture.figure.as_deref(),
            args.show.table.as_deref(),
        ],
        &[args.report.as_deref()],
    )?;
    let tracking = recursion::tracking(args)?;
    let reading = reading::of(
        &args.read.with_one_input(),
        None,
        tracking.recursion.structure().has_input(),
    )?;
    let read = reading.read_file(record, reading::report_problems)?;
    reading::report_kept_rate(read.kept_rate_message(tracking.rate, tracking.recursion.counts_samples()));
    let other = args.validate.as_deref();
    let other = other
        .map(|path| reading.read_file(path, reading::report_problems))
        .transpose()?;
    let plan = tracking.plan(&read)?;
    let tracked = recursion::run_search(&plan, |each| tracking.run(read, other, each))?;
    let batch = report::batch_fits(args, &tracked)?;
    if let Some(path) = &args.out {
        write_table(path, &tracked.table())?;
    }
    if let Some(page) = report::write(args, &tracked, &batch)? {
        output::add_notice("", format!("report: {}", page.display()));
    }
    let out = args.out.as_ref().map(|path| path.display().to_string());
    paper_table::write(&args.show, || Ok(tracked.json()?))?;
    if args.show.json {
        let mut object = tracked.json()?;
        object.insert("trace".to_owned(), out.map_or(Value::Null, Value::String));
        json::print(&Value::Object(object))?;
    } else {
        output::show(&page::page(&tracked, out.as_deref(), args.show.verbose)?)?;
    }
    CliError::check_verdict(&tracked.verdict)
}
