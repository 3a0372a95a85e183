//! The analysis of a group in a directory: blocks over threads, parts on disk, the tables of the
//! group at the end.

use std::{
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
};

use sha2::{Digest, Sha256};

use super::{
    analysis::{FromCell, PEOPLE, analyse, analyse_together},
    block::{Block, blocks},
    join::join,
    manifest::{MANIFEST, Manifest},
};
use crate::{
    RunOptions, StudyError,
    directory::{part, remove_parts, sweep, table_path},
    run::{Outcome, Progress, on_threads},
    run_record::RunRecord,
};

/// Analyses the runs that count. `base` is the directory from which the files are named.
///
/// # Errors
/// As [`crate::run`](fn@crate::run).
pub fn run_group(
    manifest: &Manifest,
    base: &Path,
    directory: &Path,
    options: &RunOptions,
    progress: &(dyn Fn(Progress) + Sync),
    go_on: &(dyn Fn() -> bool + Sync),
) -> Result<Outcome, StudyError> {
    let blocks = blocks(manifest);
    let record = RunRecord {
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
    let is_there = |i: &usize| part(directory, *i as u64, "estimates").exists();
    // What is chosen for all runs of a person in a condition comes before each of them.
    let is_cell = |i: &usize| matches!(blocks[*i], Block::Cell(_));
    let (cells, runs): (Vec<usize>, Vec<usize>) = (0..blocks.len()).filter(|i| !is_there(i)).partition(is_cell);
    let known = total - (cells.len() + runs.len()) as u64;
    let done = AtomicU64::new(known);
    let one = |&i: &usize| -> Result<bool, StudyError> {
        if !go_on() {
            return Ok(false);
        }
        let found = match &blocks[i] {
            Block::Run(run) => {
                let key = (run.subject.as_str(), run.condition.as_str());
                let of_run = |block: &Block<'_>| matches!(block, Block::Cell(cell) if cell.key() == key);
                let place = blocks.iter().position(of_run).unwrap_or(i) as u64;
                let read = |table: &str| hoid_io::read_table(&part(directory, place, table));
                let from_cell = FromCell::of(&read("estimates")?, &read(PEOPLE)?);
                analyse(manifest, base, run, &from_cell)
            }
            Block::Cell(cell) => analyse_together(manifest, base, cell),
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
    let finished = on_threads(options.jobs, &cells, one)? && on_threads(options.jobs, &runs, one)?;
    let estimates = done.load(Ordering::Relaxed) - known;
    if !finished {
        return Ok(Outcome {
            finished,
            estimates,
            tables: Vec::new(),
        });
    }
    join(manifest, base, &blocks, directory, options.csv)?;
    RunRecord {
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

/// SHA-256 of the manifest and of the files that count; the run of one that cannot be read says so.
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
fn prepare(manifest: &Manifest, directory: &Path, record: &RunRecord, resume: bool) -> Result<bool, StudyError> {
    let shown = || directory.display().to_string();
    if let Some(found) = RunRecord::read(directory)? {
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

const TABLES: [&str; 14] = [
    PEOPLE,
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
