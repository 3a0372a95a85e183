//! Recorded people: from a folder of runs to a group result.
//!
//! | module | what it holds |
//! |---|---|
//! | [`Manifest`] | which files belong to whom, and what is done with them |
//! | [`Pattern`] | subject, condition and run from names of files |
//! | `analysis` | what is done with one run |
//! | [`VirtualExperiment`] | the same from simulated people |
//! | `frequency` | describing functions by subject and condition |
//! | `averages` | means over the runs, chosen delays, averages of traces |
//!
//! Each run is a part on disk, as a block of a study is: a group that was stopped goes on, and of a run nothing stays in memory but its kept points of
//! traces until they are averaged, some 60 kB a run of 90 s.

mod analysis;
mod averages;
mod frequency;
mod manifest;
mod pattern;
mod virtual_people;

use std::{
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
};

use hoid_io::{TableSchema, TableWriter};
use rayon::prelude::*;
use sha2::{Digest, Sha256};

pub use manifest::{Analysis, ConditionFacts, Detrending, Manifest, MethodName, Reading, RunEntry};
pub use pattern::{Matched, Pattern};
pub use virtual_people::{Trouble, VirtualExperiment, simulate_group};

use crate::{
    RunOptions, StudyError,
    manifest::{Manifest as Record, part},
    run::{Outcome, Progress, remove_parts, sweep, table_path},
};
use averages::{Averages, Delays, TraceAverages};

/// Name of the copy of the manifest beside the results.
const MANIFEST: &str = "group.toml";

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
    let runs: Vec<&RunEntry> = manifest.runs.iter().filter(|run| run.counts).collect();
    let record = Record {
        hoid: env!("CARGO_PKG_VERSION").to_owned(),
        study: manifest.name.clone(),
        plan_sha256: hash(manifest, base),
        seed: 0,
        replications: 1,
        blocks: runs.len() as u64,
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
    let total = runs.len() as u64;
    let is_there = |i: usize| part(directory, i as u64, "estimates").exists();
    let open: Vec<usize> = (0..runs.len()).filter(|i| !is_there(*i)).collect();
    let known = total - open.len() as u64;
    let done = AtomicU64::new(known);
    let one = |&i: &usize| -> Result<bool, StudyError> {
        if !go_on() {
            return Ok(false);
        }
        let found = analysis::analyse(manifest, base, runs[i]);
        hoid_io::write_table(&part(directory, i as u64, "traces"), &found.traces)?;
        hoid_io::write_table(&part(directory, i as u64, "estimates"), &found.estimates)?;
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress(Progress { done, total, known });
        Ok(true)
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(options.jobs.unwrap_or(0))
        .build()
        .map_err(|error| StudyError::Threads {
            reason: error.to_string(),
        })?;
    let finished = pool
        .install(|| open.par_iter().map(one).collect::<Result<Vec<bool>, StudyError>>())?
        .into_iter()
        .all(|finished| finished);
    let estimates = done.load(Ordering::Relaxed) - known;
    if !finished {
        return Ok(Outcome {
            finished,
            estimates,
            tables: Vec::new(),
        });
    }
    join(manifest, base, runs.len(), directory, options.csv)?;
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

/// SHA-256 of the manifest and of the files that count; one that cannot be read is told by its run.
fn hash(manifest: &Manifest, base: &Path) -> String {
    let mut hasher = Sha256::new();
    hasher.update(manifest.text().as_bytes());
    for run in manifest.runs.iter().filter(|run| run.counts) {
        hasher.update(hoid_io::read_bytes(&base.join(&run.file)).unwrap_or_default());
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

const TABLES: [&str; 7] = [
    "estimates",
    "averages",
    "delays",
    "describing-functions",
    "frequency-margins",
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

/// Makes the tables from the parts: Parquet, and CSV beside it when it is asked for.
fn join(manifest: &Manifest, base: &Path, runs: usize, directory: &Path, csv: bool) -> Result<(), StudyError> {
    let nd = manifest.analysis.nd.1;
    let (mut averages, mut delays) = (Averages::default(), Delays::default());
    let names = analysis::trace_names(nd);
    let with_errors = names
        .iter()
        .cloned()
        .chain(names.iter().map(|name| format!("{name}_se")));
    let mut of_traces = TraceAverages::new(with_errors.collect());
    let formats: &[bool] = if csv { &[false, true] } else { &[false] };
    let writers = |table: &str, schema: &TableSchema| {
        let writer = |csv: &bool| TableWriter::create(&table_path(directory, table, *csv), schema);
        formats.iter().map(writer).collect::<Result<Vec<_>, _>>()
    };
    let mut estimates = writers("estimates", &analysis::estimates_schema())?;
    let mut traces = writers("traces", &analysis::traces_schema(nd))?;
    for run in 0..runs {
        let found = hoid_io::read_table(&part(directory, run as u64, "estimates"))?;
        averages.add(&found);
        delays.add(&found, run);
        estimates.iter_mut().try_for_each(|writer| writer.append(&found))?;
        let found = hoid_io::read_table(&part(directory, run as u64, "traces"))?;
        of_traces.add(&found);
        traces.iter_mut().try_for_each(|writer| writer.append(&found))?;
    }
    for writer in estimates.into_iter().chain(traces) {
        writer.finish()?;
    }
    let mut whole = vec![
        ("averages", averages.table()),
        ("delays", delays.table()),
        ("trace-averages", of_traces.table()),
    ];
    if let Some(found) = frequency::frequencies(manifest, base) {
        whole.extend([
            ("describing-functions", found.lines),
            ("frequency-margins", found.margins),
        ]);
    }
    for (name, table) in &whole {
        for csv in formats {
            hoid_io::write_table(&table_path(directory, name, *csv), table)?;
        }
    }
    Ok(())
}
