//! Joining the shards of a study.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use crate::{
    Plan, StudyError,
    block::blocks,
    columns::Schemas,
    directory::{PLAN, part, tables, write_plan},
    join::join,
    run::Outcome,
    run_record::RunRecord,
};

/// Joins the shards of a study.
///
/// # Errors
/// [`StudyError::OtherStudy`] for shards of different plans, seeds or versions,
/// [`StudyError::Overlap`] and [`StudyError::Gap`] when blocks are there twice or not at all,
/// [`StudyError::NoStudy`] for a directory without one.
pub fn merge(shards: &[PathBuf], directory: &Path, csv: bool) -> Result<Outcome, StudyError> {
    let mut plan: Option<(Plan, RunRecord)> = None;
    let mut owners: BTreeMap<u64, &Path> = BTreeMap::new();
    for shard in shards {
        let manifest = RunRecord::read(shard)?.ok_or_else(|| StudyError::NoStudy {
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
        .differs(&RunRecord::of(&plan, blocks(&plan).len() as u64, None))
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
    if RunRecord::read(directory)?.is_some() {
        return Err(StudyError::Occupied {
            directory: directory.display().to_string(),
        });
    }
    hoid_io::make_directory(directory)?;
    write_plan(&plan, directory)?;
    let parts: Vec<(&Path, u64)> = owners.iter().map(|(block, shard)| (*shard, *block)).collect();
    join(&plan, &Schemas::of(&plan), &parts, directory, csv)?;
    RunRecord {
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
