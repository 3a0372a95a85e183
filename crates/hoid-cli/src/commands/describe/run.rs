//! From records to a describing function: read, describe, draw.

use std::path::{Path, PathBuf};

use hoid::ident::frequency::{Description, DescriptionOptions, describe_runs};
use hoid::io::{Offset, Step};
use hoid::model::{Detrend, Record};
use hoid::report::figures::describing;

use super::form::Described;
use crate::{
    args::{DescribeArgs, ReadArgs},
    commands::{
        faults, figure, places,
        reading::{self, ReadAll},
    },
    error::CliError,
    json, output,
};

pub fn run(args: &DescribeArgs) -> Result<(), CliError> {
    if let Some(path) = &args.picture.figure {
        figure::check(path)?;
    }
    let inputs: Vec<&Path> = args.records.iter().map(PathBuf::as_path).collect();
    places::check(&inputs, &[args.picture.figure.as_deref()], &[])?;
    let (read, offsets) = without_offsets(&args.read);
    let ReadAll {
        files,
        records,
        accounts,
    } = faults::mended(
        reading::read_all(&args.records, &read, &args.mask, true)?,
        args.faults.faults,
    )?;
    let (late_samples, ts_s) = match records.first() {
        Some(record) => (offset_of_output(record, &offsets)?, record.sample_time().s()),
        None => (0.0, 1.0),
    };
    let ReadAll {
        files,
        records,
        accounts,
    } = reading::all_decimated(
        ReadAll {
            files,
            records,
            accounts,
        },
        &args.read,
        false,
    )?;
    // A ratio of samples knows no hold: what the input was moved for it is taken back.
    let moved_s = accounts
        .iter()
        .flat_map(|account| &account.steps)
        .find_map(|step| match step {
            Step::Rate { input_lead_s, .. } => Some(*input_lead_s),
            _ => None,
        });
    let offset_samples = match records.first() {
        Some(record) => (late_samples * ts_s + moved_s.unwrap_or(0.0)) / record.sample_time().s(),
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
    let mut found = describe_runs(&records, &options)?;
    found.verdict = faults::judged(found.verdict, &files, &accounts);
    let described = Described {
        files: &files,
        records: &records,
        accounts: &accounts,
        found: &found,
        settings: settings(args, late_samples, &found),
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

/// How to read without moving rows, and the offsets. A row that is cut would leave less than whole
/// periods, and of what is periodic an offset is a phase. With another sampling frequency, which the
/// offset comes before, it stays with the reading.
pub fn without_offsets(read: &ReadArgs) -> (ReadArgs, Vec<(String, Offset)>) {
    let mut read = read.clone();
    let offsets = if read.prepare.new_fs.is_none() {
        std::mem::take(&mut read.prepare.offset)
    } else {
        Vec::new()
    };
    (read, offsets)
}

/// By how many samples the output is later than the input. The offset of another channel turns its
/// own phase alone, which no average depends on.
pub fn offset_of_output(record: &Record, offsets: &[(String, Offset)]) -> Result<f64, CliError> {
    let names: Vec<&str> = record.channels().map(|c| c.name.as_str()).collect();
    let mut late = 0.0;
    for (name, offset) in reading::by_channel("--offset", offsets)? {
        let role = match name.as_str() {
            "e" => Some(0),
            "u" => Some(1),
            _ => None,
        };
        let Some(channel) = names.iter().position(|known| *known == name).or(role) else {
            return Err(CliError::Usage(format!(
                "--offset: there is no channel {name:?}; the record has {}, and e and u stand for input and output",
                names.join(", ")
            )));
        };
        let samples = match offset {
            Offset::Samples(samples) => samples,
            Offset::Seconds(seconds) => seconds / record.sample_time().s(),
        };
        match channel {
            0 => late -= samples,
            1 => late += samples,
            _ => {}
        }
    }
    Ok(late)
}

fn settings(args: &DescribeArgs, late_samples: f64, found: &Description) -> Vec<(String, String)> {
    let mut list = reading::settings(&args.read, true);
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
