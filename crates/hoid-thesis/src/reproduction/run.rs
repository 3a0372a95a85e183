//! The whole reproduction in a directory: it runs the required plans, draws tables and figures, tests the claims, and
//! writes the index page.
//!
//! Studies are stored in `studies/NAME`, figures and tables in `figures` and `tables`. An existing study is used
//! unchanged, so an interrupted reproduction can be continued.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
    time::Instant,
};

use hoid_io::{DirectoryLock, OutputTable, make_directory, write_atomically, write_table};
use hoid_study::{NamedPlan, Progress, Results, RunOptions, StudyError, run};
use rayon::prelude::*;

use super::{
    catalogue::{items, recorded_items},
    experiment::NAME as EXPERIMENT_RUNS,
    index::{IndexPage, StudyEntry},
    item::{CLAIMS_NAME, Item, ProgressCallbacks, Studies},
};
use hoid_report::write_page;

use crate::{
    ThesisError,
    claims::{Evidence, claims, claims_table, findings},
    experiment::RecordedPeople,
    plans::TEXT_PLANS,
};

/// Options of a reproduction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reproduction {
    /// Names of the selected tables, figures, appendices or studies, or [`CLAIMS_NAME`]; empty for everything.
    pub only: Vec<String>,
    /// Number of replications of each cell.
    pub replications: u64,
    /// Number of threads; `None` for one thread per core.
    pub jobs: Option<usize>,
    /// Directory or manifest of recorded people; if given, only the experiment with these people is made.
    pub recordings: Option<PathBuf>,
}

impl Default for Reproduction {
    fn default() -> Self {
        Self {
            only: Vec::new(),
            replications: NamedPlan::DEFAULT_REPLICATIONS,
            jobs: None,
            recordings: None,
        }
    }
}

/// Event of a running reproduction.
#[derive(Debug, Clone, Copy)]
pub enum ReproductionEvent<'a> {
    /// Progress of a study.
    Progress(Progress),
    /// A study is complete.
    Study(&'a StudyEntry),
    /// A note, for example about damaged blocks of a study that were computed again.
    Note(&'a str),
}

/// Summary of a reproduction.
#[derive(Debug, Clone, PartialEq)]
pub struct ReproductionSummary {
    /// Path of the page.
    pub index: PathBuf,
    /// Number of tables and figures.
    pub items: usize,
    /// Numbers of claims by verdict: hold, hold more strongly, hold in part, do not hold, cannot be tested; `None` if
    /// the claims were not selected.
    pub verdict_counts: Option<[usize; 5]>,
    /// Duration of the studies, s.
    pub simulation_time_s: f64,
    /// Duration of drawing the tables and figures, s.
    pub drawing_time_s: f64,
}

/// Runs the reproduction in a directory. Returns `None` if `keep_running` has stopped it; another call then continues
/// it.
///
/// # Errors
/// [`ThesisError::UnknownItem`]; [`ThesisError::NotTheExperiment`] and [`ThesisError::Recordings`] if the recordings
/// cannot be used; [`ThesisError::Study`] and [`ThesisError::Io`] if running, reading or writing fails.
pub fn reproduce(
    wanted: &Reproduction,
    directory: &Path,
    notify: &(dyn Fn(ReproductionEvent<'_>) + Sync),
    keep_running: &(dyn Fn() -> bool + Sync),
) -> Result<Option<ReproductionSummary>, ThesisError> {
    let start_time = Instant::now();
    let mut index = IndexPage::default();
    let all = match &wanted.recordings {
        Some(_) if wanted.only != [EXPERIMENT_RUNS] => return Err(ThesisError::NotTheExperiment),
        Some(location) => {
            let people = RecordedPeople::open(location)?;
            for (name, reason) in people.omitted_conditions() {
                let note = format!("condition {name} is left out: {reason}");
                notify(ReproductionEvent::Note(&note));
                index.notes.push(note);
            }
            recorded_items(people)
        }
        None => items(),
    };
    let (chosen, with_claims) = select_items(all, wanted)?;
    make_directory(directory)?;
    let _lock = DirectoryLock::take(directory)?;
    let mut plans: BTreeSet<&str> = chosen.iter().filter_map(|item| item.plan).collect();
    if with_claims {
        plans.extend(claims().iter().flat_map(|claim| claim.plans.iter().copied()));
    }
    let mut studies = Studies::new();
    for named in TEXT_PLANS.iter().filter(|named| plans.contains(named.name)) {
        let Some((entry, results)) = run_or_read_study(named, wanted, directory, notify, keep_running)? else {
            return Ok(None);
        };
        notify(ReproductionEvent::Study(&entry));
        index.add_study(&entry);
        studies.insert(named.name.to_owned(), results);
    }
    let mut shared_runs = BTreeSet::new();
    for shared in chosen.iter().filter_map(|item| item.shared.as_ref()) {
        if !shared_runs.insert(shared.name) {
            continue;
        }
        if !keep_running() {
            return Ok(None);
        }
        let start_time = Instant::now();
        let done = AtomicU64::new(0);
        let watch = ProgressCallbacks {
            completed: &|estimates| {
                let done = done.fetch_add(estimates, Ordering::Relaxed) + estimates;
                let total = shared.estimates;
                notify(ReproductionEvent::Progress(Progress {
                    done,
                    total,
                    done_earlier: 0,
                }));
            },
            should_continue: keep_running,
        };
        let notes = on_threads(wanted.jobs, || (shared.make_runs)(&watch))??;
        if !keep_running() {
            return Ok(None);
        }
        for note in notes {
            notify(ReproductionEvent::Note(&note));
            index.notes.push(note);
        }
        let entry = StudyEntry {
            name: shared.name.to_owned(),
            title: shared.title.to_owned(),
            directory: String::new(),
            estimates: shared.estimates,
            seconds: Some(start_time.elapsed().as_secs_f64()),
        };
        notify(ReproductionEvent::Study(&entry));
        index.add_study(&entry);
    }
    let simulated_s = start_time.elapsed().as_secs_f64();
    for name in ["figures", "tables"] {
        make_directory(&directory.join(name))?;
    }
    // The items are collected by position, so the page does not depend on the order in which they are drawn.
    let made: Vec<_> = chosen
        .par_iter()
        .map(|item| write_item(item, &studies, directory))
        .collect::<Result<_, ThesisError>>()?;
    for (item, made) in chosen.iter().zip(&made) {
        index.add(item, made.svg.as_deref(), &made.data, &made.table);
    }
    let tally = if with_claims {
        Some(test_claims(&studies, &mut index, directory)?)
    } else {
        None
    };
    let of_runs = match &wanted.recordings {
        Some(location) => ("recordings".to_owned(), location.display().to_string()),
        None => ("replications of each cell".to_owned(), wanted.replications.to_string()),
    };
    index.settings = vec![
        ("made by".to_owned(), format!("hoid {}", env!("CARGO_PKG_VERSION"))),
        of_runs,
        ("tables and figures".to_owned(), chosen.len().to_string()),
    ];
    if wanted.recordings.is_none() && wanted.replications < NamedPlan::DEFAULT_REPLICATIONS {
        index.notes.push(format!(
            "With only {} of {} replications, many claims remain undecided.",
            wanted.replications,
            NamedPlan::DEFAULT_REPLICATIONS
        ));
    }
    let index = write_page(directory, "index.html", &index.to_html()?)?;
    Ok(Some(ReproductionSummary {
        index,
        items: chosen.len(),
        verdict_counts: tally,
        simulation_time_s: simulated_s,
        drawing_time_s: start_time.elapsed().as_secs_f64() - simulated_s,
    }))
}

/// Runs a function on a pool of `jobs` threads, or one thread per core.
fn on_threads<R: Send>(jobs: Option<usize>, work: impl FnOnce() -> R + Send) -> Result<R, ThesisError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs.unwrap_or(0)).build();
    let pool = pool.map_err(|error| StudyError::Threads {
        reason: error.to_string(),
    })?;
    Ok(pool.install(work))
}

/// Returns the selected items, and true if the claims are selected. An item is selected by its name, its plan, the runs
/// it shares, or the letter of an appendix. With recorded people no claims are selected.
fn select_items(all: Vec<Item>, wanted: &Reproduction) -> Result<(Vec<Item>, bool), ThesisError> {
    let only = &wanted.only;
    if only.is_empty() {
        return Ok((all, wanted.recordings.is_none()));
    }
    let means = |item: &Item, name: &str| {
        let letter = format!("{}.", name.to_ascii_uppercase());
        item.name.eq_ignore_ascii_case(name)
            || item.plan.is_some_and(|plan| plan == name)
            || item.shared.as_ref().is_some_and(|shared| shared.name == name)
            || (name.len() == 1 && item.name.starts_with(&letter))
    };
    let names: Vec<&str> = only.iter().map(|name| name.trim()).collect();
    if let Some(name) = names
        .iter()
        .find(|name| **name != CLAIMS_NAME && !all.iter().any(|item| means(item, name)))
    {
        let known: Vec<&str> = all.iter().map(|item| item.name.as_str()).collect();
        return Err(ThesisError::UnknownItem {
            name: (*name).to_owned(),
            available: known.join(", "),
        });
    }
    let items = all
        .into_iter()
        .filter(|item| names.iter().any(|name| means(item, name)));
    Ok((items.collect(), names.contains(&CLAIMS_NAME)))
}

/// Tests the claims of the thesis, writes their table, adds them to the page, and counts the verdicts.
fn test_claims(studies: &Studies, index: &mut IndexPage, directory: &Path) -> Result<[usize; 5], ThesisError> {
    let mut evidence = Evidence::new();
    for results in studies.values() {
        evidence.add(results);
    }
    let findings = findings(&evidence);
    write_table(&directory.join("tables/claims.csv"), &claims_table(&findings))?;
    index.add_claims(&findings);
    Ok(index.verdict_counts())
}

/// Runs a named plan or reads its existing results. Returns `None` if the run was stopped.
fn run_or_read_study(
    named: &NamedPlan,
    wanted: &Reproduction,
    directory: &Path,
    notify: &(dyn Fn(ReproductionEvent<'_>) + Sync),
    keep_running: &(dyn Fn() -> bool + Sync),
) -> Result<Option<(StudyEntry, Results)>, ThesisError> {
    let plan = named.plan()?.with_replications(wanted.replications)?;
    let directory = directory.join("studies").join(named.name);
    let start_time = Instant::now();
    let options = RunOptions {
        jobs: wanted.jobs,
        resume: true,
        ..RunOptions::default()
    };
    let outcome = run(
        &plan,
        &directory,
        &options,
        &|progress| notify(ReproductionEvent::Progress(progress)),
        keep_running,
    )?;
    for note in &outcome.notes {
        notify(ReproductionEvent::Note(&format!("{}: {note}", plan.name)));
    }
    if !outcome.finished {
        return Ok(None);
    }
    let entry = StudyEntry {
        name: plan.name.clone(),
        title: plan.title.clone(),
        directory: format!("studies/{}", plan.name),
        estimates: plan.estimate_count(),
        seconds: (outcome.estimates > 0).then(|| start_time.elapsed().as_secs_f64()),
    };
    Ok(Some((entry, Results::read(&directory)?)))
}

/// Paths of the figure and the data of an item, relative to the page.
struct ItemFiles {
    svg: Option<String>,
    data: String,
    table: OutputTable,
}

fn write_item(item: &Item, studies: &Studies, directory: &Path) -> Result<ItemFiles, ThesisError> {
    let made = item.make(studies);
    let folder = if made.svg.is_some() { "figures" } else { "tables" };
    let data = format!("{folder}/{}.csv", item.name);
    write_table(&directory.join(&data), &made.data)?;
    let mut written = ItemFiles {
        svg: None,
        data,
        table: made.data,
    };
    if let Some(svg) = made.svg {
        let path = format!("{folder}/{}.svg", item.name);
        write_atomically(&directory.join(&path), |file| file.write_all(svg.as_bytes()))?;
        written.svg = Some(path);
    }
    Ok(written)
}
