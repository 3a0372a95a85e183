//! Recorded people: from a folder of runs to a group result.
//!
//! | module | what it holds |
//! |---|---|
//! | [`Manifest`] | which files belong to whom, and what is done with them |
//! | [`Pattern`] | subject, condition and run from names of files |
//! | [`Preparing`] | what is done to the runs before they are analysed |
//! | `reading` | runs from files, and what was done to them |
//! | `analysis` | what is done with one run |
//! | `traces` | its recursive estimates as rows |
//! | `responses` | frequency responses of the fits |
//! | [`VirtualExperiment`] | the same from simulated people |
//! | `frequency` | describing functions by subject and condition, and how far the fits are from them |
//! | `settling` | how fast the recursions follow a change at a known instant, and how noisy they are |
//! | `averages` | means over the runs, chosen delays, averages of traces |
//! | `join` | the tables of the group from those of its runs |
//!
//! Each run is a part on disk, as a block of a study is, and so is the fit of all runs of a person in a condition: a group that was stopped goes on, and of a run
//! nothing stays in memory but its estimates and responses; traces are averaged for one person in one condition after the other.

mod analysis;
mod averages;
mod frequency;
mod join;
mod manifest;
mod pattern;
mod preparing;
mod reading;
mod responses;
mod settling;
mod tables;
mod traces;
mod virtual_people;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
};

use sha2::{Digest, Sha256};

pub use manifest::{Analysis, ConditionFacts, Detrending, Manifest, MethodName, Reading, RunEntry};
pub use pattern::{Matched, Pattern};
pub use preparing::{NumberOrText, Preparing};
pub use virtual_people::{Trouble, VirtualExperiment, simulate_group};

use crate::{
    RunOptions, StudyError,
    manifest::{Manifest as Record, part},
    run::{Outcome, Progress, on_threads, remove_parts, sweep, table_path},
};

/// Name of the copy of the manifest beside the results.
pub const MANIFEST: &str = "group.toml";

/// Analyses the runs that count. `base` is the directory from which the files are named.
///
/// # Errors
/// As [`crate::run`].
pub fn run_group(
    manifest: &Manifest,
    base: &Path,
    directory: &Path,
    options: &RunOptions,
    progress: &(dyn Fn(Progress) + Sync),
    go_on: &(dyn Fn() -> bool + Sync),
) -> Result<Outcome, StudyError> {
    let blocks = blocks(manifest);
    let record = Record {
        hoid: env!("CARGO_PKG_VERSION").to_owned(),
        study: manifest.name.clone(),
        plan_sha256: hash(manifest, base),
        seed: 0,
        replications: 1,
        blocks: blocks.len() as u64,
        shard: None,
        complete: false,
    };
    let complete = prepare(manifest, directory, &record, options.resume)?;
    let tables = || tables(directory);
    if complete {
        return Ok(Outcome {
            finished: true,
            estimates: 0,
            tables: tables(),
        });
    }
    let total = blocks.len() as u64;
    let is_there = |i: usize| part(directory, i as u64, "estimates").exists();
    let open: Vec<usize> = (0..blocks.len()).filter(|i| !is_there(*i)).collect();
    let known = total - open.len() as u64;
    let done = AtomicU64::new(known);
    let one = |&i: &usize| -> Result<bool, StudyError> {
        if !go_on() {
            return Ok(false);
        }
        let found = match &blocks[i] {
            Block::Run(run) => analysis::analyse(manifest, base, run),
            Block::Together(runs) => analysis::analyse_together(manifest, base, runs),
        };
        hoid_io::write_table(&part(directory, i as u64, "traces"), &found.traces)?;
        hoid_io::write_table(&part(directory, i as u64, "responses"), &found.responses)?;
        for (table, rows) in &found.account {
            hoid_io::write_table(&part(directory, i as u64, table), rows)?;
        }
        hoid_io::write_table(&part(directory, i as u64, "estimates"), &found.estimates)?;
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress(Progress { done, total, known });
        Ok(true)
    };
    let finished = on_threads(options.jobs, &open, one)?;
    let estimates = done.load(Ordering::Relaxed) - known;
    if !finished {
        return Ok(Outcome {
            finished,
            estimates,
            tables: Vec::new(),
        });
    }
    join::join(manifest, base, &blocks, directory, options.csv)?;
    Record {
        complete: true,
        ..record
    }
    .write(directory)?;
    remove_parts(directory)?;
    Ok(Outcome {
        finished: true,
        estimates,
        tables: tables(),
    })
}

/// What is analysed at once and is a part on disk.
enum Block<'a> {
    Run(&'a RunEntry),
    /// All runs of a person in a condition that does not change.
    Together(Vec<&'a RunEntry>),
}

/// The runs that count, and then those that are fitted together.
fn blocks(manifest: &Manifest) -> Vec<Block<'_>> {
    let runs: Vec<&RunEntry> = manifest.runs.iter().filter(|run| run.counts).collect();
    let steady = |run: &&&RunEntry| {
        let facts = manifest.conditions.get(&run.condition);
        run.then.is_none() && facts.is_none_or(|facts| facts.change_s.is_none())
    };
    let mut together: BTreeMap<(&str, &str), Vec<&RunEntry>> = BTreeMap::new();
    for run in runs.iter().filter(steady) {
        together.entry((&run.subject, &run.condition)).or_default().push(run);
    }
    let together = together.into_values().filter(|runs| runs.len() > 1);
    runs.into_iter()
        .map(Block::Run)
        .chain(together.map(Block::Together))
        .collect()
}

/// SHA-256 of the manifest and of the files that count; one that cannot be read is told by its run.
fn hash(manifest: &Manifest, base: &Path) -> String {
    let mut hasher = Sha256::new();
    hasher.update(manifest.text().as_bytes());
    for run in manifest.runs.iter().filter(|run| run.counts) {
        for file in std::iter::once(&run.file).chain(&run.then) {
            hasher.update(hoid_io::read_bytes(&base.join(file)).unwrap_or_default());
        }
    }
    hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Makes the directory ready; true when it holds the finished group.
fn prepare(manifest: &Manifest, directory: &Path, record: &Record, resume: bool) -> Result<bool, StudyError> {
    let shown = || directory.display().to_string();
    if let Some(found) = Record::read(directory)? {
        if !resume {
            return Err(StudyError::Occupied { directory: shown() });
        }
        if let Some(reason) = found.differs(record) {
            return Err(StudyError::OtherStudy {
                directory: shown(),
                reason: format!("{reason} (the sum covers the manifest and its files)"),
            });
        }
        sweep(&directory.join("parts"))?;
        return Ok(found.complete);
    }
    hoid_io::make_directory(&directory.join("parts"))?;
    let text = manifest.text();
    hoid_io::write_atomically(&directory.join(MANIFEST), |file| file.write_all(text.as_bytes()))?;
    record.write(directory)?;
    Ok(false)
}

const TABLES: [&str; 13] = [
    "preparation",
    "trouble",
    "estimates",
    "averages",
    "delays",
    "settling",
    "describing-functions",
    "frequency-margins",
    "agreement",
    "responses",
    "response-averages",
    "traces",
    "trace-averages",
];

fn tables(directory: &Path) -> Vec<PathBuf> {
    TABLES
        .iter()
        .flat_map(|table| [false, true].map(|csv| table_path(directory, table, csv)))
        .filter(|path| path.exists())
        .collect()
}
