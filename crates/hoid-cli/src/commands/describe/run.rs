//! From records to a describing function: read, describe, draw.

use std::path::{Path, PathBuf};

use hoid::analysis::{Reading, late_samples, without_offsets};
use hoid::ident::frequency::{Description, DescriptionOptions, describe_runs};
use hoid::io::Step;
use hoid::model::Detrend;
use hoid::report::figures::describing;

use super::form::Described;
use crate::{
    args::DescribeArgs,
    commands::{figure, places, reading},
    error::CliError,
    json, output,
};

pub fn run(args: &DescribeArgs) -> Result<(), CliError> {
    if let Some(path) = &args.picture.figure {
        figure::check(path)?;
    }
    let inputs: Vec<&Path> = args.records.iter().map(PathBuf::as_path).collect();
    places::check(&inputs, &[args.picture.figure.as_deref()], &[])?;
    let (reading, offsets) = without_offsets(&reading::of(&args.read, Some(&args.mask), true)?);
    let read = reading.files(&args.records, reading::told)?;
    let read = read.repaired(args.faults.faults)?;
    let (late, ts_s) = match read.records.first() {
        Some(record) => (late_samples(record, &offsets)?, record.sample_time().s()),
        None => (0.0, 1.0),
    };
    let data = read.at_rate(args.read.prepare.rate.decimate, false)?;
    // A ratio of samples knows no hold: what the input was moved for it is taken back.
    let moved_s = data
        .accounts
        .iter()
        .flat_map(|account| &account.steps)
        .find_map(|step| match step {
            Step::Rate { input_lead_s, .. } => Some(*input_lead_s),
            _ => None,
        });
    let offset_samples = match data.records.first() {
        Some(record) => (late * ts_s + moved_s.unwrap_or(0.0)) / record.sample_time().s(),
        None => 0.0,
    };
    let options = DescriptionOptions {
        excitation: args.excitation.clone(),
        lines_rad_s: args.lines.clone(),
        period_s: args.period,
        controlled_element: args.controlled_element.clone(),
        offset_samples,
        // It is part of reading.
        detrend: Detrend::None,
        ..DescriptionOptions::default()
    };
    let mut found = describe_runs(&data.records, &options)?;
    found.verdict = data.judged(found.verdict);
    let described = Described {
        files: &data.names,
        records: &data.records,
        accounts: &data.accounts,
        found: &found,
        settings: settings(args, &reading, late, &found),
        element: args.controlled_element.as_ref(),
    };
    if let Some(path) = &args.picture.figure {
        figure::write(
            path,
            &describing("describing", &described.title(), &found, &[]),
            args.picture.width,
        )?;
    }
    if args.show.json {
        json::print(&described.to_json())?;
    } else {
        output::show(&described.page(args.show.verbose))?;
    }
    CliError::of_verdict(&found.verdict)
}

fn settings(args: &DescribeArgs, reading: &Reading, late_samples: f64, found: &Description) -> Vec<(String, String)> {
    let mut list = reading::rows(reading.settings(args.read.prepare.rate.decimate));
    if late_samples != 0.0 {
        list.push((
            "offset of the output".to_owned(),
            format!("{late_samples} samples, as a phase"),
        ));
    }
    list.push(("faults".to_owned(), args.faults.faults.to_string()));
    if !args.mask.mask.is_empty() {
        let kinds: Vec<&str> = args.mask.mask.iter().map(|kind| kind.name()).collect();
        list.push(("masked".to_owned(), kinds.join(", ")));
    }
    let lines = match (&args.lines, &found.channel) {
        (Some(_), None) => "given".to_owned(),
        (Some(_), Some(channel)) => format!("given, in {channel}"),
        (None, channel) => format!("found in {}", channel.as_deref().unwrap_or("nothing")),
    };
    list.extend([
        ("lines".to_owned(), lines),
        (
            "average".to_owned(),
            match &found.channel {
                Some(channel) => format!("cross spectra with {channel}"),
                None => "ratios of u and e".to_owned(),
            },
        ),
        (
            "delay taken out between lines".to_owned(),
            format!("{:.3} s", found.delay_s),
        ),
    ]);
    list
}
