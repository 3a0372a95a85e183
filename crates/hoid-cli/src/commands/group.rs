//! `hoid group`: recorded runs by subject and condition.

use std::{
    path::{Path, PathBuf},
    sync::atomic::Ordering,
};

use hoid_io::{ColumnValues, OutputTable};
use hoid_report::{FrequencyTables, GroupReport, GroupTables};
use hoid_study::{
    RunOptions,
    group::{Manifest, Pattern, VirtualExperiment, run_group, simulate_group},
};
use serde_json::json;

use super::study::stop_at_interrupt;
use crate::{
    args::{GroupArgs, GroupCommand, GroupInitArgs, GroupRunArgs, SimulateGroupArgs},
    error::CliError,
    output,
};

/// Name of the manifest in a directory.
const MANIFEST: &str = "group.toml";
/// Runs whose preparation and trouble the pages list.
const MOST_TOLD: usize = 24;

pub fn run(args: &GroupArgs) -> Result<(), CliError> {
    match (&args.command, &args.run.manifest, &args.run.out) {
        (Some(GroupCommand::Init(init)), _, _) => write_manifest(init),
        (None, Some(manifest), Some(out)) => analyse(manifest, out, &args.run),
        _ => Err(CliError::Usage(
            "name a manifest or directory and --out, or `hoid group init DIR`".to_owned(),
        )),
    }
}

pub fn simulate(args: &SimulateGroupArgs) -> Result<(), CliError> {
    if args.out.join(MANIFEST).exists() {
        return Err(CliError::Usage(format!(
            "{} already holds an experiment; take another directory",
            args.out.display()
        )));
    }
    let experiment = VirtualExperiment {
        subjects: args.subjects,
        conditions: args.conditions.clone(),
        runs: args.runs,
        between_subjects: args.between_subjects,
        between_runs: args.between_runs,
        remnant_order: args.remnant_order,
        noise_level: args.noise_level,
        seed: args.seed,
        trouble: args.trouble.clone(),
    };
    let total = args
        .subjects
        .saturating_mul(args.runs)
        .saturating_mul(args.conditions.len() as u64);
    let bar = output::progress(usize::try_from(total).unwrap_or(usize::MAX), "runs");
    let manifest = simulate_group(&experiment, &args.out, &|| bar.inc(1));
    bar.finish_and_clear();
    output::print(&format!(
        "{} runs in {}, their true parameters in truth.csv; next: hoid group {} --out DIR\n",
        manifest?.runs.len(),
        args.out.display(),
        args.out.display()
    ));
    Ok(())
}

fn write_manifest(args: &GroupInitArgs) -> Result<(), CliError> {
    let pattern = Pattern::new(&args.pattern)?;
    let (mut manifest, others) = Manifest::of_directory(&args.directory, &pattern)?;
    if args.out.is_some() {
        // The files are named from where the manifest is.
        let directory = args.directory.canonicalize().unwrap_or_else(|_| args.directory.clone());
        for run in &mut manifest.runs {
            run.file = directory.join(&run.file);
        }
    }
    let text = manifest.text();
    let path = args.out.clone().unwrap_or_else(|| args.directory.join(MANIFEST));
    if path.as_os_str() == "-" {
        output::print(&text);
        return Ok(());
    }
    if path.exists() {
        return Err(CliError::Usage(format!(
            "{} is there already; remove it or name another with --out",
            path.display()
        )));
    }
    hoid_io::write_atomically(&path, |file| file.write_all(text.as_bytes()))?;
    let mut said = format!("{} runs in {}\n", manifest.runs.len(), path.display());
    if !others.is_empty() {
        said.push_str(&format!(
            "{} files do not match {:?}, the first is {}\n",
            others.len(),
            args.pattern,
            others[0]
        ));
    }
    output::print(&said);
    Ok(())
}

fn analyse(path: &Path, out: &Path, args: &GroupRunArgs) -> Result<(), CliError> {
    let path = if path.is_dir() {
        path.join(MANIFEST)
    } else {
        path.to_owned()
    };
    if !path.exists() {
        return Err(CliError::Usage(format!(
            "there is no {}; `hoid group init DIR` writes one",
            path.display()
        )));
    }
    let manifest = Manifest::read(&path)?;
    let base = path.parent().map_or_else(|| PathBuf::from("."), Path::to_path_buf);
    let stopped = stop_at_interrupt();
    let runs = manifest.runs.iter().filter(|run| run.counts).count();
    let bar = output::progress(runs, "runs");
    let options = RunOptions {
        jobs: args.jobs.map(usize::from),
        resume: args.resume,
        csv: args.csv,
        ..RunOptions::default()
    };
    let outcome = run_group(
        &manifest,
        &base,
        out,
        &options,
        &|progress| {
            bar.set_length(progress.total);
            bar.set_position(progress.done);
        },
        &|| !stopped.load(Ordering::Relaxed),
    );
    bar.finish_and_clear();
    let outcome = outcome?;
    if !outcome.finished {
        return Err(CliError::Stopped(format!(
            "{} was stopped; what is done is in {}, go on with --resume",
            manifest.name,
            out.display()
        )));
    }
    let pages = write_pages(&manifest, out, &path)?;
    let tables: Vec<String> = outcome.tables.iter().map(|t| t.display().to_string()).collect();
    if args.json {
        output::print(&format!(
            "{:#}\n",
            json!({ "hoid": env!("CARGO_PKG_VERSION"), "group": manifest.name, "runs": runs, "tables": tables, "reports": pages })
        ));
        return Ok(());
    }
    let listed: String = tables
        .iter()
        .chain(&pages)
        .map(|table| format!("  {table}\n"))
        .collect();
    output::print(&format!("{}: {runs} runs\n{listed}", manifest.name));
    Ok(())
}

/// The page of the group and one for each subject.
fn write_pages(manifest: &Manifest, out: &Path, path: &Path) -> Result<Vec<String>, CliError> {
    let read = |name: &str| hoid_io::read_table(&out.join(format!("{name}.parquet")));
    let (estimates, averages, delays) = (read("estimates")?, read("averages")?, read("delays")?);
    let (traces, settling, responses) = (read("trace-averages")?, read("settling")?, read("response-averages")?);
    let frequencies = if out.join("frequency-margins.parquet").exists() {
        Some([
            read("describing-functions")?,
            read("frequency-margins")?,
            read("agreement")?,
        ])
    } else {
        None
    };
    let tables = GroupTables {
        estimates: &estimates,
        averages: &averages,
        delays: &delays,
        traces: &traces,
        settling: &settling,
        responses: &responses,
        frequencies: frequencies.as_ref().map(|[lines, margins, agreement]| FrequencyTables {
            lines,
            margins,
            agreement,
        }),
    };
    let counting: Vec<_> = manifest.runs.iter().filter(|run| run.counts).collect();
    let mut subjects: Vec<&str> = Vec::new();
    for run in &counting {
        if !subjects.contains(&run.subject.as_str()) {
            subjects.push(&run.subject);
        }
    }
    let mut settings = vec![
        ("made by".to_owned(), format!("hoid {}", env!("CARGO_PKG_VERSION"))),
        ("manifest".to_owned(), path.display().to_string()),
        ("runs".to_owned(), counting.len().to_string()),
        (
            "input, output".to_owned(),
            format!("{}, {}", manifest.read.input, manifest.read.output),
        ),
        (
            "delay searched".to_owned(),
            format!("{} to {} s", manifest.analysis.delay_s.0, manifest.analysis.delay_s.1),
        ),
        (
            "nd searched".to_owned(),
            format!("{} to {}", manifest.analysis.nd.0, manifest.analysis.nd.1),
        ),
    ];
    settings.extend(account(&read("preparation")?, &read("trouble")?));
    let mut pages = Vec::new();
    for subject in std::iter::once(None).chain(subjects.iter().map(|s| Some(*s))) {
        let page = GroupReport {
            manifest,
            tables,
            settings: settings.clone(),
            subject,
        };
        let plain = |name: &str| name.replace(|c: char| !c.is_ascii_alphanumeric(), "-");
        let name = subject.map_or("report.html".to_owned(), |subject| {
            format!("subject-{}.html", plain(subject))
        });
        let html = page.html()?;
        let path = out.join(name);
        hoid_io::write_atomically(&path, |file| file.write_all(html.as_bytes()))?;
        pages.push(path.display().to_string());
    }
    Ok(pages)
}

/// What was done to the runs and what is wrong with their sampling, one row a run.
fn account(preparation: &OutputTable, trouble: &OutputTable) -> Vec<(String, String)> {
    let mut rows: Vec<(String, String)> = Vec::new();
    for (table, what) in [(preparation, "preparation"), (trouble, "sampling trouble")] {
        let text = |name: &str| match table.column(name) {
            Some(ColumnValues::Text(values)) => values.as_slice(),
            _ => &[],
        };
        for (file, words) in text("file").iter().zip(text("what")) {
            let name = format!("{what} of {file}");
            match rows.iter_mut().find(|(known, _)| *known == name) {
                Some((_, all)) => all.push_str(&format!("; {words}")),
                None => rows.push((name, words.clone())),
            }
        }
    }
    // Long lists are in the tables.
    let more = rows.len().saturating_sub(MOST_TOLD);
    rows.truncate(MOST_TOLD);
    if more > 0 {
        rows.push((
            "more runs".to_owned(),
            format!("{more}; all of them are in preparation.csv and trouble.csv"),
        ));
    }
    rows
}
