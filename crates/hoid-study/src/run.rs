//! Running a study: blocks over threads, parts on disk, resume, merge.
//!
//! A block is written as one file a table when it is finished, traces first, beside its place and then renamed. A study that was
//! killed therefore has whole blocks and nothing else, and goes on with the blocks that have no file of fits. When all blocks are
//! there, the parts are joined in the order of the plan; which thread or machine made a part does not show.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
};

use hoid_io::{IoError, TableWriter};
use rayon::prelude::*;

use crate::{
    Plan, StudyError,
    block::{Block, blocks, run_block},
    columns::Schemas,
    manifest::{Manifest, PLAN, Shard, part},
    summary::{self, PartsOfCell},
    truth::cells_table,
};

/// How a study is run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RunOptions {
    /// A shard of the study; none for all.
    pub shard: Option<Shard>,
    /// Threads; none for one a core.
    pub jobs: Option<usize>,
    /// Go on with a study that was stopped.
    pub resume: bool,
    /// Write the tables as CSV instead of Parquet.
    pub csv: bool,
}

/// How far a study is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Estimates that are done, those of an earlier run included.
    pub done: u64,
    /// Estimates in all.
    pub total: u64,
    /// Estimates that an earlier run had done.
    pub known: u64,
}

/// What a run has left behind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    /// True when all blocks of the study (or of its shard) are there.
    pub finished: bool,
    /// Estimates made by this run.
    pub estimates: u64,
    /// The tables; empty for a shard, which waits to be merged.
    pub tables: Vec<PathBuf>,
}

/// Runs a study into a directory. `progress` is called from any thread after each estimate; `go_on` is asked before each
/// estimate, and what it stops can be resumed.
///
/// # Errors
/// [`StudyError::Occupied`] when the directory holds a study without `resume`, [`StudyError::OtherStudy`] when it is
/// another one, [`StudyError::Io`] when a file cannot be written.
pub fn run(
    plan: &Plan,
    directory: &Path,
    options: &RunOptions,
    progress: &(dyn Fn(Progress) + Sync),
    go_on: &(dyn Fn() -> bool + Sync),
) -> Result<Outcome, StudyError> {
    let all = blocks(plan);
    let manifest = Manifest::of(plan, all.len() as u64, options.shard);
    let known = prepare(plan, directory, &manifest, options.resume)?;
    if known.complete {
        return Ok(Outcome {
            finished: true,
            estimates: 0,
            tables: tables(directory),
        });
    }
    let schemas = Schemas::of(plan);
    let estimates = |block: &Block| block.count * plan.estimators_of(&plan.cells[block.cell]).count() as u64;
    let mine: Vec<Block> = all
        .iter()
        .copied()
        .filter(|block| options.shard.is_none_or(|shard| shard.has(block.index)))
        .collect();
    let (there, open): (Vec<Block>, Vec<Block>) = mine
        .iter()
        .copied()
        .partition(|block| part(directory, block.index, "fits").exists());
    let known: u64 = there.iter().map(estimates).sum();
    let total: u64 = mine.iter().map(estimates).sum();
    let done = AtomicU64::new(known);
    let tell = |n: u64| {
        let done = done.fetch_add(n, Ordering::Relaxed) + n;
        progress(Progress { done, total, known });
    };
    let one = |block: &Block| -> Result<bool, StudyError> {
        let Some(tables) = run_block(plan, &schemas, block, &tell, go_on) else {
            return Ok(false);
        };
        if let Some(traces) = &tables.traces {
            hoid_io::write_table(&part(directory, block.index, "traces"), traces)?;
        }
        hoid_io::write_table(&part(directory, block.index, "fits"), &tables.fits)?;
        Ok(true)
    };
    let finished = on_threads(options.jobs, &open, one)?;
    let estimates = done.load(Ordering::Relaxed) - known;
    if !finished || options.shard.is_some() {
        return Ok(Outcome {
            finished,
            estimates,
            tables: Vec::new(),
        });
    }
    let parts: Vec<(&Path, u64)> = all.iter().map(|block| (directory, block.index)).collect();
    join(plan, &schemas, &parts, directory, options.csv)?;
    Manifest {
        complete: true,
        ..manifest
    }
    .write(directory)?;
    remove_parts(directory)?;
    Ok(Outcome {
        finished: true,
        estimates,
        tables: tables(directory),
    })
}

/// Joins the shards of a study.
///
/// # Errors
/// [`StudyError::OtherStudy`] for shards of different plans, seeds or versions, [`StudyError::Overlap`] and [`StudyError::Gap`] when
/// blocks are there twice or not at all, [`StudyError::NoStudy`] for a directory without one.
pub fn merge(shards: &[PathBuf], directory: &Path, csv: bool) -> Result<Outcome, StudyError> {
    let mut plan: Option<(Plan, Manifest)> = None;
    let mut owners: BTreeMap<u64, &Path> = BTreeMap::new();
    for shard in shards {
        let manifest = Manifest::read(shard)?.ok_or_else(|| StudyError::NoStudy {
            directory: shard.display().to_string(),
        })?;
        if manifest.complete {
            return Err(StudyError::Whole {
                directory: shard.display().to_string(),
            });
        }
        let first = match &plan {
            Some((_, first)) => first,
            None => {
                let found = Plan::read(&shard.join(PLAN))?.with_replications(manifest.replications)?;
                &plan.insert((found, manifest.clone())).1
            }
        };
        if let Some(reason) = first.differs(&manifest) {
            return Err(StudyError::OtherStudy {
                directory: shard.display().to_string(),
                reason,
            });
        }
        for block in 0..manifest.blocks {
            if !part(shard, block, "fits").exists() {
                continue;
            }
            if let Some(other) = owners.insert(block, shard) {
                return Err(StudyError::Overlap {
                    block,
                    first: other.display().to_string(),
                    second: shard.display().to_string(),
                });
            }
        }
    }
    let Some((plan, manifest)) = plan else {
        return Err(StudyError::NoStudy {
            directory: String::new(),
        });
    };
    if manifest
        .differs(&Manifest::of(&plan, blocks(&plan).len() as u64, None))
        .is_some()
    {
        return Err(StudyError::OtherStudy {
            directory: shards[0].display().to_string(),
            reason: format!(
                "it was made by hoid {}, this is {}",
                manifest.hoid,
                env!("CARGO_PKG_VERSION")
            ),
        });
    }
    let missing: Vec<u64> = (0..manifest.blocks)
        .filter(|block| !owners.contains_key(block))
        .collect();
    if let Some(first) = missing.first() {
        return Err(StudyError::Gap {
            missing: missing.len() as u64,
            blocks: manifest.blocks,
            first: *first,
            plan: plan.name,
        });
    }
    if Manifest::read(directory)?.is_some() {
        return Err(StudyError::Occupied {
            directory: directory.display().to_string(),
        });
    }
    hoid_io::make_directory(directory)?;
    write_plan(&plan, directory)?;
    let parts: Vec<(&Path, u64)> = owners.iter().map(|(block, shard)| (*shard, *block)).collect();
    join(&plan, &Schemas::of(&plan), &parts, directory, csv)?;
    Manifest {
        complete: true,
        shard: None,
        ..manifest
    }
    .write(directory)?;
    Ok(Outcome {
        finished: true,
        estimates: plan.estimates(),
        tables: tables(directory),
    })
}

/// Makes the directory ready, or finds what it holds.
fn prepare(plan: &Plan, directory: &Path, manifest: &Manifest, resume: bool) -> Result<Manifest, StudyError> {
    let shown = || directory.display().to_string();
    if let Some(found) = Manifest::read(directory)? {
        if !resume {
            return Err(StudyError::Occupied { directory: shown() });
        }
        let other_shard = (found.shard != manifest.shard && !found.complete).then(|| {
            let of = |shard: Option<Shard>| shard.map_or("the whole study".to_owned(), |s| format!("shard {s}"));
            format!("{} there, {} here", of(found.shard), of(manifest.shard))
        });
        if let Some(reason) = found.differs(manifest).or(other_shard) {
            return Err(StudyError::OtherStudy {
                directory: shown(),
                reason,
            });
        }
        sweep(&directory.join("parts"))?;
        return Ok(found);
    }
    hoid_io::make_directory(&directory.join("parts"))?;
    write_plan(plan, directory)?;
    manifest.write(directory)?;
    Ok(manifest.clone())
}

fn write_plan(plan: &Plan, directory: &Path) -> Result<(), StudyError> {
    let text = plan.text();
    Ok(hoid_io::write_atomically(&directory.join(PLAN), |file| {
        file.write_all(text.as_bytes())
    })?)
}

/// Removes what a killed run was writing: everything in `parts` that has not got its name yet.
pub(crate) fn sweep(parts: &Path) -> Result<(), StudyError> {
    hoid_io::make_directory(parts)?;
    let unwritable = |source| IoError::Unwritable {
        file: parts.display().to_string(),
        source,
    };
    for entry in fs::read_dir(parts).map_err(unwritable)? {
        let path = entry.map_err(unwritable)?.path();
        if path.extension().is_none_or(|extension| extension != "parquet") || is_hidden(&path) {
            fs::remove_file(&path).map_err(unwritable)?;
        }
    }
    Ok(())
}

fn is_hidden(path: &Path) -> bool {
    path.file_name()
        .is_some_and(|name| name.to_string_lossy().starts_with('.'))
}

pub(crate) fn remove_parts(directory: &Path) -> Result<(), StudyError> {
    let parts = directory.join("parts");
    fs::remove_dir_all(&parts).map_err(|source| {
        StudyError::Io(IoError::Unwritable {
            file: parts.display().to_string(),
            source,
        })
    })
}

pub(crate) fn table_path(directory: &Path, table: &str, csv: bool) -> PathBuf {
    directory.join(format!("{table}.{}", if csv { "csv" } else { "parquet" }))
}

/// The tables that are there.
fn tables(directory: &Path) -> Vec<PathBuf> {
    let all = ["cells", "fits", "summary", "traces", "trace-summary"]
        .into_iter()
        .flat_map(|table| [false, true].map(|csv| table_path(directory, table, csv)));
    all.filter(|path| path.exists()).collect()
}

/// Makes the tables of a study from its parts, in the order of the blocks.
fn join(plan: &Plan, schemas: &Schemas, parts: &[(&Path, u64)], directory: &Path, csv: bool) -> Result<(), StudyError> {
    let all = blocks(plan);
    let mut of_cell = PartsOfCell::new();
    for (from, block) in parts {
        of_cell
            .entry(all[*block as usize].cell)
            .or_default()
            .push((*from, *block));
    }
    hoid_io::write_table(&table_path(directory, "cells", csv), &cells_table(plan))?;
    let medians = summary::write_traces(plan, schemas, &of_cell, &table_path(directory, "trace-summary", csv))?;
    summary::write_fits(
        plan,
        schemas,
        &of_cell,
        &medians,
        &table_path(directory, "summary", csv),
    )?;
    let points = schemas.traces.as_ref().filter(|_| plan.trace_points);
    for (table, schema) in [("fits", Some(&schemas.fits)), ("traces", points)] {
        let Some(schema) = schema else { continue };
        let mut writer = TableWriter::create(&table_path(directory, table, csv), schema)?;
        for (from, block) in parts {
            writer.append(&hoid_io::read_table(&part(from, *block, table))?)?;
        }
        writer.finish()?;
    }
    Ok(())
}

/// Does what is open on so many threads, or on all; true when each was finished.
pub(crate) fn on_threads<T: Sync>(
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
