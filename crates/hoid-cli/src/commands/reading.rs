//! Reads recordings according to the reading options, and prints notes about the files.

use std::{collections::BTreeMap, path::Path};

use hoid::analysis::Reading;
use hoid::io::{NewRate, Preparation, ReadOptions, ReadRecord, Repair};

use crate::{
    args::{MaskArgs, ReadArgs},
    error::CliError,
    output,
};

/// Converts the reading options of the command line.
pub fn of(args: &ReadArgs, mask: Option<&MaskArgs>, with_input: bool) -> Result<Reading, CliError> {
    let default = Reading::default();
    Ok(Reading {
        options: options(args, with_input)?,
        preparation: preparation(args)?,
        mask: mask.map_or_else(Vec::new, |args| args.mask.clone()),
        shortest_s: mask.map_or(default.shortest_s, |args| args.shortest),
    })
}

/// Reports the omitted parts of a file and its problems.
pub fn report_problems(path: &Path, read: &ReadRecord) {
    let file = path.display().to_string();
    for note in &read.notes {
        output::add_notice(&file, note.to_string());
    }
    for issue in &read.quality_issues {
        output::add_warning(&file, &issue.to_string());
    }
}

/// Reports that a high sampling frequency was kept, if it was.
pub fn report_kept_rate(words: Option<String>) {
    if let Some(words) = words {
        output::add_notice("", words);
    }
}

fn options(args: &ReadArgs, with_input: bool) -> Result<ReadOptions, CliError> {
    let column = |text: &str| text.parse().map_err(CliError::from);
    Ok(ReadOptions {
        input: match args.inputs.as_slice() {
            [input] if with_input => Some(column(input)?),
            [_] => None,
            _ => {
                return Err(CliError::Usage(
                    "give only one --input here; several inputs require hoid identify, or hoid track with the method adaptive, rls or rpem"
                        .to_owned(),
                ));
            }
        },
        output: column(&args.output)?,
        time: args.clock.time.clone(),
        trial: args.clock.trial.clone(),
        sampling_hz: args.clock.fs,
        span_s: (args.from, args.to),
        sparse: values_by_channel("--sparse", &args.sparse)?,
        columns: args.kept_columns(),
        repair: Repair {
            resample: args.resample,
            fill: args.fill,
        },
    })
}

fn preparation(args: &ReadArgs) -> Result<Preparation, CliError> {
    let prepare = &args.prepare;
    Ok(Preparation {
        units: values_by_channel("--unit", &prepare.unit)?,
        scale: values_by_channel("--scale", &prepare.scale)?,
        offset: values_by_channel("--offset", &prepare.offset)?,
        // Decimation is done after the search for faults, since its filter would hide faults.
        rate: prepare.new_fs.map_or(NewRate::Kept, NewRate::Hz),
        run_in_s: prepare.run_in.unwrap_or(0.0),
        detrend: args.detrend,
        drop_repeated: prepare.drop_repeated,
    })
}

/// Returns the values of an option by channel; a channel that is given twice is an error.
pub fn values_by_channel<T: Clone>(option: &str, typed: &[(String, T)]) -> Result<BTreeMap<String, T>, CliError> {
    let mut all = BTreeMap::new();
    for (name, value) in typed {
        if all.insert(name.clone(), value.clone()).is_some() {
            return Err(CliError::Usage(format!(
                "{option} names {name} twice; give each channel once"
            )));
        }
    }
    Ok(all)
}
