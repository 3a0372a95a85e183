//! Analysis of a group in a directory: blocks are distributed over threads, stored as parts on disk, and finally joined
//! into the tables of the group.

use std::{
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
};

use hoid_io::DirectoryLock;
use sha2::{Digest, Sha256};

use super::{
    analysis::{CellResults, PEOPLE_TABLE, analyse, analyse_jointly},
    block::{Block, blocks},
    join::join,
    manifest::{MANIFEST_FILE, Manifest},
};
use crate::{
    RunOptions, StudyError,
    directory::{part_path, remove_parts, table_path, write_source},
    run::{Outcome, Progress, prepare_continuation, run_on_threads},
    run_record::RunRecord,
    seal::{BlockState, block_state, damage_notes, write_block},
};

/// Analyses the runs that the manifest marks with `counts`. File names are relative to `base`.
///
/// # Errors
/// Same as [`crate::run`](fn@crate::run).
pub fn run_group(
    manifest: &Manifest,
    base: &Path,
    directory: &Path,
    options: &RunOptions,
    progress: &(dyn Fn(Progress) + Sync),
    should_continue: &(dyn Fn() -> bool + Sync),
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
        sealed: true,
    };
    check_directory(manifest, base, directory)?;
    hoid_io::make_directory(directory)?;
    let _lock = DirectoryLock::take(directory)?;
    let found = prepare(manifest, directory, &record, options.resume)?;
    let tables = || table_paths(directory);
    if found.complete {
        return Ok(Outcome {
            finished: true,
            estimates: 0,
            tables: tables(),
            notes: Vec::new(),
        });
    }
    let total = blocks.len() as u64;
    let mut damaged = Vec::new();
    let open = (0..blocks.len()).filter(|i| match block_state(directory, &record.plan_sha256, *i as u64) {
        BlockState::Whole => false,
        BlockState::Missing => true,
        BlockState::Damaged(why) => {
            damaged.push((*i as u64, why));
            true
        }
    });
    // The joint analysis of all runs of a person in a condition is made first, because the analysis of each run uses
    // its results.
    let is_cell = |i: &usize| matches!(blocks[*i], Block::Cell(_));
    let (cells, runs): (Vec<usize>, Vec<usize>) = open.partition(is_cell);
    let notes: Vec<String> = found
        .missing_seals_note()
        .into_iter()
        .chain(damage_notes(&damaged))
        .collect();
    let known = total - (cells.len() + runs.len()) as u64;
    let done = AtomicU64::new(known);
    let one = |&i: &usize| -> Result<bool, StudyError> {
        if !should_continue() {
            return Ok(false);
        }
        let found = match &blocks[i] {
            Block::Run(run) => {
                let key = (run.subject.as_str(), run.condition.as_str());
                let of_run = |block: &Block<'_>| matches!(block, Block::Cell(cell) if cell.key() == key);
                let index = blocks.iter().position(of_run).unwrap_or(i) as u64;
                let read = |table: &str| hoid_io::read_table(&part_path(directory, index, table));
                let from_cell = CellResults::of(&read("estimates")?, &read(PEOPLE_TABLE)?);
                analyse(manifest, base, run, &from_cell)
            }
            Block::Cell(cell) => analyse_jointly(manifest, base, cell),
        };
        let mut all = vec![
            ("estimates", &found.estimates),
            ("traces", &found.traces),
            ("responses", &found.responses),
        ];
        all.extend(found.account.iter().map(|(table, rows)| (*table, rows)));
        write_block(directory, &record.plan_sha256, i as u64, &all)?;
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress(Progress {
            done,
            total,
            done_earlier: known,
        });
        Ok(true)
    };
    let finished = run_on_threads(options.jobs, &cells, one)? && run_on_threads(options.jobs, &runs, one)?;
    let estimates = done.load(Ordering::Relaxed) - known;
    if !finished {
        return Ok(Outcome {
            finished,
            estimates,
            tables: Vec::new(),
            notes,
        });
    }
    join(manifest, base, &blocks, directory, options.csv)?;
    RunRecord {
        complete: true,
        ..record.clone()
    }
    .write(directory)?;
    remove_parts(directory)?;
    Ok(Outcome {
        finished: true,
        estimates,
        tables: tables(),
        notes,
    })
}

/// True if the directory holds results of a group, even incomplete ones.
pub fn has_results(directory: &Path) -> bool {
    !matches!(RunRecord::read(directory), Ok(None))
}

/// Checks that no recording would be overwritten by the tables or parts.
fn check_directory(manifest: &Manifest, base: &Path, directory: &Path) -> Result<(), StudyError> {
    let files = manifest
        .runs
        .iter()
        .flat_map(|run| std::iter::once(&run.file).chain(&run.then));
    let files: Vec<PathBuf> = files.map(|file| base.join(file)).collect();
    let files: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
    for index in [directory.to_owned(), directory.join("parts")] {
        hoid_io::check_output_directory(&index, &files)?;
    }
    Ok(())
}

/// Returns the SHA-256 of the manifest and of the recordings that are analysed. A file that cannot be read counts as
/// empty here; the analysis of its run reports the error.
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

/// Prepares an empty directory, or checks the directory of earlier results and returns their record.
fn prepare(manifest: &Manifest, directory: &Path, record: &RunRecord, resume: bool) -> Result<RunRecord, StudyError> {
    let shown = || directory.display().to_string();
    if let Some(found) = RunRecord::read(directory)? {
        if !resume {
            return Err(StudyError::Occupied { directory: shown() });
        }
        if let Some(reason) = found.difference(record) {
            return Err(StudyError::OtherStudy {
                directory: shown(),
                reason: format!("{reason} (the checksum covers the manifest and its files)"),
            });
        }
        prepare_continuation(directory, &found, record)?;
        return Ok(found);
    }
    hoid_io::make_directory(&directory.join("parts"))?;
    write_source(&directory.join(MANIFEST_FILE), &manifest.text())?;
    record.write(directory)?;
    Ok(record.clone())
}

const TABLE_NAMES: [&str; 14] = [
    PEOPLE_TABLE,
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

fn table_paths(directory: &Path) -> Vec<PathBuf> {
    TABLE_NAMES
        .iter()
        .flat_map(|table| [false, true].map(|csv| table_path(directory, table, csv)))
        .filter(|path| path.exists())
        .collect()
}
