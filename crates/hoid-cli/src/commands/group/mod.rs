//! `hoid group`: analysis of recorded runs by subject and condition. `form` formats the results as text and JSON;
//! `pooled` computes the estimates for each person with partial pooling.

mod form;
mod pooled;

use std::path::{Path, PathBuf};

use hoid::analysis::ExaminationOptions;
use hoid::model::{SampleTime, VerdictLevel};
use hoid::report::{group_figures, write_group_pages};
use hoid::sim::people::{Population, Range};
use hoid::study::{
    Outcome, RunOptions,
    group::{
        ConditionElement, GroupSummary, MANIFEST_FILE, Manifest, Pattern, PeopleExperiment, VirtualExperiment, inspect,
        run_group, simulate_group, simulate_people, with_comments,
    },
};

use form::GroupReport;
use serde_json::Value;

use super::{figure, output_paths, paper_table, study::with_progress};
use crate::{
    args::{GroupArgs, GroupCommand, GroupInitArgs, GroupRunArgs, SimulateGroupArgs},
    error::CliError,
    json, output,
};

/// Maximum number of reasons in the error message for a group without a result; the page contains all reasons.
const MAX_LISTED_REASONS: usize = 3;

pub fn run(args: &GroupArgs) -> Result<(), CliError> {
    match (&args.command, &args.run.manifest, &args.run.out) {
        (Some(GroupCommand::Init(init)), _, _) => write_manifest(init),
        (None, Some(manifest), Some(out)) => analyse(manifest, out, &args.run),
        _ => Err(CliError::Usage(
            "give --out and a manifest or a directory, or use `hoid group init DIR`".to_owned(),
        )),
    }
}

pub fn simulate(args: &SimulateGroupArgs) -> Result<(), CliError> {
    let conditions = if args.people {
        args.people_options.plants.len()
    } else {
        args.conditions.len()
    };
    let total = args
        .subjects
        .saturating_mul(args.runs)
        .saturating_mul(conditions as u64);
    let bar = output::progress_bar(usize::try_from(total).unwrap_or(usize::MAX), "runs");
    let manifest = if args.people {
        simulate_people(&people_experiment(args)?, &args.out, &|| bar.inc(1))
    } else {
        simulate_group(&virtual_experiment(args), &args.out, &|| bar.inc(1))
    };
    bar.finish_and_clear();
    output::print(&format!(
        "{} runs in {}, with the true parameters in truth.csv; next: hoid group {} --out DIR\n",
        manifest?.runs.len(),
        args.out.display(),
        args.out.display()
    ))?;
    Ok(())
}

fn virtual_experiment(args: &SimulateGroupArgs) -> VirtualExperiment {
    VirtualExperiment {
        subjects: args.subjects,
        conditions: args.conditions.clone(),
        runs: args.runs,
        between_subjects: args.between_subjects,
        between_runs: args.between_runs,
        remnant_order: args.remnant_order,
        noise_level: args.noise_level,
        seed: args.seed,
        defects: args.trouble.clone(),
    }
}

fn people_experiment(args: &SimulateGroupArgs) -> Result<PeopleExperiment, CliError> {
    let own = &args.people_options;
    let (low, high) = own.remnant_share;
    Ok(PeopleExperiment {
        subjects: args.subjects,
        plants: own.plants.clone(),
        form: own.form,
        remnants: own.remnants.clone(),
        runs: args.runs,
        between_runs: args.between_runs,
        population: Population {
            remnant_share: Range::new(low, high),
            ..Population::default()
        },
        sample_time: own.sample_time.map_or(Ok(SampleTime::AT_60_HZ), SampleTime::new)?,
        seed: args.seed,
        defects: args.trouble.clone(),
    })
}

fn write_manifest(args: &GroupInitArgs) -> Result<(), CliError> {
    let pattern = Pattern::new(&args.pattern)?;
    let path = args.out.clone().unwrap_or_else(|| args.directory.join(MANIFEST_FILE));
    let piped = path.as_os_str() == "-";
    if !piped && path.exists() {
        return Err(CliError::Usage(format!(
            "{} is already present; remove it or name another file with --out",
            path.display()
        )));
    }
    let (mut manifest, others) = Manifest::from_directory(&args.directory, &pattern)?;
    let known = ExaminationOptions {
        offset_samples: args.offset,
        ..args.examination.to_options()
    };
    let evidence = inspect(&mut manifest, &args.directory, &known)?;
    ConditionElement::apply(&args.element, &mut manifest)
        .map_err(|reason| CliError::Usage(format!("--element: {reason}")))?;
    manifest
        .set_roles(&args.role)
        .map_err(|reason| CliError::Usage(format!("--role: {reason}")))?;
    if args.out.is_some() {
        // File names are relative to the manifest.
        let directory = args.directory.canonicalize().unwrap_or_else(|_| args.directory.clone());
        for run in &mut manifest.runs {
            run.file = directory.join(&run.file);
        }
    }
    let text = with_comments(&manifest.text(), &evidence);
    if piped {
        output::print(&text)?;
        return Ok(());
    }
    hoid::io::write_atomically(&path, |file| file.write_all(text.as_bytes()))?;
    let mut message = format!("{} runs in {}\n", manifest.runs.len(), path.display());
    if !others.is_empty() {
        message.push_str(&format!(
            "Files that do not match {:?}: {}; the first is {}\n",
            args.pattern,
            others.len(),
            others[0]
        ));
    }
    for one in &evidence {
        let location = [one.table.as_str(), one.key].join(" ");
        let location = location.trim();
        let colon = if location.is_empty() { "" } else { ": " };
        message.push_str(&format!("- {location}{colon}{}\n", one.text));
    }
    message.push_str(&format!(
        "Check {}, then: hoid group {} --out results\n",
        path.display(),
        path.display()
    ));
    output::show(&message)
}

fn analyse(path: &Path, out: &Path, args: &GroupRunArgs) -> Result<(), CliError> {
    let path = &Manifest::manifest_path(path)?;
    if let Some(figure) = &args.picture.figure {
        figure::check(figure)?;
        output_paths::check(&[path], &[Some(figure)], &[])?;
    }
    paper_table::check(&args.show)?;
    output_paths::check(&[path], &[args.show.table.as_deref()], &[])?;
    let manifest = Manifest::read(path)?;
    // When a group is resumed, its manifest already exists.
    if !args.resume {
        hoid::io::check_output_directory(out, &[path])?;
    }
    let options = RunOptions {
        jobs: args.jobs.map(usize::from),
        resume: args.resume,
        csv: args.csv,
        ..RunOptions::default()
    };
    let outcome = analyse_with_progress(&manifest, path, out, &options)?;
    let summary = GroupSummary::read(&manifest, out)?;
    let pages = path_texts(&write_group_pages(&manifest, path, out)?);
    if let Some(location) = &args.picture.figure {
        write_figures(
            &group_figures(&manifest, out, args.picture.width)?,
            location,
            args.picture.width,
        )?;
    }
    let pooled = match args.pool {
        true => Some(pooled::write_pooled_estimates(&manifest, &summary, out)?),
        false => None,
    };
    let finished = GroupReport {
        manifest: &manifest,
        summary: &summary,
        tables: path_texts(&outcome.tables),
        pages,
    };
    paper_table::write(&args.show, || Ok(finished.json()))?;
    if args.show.json {
        let mut object = finished.json();
        if let Some((populations, _)) = &pooled {
            object.insert("populations".to_owned(), pooled::populations_json(populations));
        }
        json::print(&Value::Object(object))?;
    } else {
        let of_all = pooled.map_or_else(String::new, |(populations, files)| pooled::page(&populations, &files));
        output::show(&format!("{}{of_all}", finished.page(args.show.verbose)))?;
    }
    if summary.verdict.level == VerdictLevel::NotDetermined {
        let reasons: Vec<&str> = summary.verdict.reasons().take(MAX_LISTED_REASONS).collect();
        return Err(CliError::NotDetermined(reasons.join("; ")));
    }
    Ok(())
}

/// Analyses the runs of a manifest, with a progress bar, and writes the results to a directory.
pub fn analyse_with_progress(
    manifest: &Manifest,
    path: &Path,
    out: &Path,
    options: &RunOptions,
) -> Result<Outcome, CliError> {
    let base = path.parent().map_or_else(|| PathBuf::from("."), Path::to_path_buf);
    let runs = manifest.runs.iter().filter(|run| run.counts).count();
    with_progress(&manifest.name, out, (runs, "runs"), |progress, should_continue| {
        run_group(manifest, &base, out, options, progress, should_continue)
    })
}

/// Writes one figure for each condition. With several conditions, the name of the condition is appended to the given
/// file name.
fn write_figures(figures: &[(String, String)], location: &Path, width_mm: Option<f64>) -> Result<(), CliError> {
    if figures.is_empty() {
        output::add_notice(
            "",
            "no figure was written: it would show describing functions, but no condition in the manifest names its \
             excitation; add excitation to [conditions.NAME]"
                .to_owned(),
        );
    }
    for (condition, svg) in figures {
        let stem = location.file_stem().unwrap_or_default().to_string_lossy();
        let ending = location.extension().unwrap_or_default().to_string_lossy();
        let of_condition = pooled::to_file_name(condition);
        let own = match figures.len() {
            1 => location.to_owned(),
            _ => location.with_file_name(format!("{stem}-{of_condition}.{ending}")),
        };
        figure::write(&own, svg, width_mm)?;
    }
    Ok(())
}

fn path_texts(paths: &[PathBuf]) -> Vec<String> {
    paths.iter().map(|path| path.display().to_string()).collect()
}
