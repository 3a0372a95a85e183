//! Reading records as `identify` and `track` do, with the account of what was done to them.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use hoid::io::{
    NewRate, Preparation, QualityIssue, ReadOptions, ReadRecord, Repair, Step, read_prepared, read_segments,
};
use hoid::model::{Decimation, Fault, Finding, Record, SampleTime, uncertainty::Estimate};

use crate::{
    args::{MaskArgs, ReadArgs},
    error::CliError,
    output,
};

/// What was done to a record, and what is wrong with the sampling of its file.
#[derive(Debug, Clone, Default)]
pub struct Account {
    pub steps: Vec<Step>,
    pub quality_issues: Vec<QualityIssue>,
    /// Faults that were looked for, and what was done about them.
    pub faults: Vec<Fault>,
    /// What they say of any result.
    pub findings: Vec<Finding>,
    /// The constant of u that was estimated with the fit.
    pub level: Option<Estimate>,
}

/// Records with the files that they come from; a file that is cut gives several.
#[derive(Debug, Default)]
pub struct ReadAll {
    pub files: Vec<String>,
    pub records: Vec<Record>,
    pub accounts: Vec<Account>,
}

/// Reads a record as the options say; what was left out and what is wrong goes to standard error.
///
/// # Errors
/// Those of reading, and [`CliError::Usage`].
pub fn read(path: &Path, args: &ReadArgs, with_input: bool) -> Result<(Record, Account), CliError> {
    let read = read_prepared(path, &options(args, with_input)?, &preparation(args)?)?;
    Ok(with_account(path, read))
}

/// As [`read`], for the segments between what is masked.
///
/// # Errors
/// As [`read`].
pub fn read_all(paths: &[PathBuf], args: &ReadArgs, mask: &MaskArgs, with_input: bool) -> Result<ReadAll, CliError> {
    read_with(paths, args, mask, with_input, with_account)
}

/// The same records again, read another way: what is wrong with them has been said.
///
/// # Errors
/// As [`read`].
pub fn read_again(paths: &[PathBuf], args: &ReadArgs, mask: &MaskArgs) -> Result<Vec<Record>, CliError> {
    let silent = |_: &Path, read: ReadRecord| (read.record, Account::default());
    Ok(read_with(paths, args, mask, true, silent)?.records)
}

fn read_with(
    paths: &[PathBuf],
    args: &ReadArgs,
    mask: &MaskArgs,
    with_input: bool,
    with_account: impl Fn(&Path, ReadRecord) -> (Record, Account),
) -> Result<ReadAll, CliError> {
    let (options, preparation) = (options(args, with_input)?, preparation(args)?);
    let mut all = ReadAll::default();
    for path in paths {
        for read in read_segments(path, &options, &preparation, &mask.mask, mask.shortest)? {
            let (record, account) = with_account(path, read);
            // The label of a segment ends in its span.
            let span = record.label().rfind(" (").filter(|_| !mask.mask.is_empty());
            let span = span.map_or("", |at| &record.label()[at..]);
            all.files.push(format!("{}{span}", path.display()));
            all.records.push(record);
            all.accounts.push(account);
        }
    }
    Ok(all)
}

fn with_account(path: &Path, read: ReadRecord) -> (Record, Account) {
    let file = path.display().to_string();
    for note in &read.notes {
        output::notice(&file, note.to_string());
    }
    for issue in &read.quality_issues {
        output::warning(&file, &issue.to_string());
    }
    let account = Account {
        steps: read.steps,
        quality_issues: read.quality_issues,
        ..Account::default()
    };
    (read.record, account)
}

fn options(args: &ReadArgs, with_input: bool) -> Result<ReadOptions, CliError> {
    let column = |text: &str| text.parse().map_err(CliError::from);
    Ok(ReadOptions {
        input: if with_input { Some(column(&args.input)?) } else { None },
        output: column(&args.output)?,
        sampling_hz: args.fs,
        span_s: (args.from, args.to),
        repair: Repair {
            resample: args.resample,
            fill: args.fill,
        },
    })
}

fn preparation(args: &ReadArgs) -> Result<Preparation, CliError> {
    let prepare = &args.prepare;
    Ok(Preparation {
        units: by_channel("--unit", &prepare.unit)?,
        scale: by_channel("--scale", &prepare.scale)?,
        offset: by_channel("--offset", &prepare.offset)?,
        // Decimation comes behind the search for faults, which a filter would hide.
        rate: prepare.new_fs.map_or(NewRate::Kept, NewRate::Hz),
        run_in_s: prepare.run_in.unwrap_or(0.0),
        detrend: args.detrend,
        drop_repeated: prepare.drop_repeated,
    })
}

/// A record at the rate at which it is used, and what was done; an estimator that counts samples takes
/// them as they are unless a factor was typed, which is said once of a high rate.
///
/// # Errors
/// Those of the decimation.
pub fn decimated(record: Record, args: &ReadArgs, counts_samples: bool) -> Result<(Record, Option<Step>), CliError> {
    if args.prepare.new_fs.is_some() {
        return Ok((record, None));
    }
    let (record, done) = args.prepare.rate.of(counts_samples).of(record)?;
    Ok((record, done.map(Step::from)))
}

/// As [`decimated`], for all records.
///
/// # Errors
/// As [`decimated`].
pub fn all_decimated(read: ReadAll, args: &ReadArgs, counts_samples: bool) -> Result<ReadAll, CliError> {
    if let Some(record) = read.records.first() {
        say_kept(record.sample_time(), args, counts_samples);
    }
    let mut all = ReadAll {
        files: read.files,
        ..ReadAll::default()
    };
    for (record, mut account) in read.records.into_iter().zip(read.accounts) {
        let (record, step) = decimated(record, args, counts_samples)?;
        account.steps.extend(step);
        all.records.push(record);
        all.accounts.push(account);
    }
    Ok(all)
}

/// Says that a high rate was kept because samples are counted.
pub fn say_kept(sample_time: SampleTime, args: &ReadArgs, counts_samples: bool) {
    let prepare = &args.prepare;
    let factor = prepare.rate.decimate.factor(sample_time);
    if counts_samples && prepare.new_fs.is_none() && prepare.rate.decimate == Decimation::Auto && factor > 1 {
        let hz = (1e4 / sample_time.s()).round() / 1e4;
        output::notice(
            "",
            format!(
                "{hz} Hz is kept, since orders and delays count samples here; --decimate {factor} brings it near 100 Hz"
            ),
        );
    }
}

/// What was typed for each channel; one that is named twice contradicts itself.
pub fn by_channel<T: Clone>(option: &str, typed: &[(String, T)]) -> Result<BTreeMap<String, T>, CliError> {
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

/// How the records were read, defaults included.
pub fn settings(read: &ReadArgs, with_input: bool) -> Vec<(String, String)> {
    let or_all = |bound: Option<f64>, all: &str| bound.map_or(all.to_owned(), |v| v.to_string());
    let mut list = vec![
        ("output".to_owned(), read.output.clone()),
        (
            "sampling".to_owned(),
            read.fs.map_or("column t".to_owned(), |fs| format!("{fs} Hz")),
        ),
        (
            "span in s".to_owned(),
            format!("{} to {}", or_all(read.from, "start"), or_all(read.to, "end")),
        ),
        ("detrend".to_owned(), read.detrend.to_string()),
        ("decimate".to_owned(), read.prepare.rate.decimate.to_string()),
    ];
    if with_input {
        list.insert(0, ("input".to_owned(), read.input.clone()));
    }
    if read.resample || read.fill {
        list.push((
            "repair".to_owned(),
            format!("resample {}, fill {}", read.resample, read.fill),
        ));
    }
    list
}

/// What was done to the records and what is wrong with their files, as rows of a table of settings.
pub fn accounts(files: &[String], accounts: &[Account]) -> Vec<(String, String)> {
    let name = |what: &str, file: &str| {
        if files.len() == 1 {
            what.to_owned()
        } else {
            format!("{what} of {file}")
        }
    };
    let mut rows = Vec::new();
    for (file, account) in files.iter().zip(accounts) {
        let steps: Vec<String> = account.steps.iter().map(Step::to_string).collect();
        let issues: Vec<String> = account.quality_issues.iter().map(QualityIssue::to_string).collect();
        let faults: Vec<String> = account.faults.iter().map(Fault::to_string).collect();
        for (what, parts) in [("preparation", steps), ("sampling trouble", issues), ("faults", faults)] {
            if !parts.is_empty() {
                rows.push((name(what, file), parts.join("; ")));
            }
        }
    }
    rows
}
