//! Execution of a study: distribution of the blocks over threads, parts on disk, and continuation of a stopped study.
//!
//! A finished block is written as one file per table, traces first. Each file is written under a temporary name in the
//! same directory and then renamed; the seal of the block follows last (`seal`). A killed study therefore has only
//! complete blocks, and it continues with the blocks that have no seal or do not match their seal. When all blocks are
//! complete, the parts are joined in the order of the plan. The result does not depend on the thread or machine that
//! computed a part.

use std::{
    path::{Path, PathBuf},
    sync::atomic::{AtomicBool, AtomicU64, Ordering},
};

use hoid_io::DirectoryLock;
use rayon::prelude::*;

use crate::{
    Plan, StudyError,
    block::{Block, blocks, run_block},
    columns::Schemas,
    directory::{remove_partial_files, remove_parts, table_paths, write_plan},
    estimate_rows::BlockTables,
    join::join,
    run_record::RunRecord,
    seal::{BlockState, block_state, damage_notes, write_block},
    shard::Shard,
};

/// Options of running a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RunOptions {
    /// Shard to run; `None` for the whole study.
    pub shard: Option<Shard>,
    /// Number of threads; `None` for one per core.
    pub jobs: Option<usize>,
    /// True if a stopped study is continued.
    pub resume: bool,
    /// True if the tables are written as CSV instead of Parquet.
    pub csv: bool,
}

/// Progress of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Completed estimates, including those of an earlier run.
    pub done: u64,
    /// Total number of estimates.
    pub total: u64,
    /// Estimates completed by an earlier run.
    pub done_earlier: u64,
}

/// Result of running a study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    /// True if all blocks of the study (or of its shard) are complete.
    pub finished: bool,
    /// Number of estimates made by this run.
    pub estimates: u64,
    /// Paths of the tables; empty for a shard, which must first be merged.
    pub tables: Vec<PathBuf>,
    /// Warnings about the directory: damaged blocks, which were computed again.
    pub notes: Vec<String>,
}

/// Runs a study in a directory. `progress` may be called from any thread, after each estimate. `should_continue` is
/// called before each estimate; if it returns false, the study stops and can be continued later.
///
/// # Errors
/// [`StudyError::Occupied`] if the directory holds a study and `resume` is not set, [`StudyError::OtherStudy`] if the
/// directory holds a different study, [`StudyError::SourceExists`] if it contains another plan, [`StudyError::Io`] if a
/// file cannot be written or another process uses the directory.
pub fn run(
    plan: &Plan,
    directory: &Path,
    options: &RunOptions,
    progress: &(dyn Fn(Progress) + Sync),
    should_continue: &(dyn Fn() -> bool + Sync),
) -> Result<Outcome, StudyError> {
    hoid_io::make_directory(directory)?;
    let _lock = DirectoryLock::take(directory)?;
    let all = blocks(plan);
    let manifest = RunRecord::of(plan, all.len() as u64, options.shard);
    let known = prepare(plan, directory, &manifest, options.resume)?;
    if known.complete {
        return Ok(Outcome {
            finished: true,
            estimates: 0,
            tables: table_paths(directory),
            notes: Vec::new(),
        });
    }
    let schemas = Schemas::of(plan);
    let estimates = |block: &Block| block.count * plan.estimators_of(&plan.cells[block.cell]).count() as u64;
    let mine: Vec<Block> = all
        .iter()
        .copied()
        .filter(|block| options.shard.is_none_or(|shard| shard.contains(block.index)))
        .collect();
    let mut notes: Vec<String> = known.missing_seals_note().into_iter().collect();
    let (there, open, damaged) = classify_blocks(directory, &manifest.plan_sha256, &mine);
    notes.extend(damage_notes(&damaged));
    let known: u64 = there.iter().map(estimates).sum();
    let total: u64 = mine.iter().map(estimates).sum();
    let done = AtomicU64::new(known);
    let report_progress = |n: u64| {
        let done = done.fetch_add(n, Ordering::Relaxed) + n;
        progress(Progress {
            done,
            total,
            done_earlier: known,
        });
    };
    // Once a block has been stopped, no further block is started.
    let stopped = AtomicBool::new(false);
    let one = |block: &Block| -> Result<bool, StudyError> {
        if stopped.load(Ordering::Relaxed) {
            return Ok(false);
        }
        let Some(tables) = run_block(plan, &schemas, block, &report_progress, should_continue) else {
            stopped.store(true, Ordering::Relaxed);
            return Ok(false);
        };
        write_tables(directory, &manifest.plan_sha256, block, &tables)?;
        Ok(true)
    };
    let finished = run_on_threads(options.jobs, &open, one)?;
    let estimates = done.load(Ordering::Relaxed) - known;
    if !finished || options.shard.is_some() {
        return Ok(Outcome {
            finished,
            estimates,
            tables: Vec::new(),
            notes,
        });
    }
    let parts: Vec<(&Path, u64)> = all.iter().map(|block| (directory, block.index)).collect();
    join(plan, &schemas, &parts, directory, options.csv)?;
    RunRecord {
        complete: true,
        ..manifest
    }
    .write(directory)?;
    remove_parts(directory)?;
    Ok(Outcome {
        finished: true,
        estimates,
        tables: table_paths(directory),
        notes,
    })
}

/// Writes the results of a block.
pub(crate) fn write_tables(
    directory: &Path,
    plan_sha256: &str,
    block: &Block,
    tables: &BlockTables,
) -> Result<(), StudyError> {
    let mut all = vec![("fits", &tables.fits)];
    all.extend(tables.traces.as_ref().map(|traces| ("traces", traces)));
    write_block(directory, plan_sha256, block.index, &all)
}

/// Returns the complete blocks, the blocks to be computed (including damaged ones), and the number of each damaged
/// block with the reason.
fn classify_blocks(
    directory: &Path,
    plan_sha256: &str,
    mine: &[Block],
) -> (Vec<Block>, Vec<Block>, Vec<(u64, String)>) {
    let (mut there, mut open, mut damaged) = (Vec::new(), Vec::new(), Vec::new());
    for block in mine {
        match block_state(directory, plan_sha256, block.index) {
            BlockState::Whole => there.push(*block),
            BlockState::Missing => open.push(*block),
            BlockState::Damaged(why) => {
                damaged.push((block.index, why));
                open.push(*block);
            }
        }
    }
    (there, open, damaged)
}

/// Prepares an empty directory, or checks the directory of an earlier run and returns its record.
fn prepare(plan: &Plan, directory: &Path, manifest: &RunRecord, resume: bool) -> Result<RunRecord, StudyError> {
    let shown = || directory.display().to_string();
    if let Some(found) = RunRecord::read(directory)? {
        if !resume {
            return Err(StudyError::Occupied { directory: shown() });
        }
        let other_shard = (found.shard != manifest.shard && !found.complete).then(|| {
            let of = |shard: Option<Shard>| shard.map_or("the whole study".to_owned(), |s| format!("shard {s}"));
            format!("it is {}, but this run is {}", of(found.shard), of(manifest.shard))
        });
        if let Some(reason) = found.difference(manifest).or(other_shard) {
            return Err(StudyError::OtherStudy {
                directory: shown(),
                reason,
            });
        }
        prepare_continuation(directory, &found, manifest)?;
        return Ok(found);
    }
    hoid_io::make_directory(&directory.join("parts"))?;
    write_plan(plan, directory)?;
    manifest.write(directory)?;
    Ok(manifest.clone())
}

/// Prepares a directory for continuation: removes partial output or, if the study is complete, all parts. An incomplete
/// directory of an earlier version, which wrote no seals, is marked as sealed, since all of its blocks are computed
/// again.
pub(crate) fn prepare_continuation(directory: &Path, found: &RunRecord, record: &RunRecord) -> Result<(), StudyError> {
    if found.complete {
        return remove_parts(directory);
    }
    remove_partial_files(&directory.join("parts"))?;
    if !found.sealed {
        record.write(directory)?;
    }
    Ok(())
}

/// Runs the open blocks on `jobs` threads, by default one per core. Returns true if all blocks were finished.
pub(crate) fn run_on_threads<T: Sync>(
    jobs: Option<usize>,
    open: &[T],
    one: impl Fn(&T) -> Result<bool, StudyError> + Sync + Send,
) -> Result<bool, StudyError> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(jobs.unwrap_or(0))
        .build()
        .map_err(|error| StudyError::Threads {
            reason: error.to_string(),
        })?;
    let finished = pool.install(|| open.par_iter().map(one).collect::<Result<Vec<bool>, StudyError>>())?;
    Ok(finished.into_iter().all(|finished| finished))
}
