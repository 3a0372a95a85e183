//! `hoid study`: runs plans and merges shards.

use std::{
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use hoid::study::{Outcome, Plan, Progress, RunOptions, StudyError, merge, plan_schema, run};
use hoid::thesis::plans::{find as find_plan, named_plans};
use serde_json::json;

use crate::{
    args::{StudyCommand, StudyMergeArgs, StudyRunArgs},
    commands::study_answer::summary,
    error::CliError,
    interrupt, output,
};

pub fn run_command(command: &StudyCommand) -> Result<(), CliError> {
    match command {
        StudyCommand::Run(args) => run_plan(args),
        StudyCommand::Merge(args) => merge_shards(args),
        StudyCommand::Check(args) => {
            output::show(&description(&read_plan(&args.plan)?))?;
            Ok(())
        }
        StudyCommand::Plans(args) => print_plans(args.name.as_deref()),
        StudyCommand::Schema => {
            output::print(&plan_schema())?;
            Ok(())
        }
    }
}

/// Reads a plan from a file or, if there is no such file, finds it by name.
fn read_plan(path: &Path) -> Result<Plan, CliError> {
    if !path.exists()
        && let Some(named) = path.to_str().and_then(find_plan)
    {
        return Ok(named.plan()?);
    }
    Ok(Plan::read(path)?)
}

fn run_plan(args: &StudyRunArgs) -> Result<(), CliError> {
    let mut plan = read_plan(&args.plan)?;
    if let Some(replications) = args.replications {
        plan = plan.with_replications(replications)?;
    }
    if !args.resume {
        hoid::io::check_output_directory(&args.out, &[])?;
    }
    let options = RunOptions {
        shard: args.shard,
        jobs: args.jobs.map(usize::from),
        resume: args.resume,
        csv: args.csv,
    };
    let estimates = usize::try_from(plan.estimate_count()).unwrap_or(usize::MAX);
    let outcome = with_progress(
        &plan.name,
        &args.out,
        (estimates, "estimates"),
        |progress, should_continue| run(&plan, &args.out, &options, progress, should_continue),
    )?;
    if args.json {
        output::print(&format!("{:#}\n", outcome_json(&plan, &outcome)))?;
        return Ok(());
    }
    let mut text = summary(&outcome.tables)?;
    text.push_str(&format!("{}: {} estimates made\n", plan.name, outcome.estimates));
    if let Some(shard) = args.shard {
        text.push_str(&format!(
            "shard {shard} is in {}; join all {} shards with `hoid study merge`\n",
            args.out.display(),
            shard.of
        ));
    }
    text.push_str(&tables_text(&outcome));
    output::show(&text)?;
    Ok(())
}

/// Runs a plan or a group in a directory, with a progress bar for the given number of units. An interrupt stops the
/// run, which can then be resumed.
pub fn with_progress(
    name: &str,
    directory: &Path,
    (total, unit): (usize, &'static str),
    work: impl FnOnce(&(dyn Fn(Progress) + Sync), &(dyn Fn() -> bool + Sync)) -> Result<Outcome, StudyError>,
) -> Result<Outcome, CliError> {
    let stopped = stop_at_interrupt();
    let bar = output::progress_bar(total, unit);
    let outcome = work(
        &|progress: Progress| {
            bar.set_length(progress.total);
            bar.set_position(progress.done);
        },
        &|| !stopped.load(Ordering::Relaxed),
    );
    bar.finish_and_clear();
    let outcome = outcome?;
    print_warnings(directory, &outcome.notes);
    if outcome.finished {
        Ok(outcome)
    } else {
        Err(CliError::Stopped(format!(
            "{name} was stopped; completed parts are in {}; continue with --resume",
            directory.display()
        )))
    }
}

/// Prints the notes on a directory as warnings.
fn print_warnings(directory: &Path, notes: &[String]) {
    for note in notes {
        output::add_warning(&directory.display().to_string(), note);
    }
}

/// Returns a flag that an interrupt sets. A second interrupt ends the program at once; only the blocks in progress are
/// lost.
pub fn stop_at_interrupt() -> Arc<AtomicBool> {
    let stopped = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stopped);
    interrupt::on_interrupt(move |_| {
        if flag.swap(true, Ordering::Relaxed) {
            interrupt::exit(interrupt::exit_code());
        }
    });
    stopped
}

fn merge_shards(args: &StudyMergeArgs) -> Result<(), CliError> {
    let outcome = merge(&args.shards, &args.out, args.csv)?;
    print_warnings(&args.out, &outcome.notes);
    if args.json {
        let tables: Vec<String> = outcome.tables.iter().map(|t| t.display().to_string()).collect();
        output::print(&format!(
            "{:#}\n",
            json!({ "hoid": env!("CARGO_PKG_VERSION"), "estimates": outcome.estimates, "tables": tables })
        ))?;
        return Ok(());
    }
    output::show(&format!(
        "{}{} estimates\n{}",
        summary(&outcome.tables)?,
        outcome.estimates,
        tables_text(&outcome)
    ))?;
    Ok(())
}

fn tables_text(outcome: &Outcome) -> String {
    outcome
        .tables
        .iter()
        .map(|table| format!("  {}\n", table.display()))
        .collect()
}

fn outcome_json(plan: &Plan, outcome: &Outcome) -> serde_json::Value {
    let tables: Vec<String> = outcome.tables.iter().map(|t| t.display().to_string()).collect();
    json!({
        "hoid": env!("CARGO_PKG_VERSION"),
        "study": plan.name,
        "plan_sha256": plan.hash(),
        "seed": plan.seed,
        "replications": plan.replications,
        "estimates": outcome.estimates,
        "tables": tables,
    })
}

fn description(plan: &Plan) -> String {
    let mut text = format!("{}: {}\n", plan.name, plan.title);
    if !plan.description.trim().is_empty() {
        text.push_str(&format!("{}\n", plan.description.trim()));
    }
    text.push_str(&format!(
        "seed {}, {} replications, {} cells, {} estimators, {} estimates in total\n",
        plan.seed,
        plan.replications,
        plan.cells.len(),
        plan.estimators.len(),
        plan.estimate_count()
    ));
    const MAX_ENTRIES: usize = 12;
    let mut list = |title: &str, entries: Vec<String>| {
        text.push_str(&format!("{title}\n"));
        entries
            .iter()
            .take(MAX_ENTRIES)
            .for_each(|entry| text.push_str(&format!("  {entry}\n")));
        if entries.len() > MAX_ENTRIES {
            text.push_str(&format!("  ... and {} more\n", entries.len() - MAX_ENTRIES));
        }
    };
    let of_cell = |cell: &hoid::study::plan::Cell| {
        let axes: Vec<String> = cell
            .axes
            .iter()
            .map(|axis| format!("{}={}", axis.key, axis.value))
            .collect();
        format!("{:3}  {} {}", cell.index, cell.scenario, axes.join(" "))
    };
    list("cells", plan.cells.iter().map(of_cell).collect());
    list("estimators", plan.estimators.iter().map(|e| e.label.clone()).collect());
    text
}

fn print_plans(name: Option<&str>) -> Result<(), CliError> {
    let Some(name) = name else {
        let mut text = String::new();
        for named in named_plans() {
            let plan = named.plan()?;
            text.push_str(&format!(
                "{:22} {} ({} estimates)\n",
                plan.name,
                plan.title,
                plan.estimate_count()
            ));
        }
        output::show(&text)?;
        return Ok(());
    };
    let named = find_plan(name).ok_or_else(|| {
        let known: Vec<&str> = named_plans().map(|p| p.name).collect();
        CliError::Usage(format!(
            "no plan is called {name}; expected one of {}",
            known.join(", ")
        ))
    })?;
    output::print(named.text)?;
    Ok(())
}
