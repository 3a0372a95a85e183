//! Merging of the shards of a study. A damaged block is computed again.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use hoid_io::DirectoryLock;

use crate::{
    Plan, StudyError,
    block::{blocks, run_block},
    columns::Schemas,
    directory::{PLAN_FILE, remove_parts, table_paths, write_plan},
    join::join,
    run::{Outcome, write_tables},
    run_record::RunRecord,
    seal::{BlockState, block_state, damage_notes},
};

/// Merges the shards of a study.
///
/// # Errors
/// [`StudyError::OtherStudy`] for shards of different plans, seeds or versions, [`StudyError::DuplicateBlock`] and
/// [`StudyError::MissingBlocks`] for duplicated and missing blocks, [`StudyError::NoStudy`] for a directory without a
/// study, [`StudyError::Unsealed`] for a directory whose blocks have no checksums.
pub fn merge(shards: &[PathBuf], directory: &Path, csv: bool) -> Result<Outcome, StudyError> {
    let mut plan: Option<(Plan, RunRecord)> = None;
    let mut owners: BTreeMap<u64, &Path> = BTreeMap::new();
    let mut damaged: Vec<(u64, String)> = Vec::new();
    for shard in shards {
        let manifest = RunRecord::read(shard)?.ok_or_else(|| StudyError::NoStudy {
            directory: shard.display().to_string(),
        })?;
        if !manifest.complete && !manifest.sealed {
            return Err(StudyError::Unsealed {
                directory: shard.display().to_string(),
            });
        }
        if manifest.complete {
            return Err(StudyError::Whole {
                directory: shard.display().to_string(),
            });
        }
        let first = match &plan {
            Some((_, first)) => first,
            None => {
                let found = Plan::read(&shard.join(PLAN_FILE))?.with_replications(manifest.replications)?;
                &plan.insert((found, manifest.clone())).1
            }
        };
        if let Some(reason) = first.difference(&manifest) {
            return Err(StudyError::OtherStudy {
                directory: shard.display().to_string(),
                reason,
            });
        }
        for block in 0..manifest.blocks {
            match block_state(shard, &manifest.plan_sha256, block) {
                BlockState::Missing => continue,
                BlockState::Whole => {}
                BlockState::Damaged(why) => damaged.push((block, why)),
            }
            if let Some(other) = owners.insert(block, shard) {
                return Err(StudyError::DuplicateBlock {
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
    let all = blocks(&plan);
    if manifest
        .difference(&RunRecord::of(&plan, all.len() as u64, None))
        .is_some()
    {
        return Err(StudyError::OtherStudy {
            directory: shards[0].display().to_string(),
            reason: format!(
                "it was made by hoid {}, but this is hoid {}",
                manifest.hoid,
                env!("CARGO_PKG_VERSION")
            ),
        });
    }
    let missing: Vec<u64> = (0..manifest.blocks)
        .filter(|block| !owners.contains_key(block))
        .collect();
    if let Some(first) = missing.first() {
        return Err(StudyError::MissingBlocks {
            missing: missing.len() as u64,
            blocks: manifest.blocks,
            first: *first,
            plan: plan.name,
        });
    }
    hoid_io::make_directory(directory)?;
    let _lock = DirectoryLock::take(directory)?;
    if RunRecord::read(directory)?.is_some() {
        return Err(StudyError::Occupied {
            directory: directory.display().to_string(),
        });
    }
    write_plan(&plan, directory)?;
    let schemas = Schemas::of(&plan);
    if !damaged.is_empty() {
        hoid_io::make_directory(&directory.join("parts"))?;
    }
    for (block, _) in &damaged {
        let block = &all[*block as usize];
        if let Some(tables) = run_block(&plan, &schemas, block, &|_| (), &|| true) {
            write_tables(directory, &manifest.plan_sha256, block, &tables)?;
        }
        owners.insert(block.index, directory);
    }
    let parts: Vec<(&Path, u64)> = owners.iter().map(|(block, shard)| (*shard, *block)).collect();
    join(&plan, &schemas, &parts, directory, csv)?;
    remove_parts(directory)?;
    RunRecord {
        complete: true,
        shard: None,
        ..manifest
    }
    .write(directory)?;
    Ok(Outcome {
        finished: true,
        estimates: plan.estimate_count(),
        tables: table_paths(directory),
        notes: damage_notes(&damaged),
    })
}
