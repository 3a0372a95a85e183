//! The seal of a block on disk: hash of the plan, number of the block, and checksum of each of its tables.
//!
//! The seal of a block is written after its tables. A block is complete if its seal names this plan and this block and
//! each table has the checksum in the seal. This detects damaged disks, truncated files and misplaced blocks; such a
//! block is computed again. If a block has no seal, its process was stopped before the block was finished.

use std::{collections::BTreeMap, path::Path};

use hoid_io::OutputTable;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::{
    StudyError,
    directory::{part_path, seal_path},
};

/// The content of a seal file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Seal {
    plan_sha256: String,
    block: u64,
    /// SHA-256 of the file of each table, by name of the table.
    tables: BTreeMap<String, String>,
}

/// State of a block on disk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum BlockState {
    Whole,
    Missing,
    /// The content does not match the seal, for this reason.
    Damaged(String),
}

/// Writes the tables of a block and then its seal.
pub(crate) fn write_block(
    directory: &Path,
    plan_sha256: &str,
    block: u64,
    tables: &[(&str, &OutputTable)],
) -> Result<(), StudyError> {
    let mut sums = BTreeMap::new();
    for (name, table) in tables {
        let path = part_path(directory, block, name);
        hoid_io::write_table(&path, table)?;
        sums.insert((*name).to_owned(), sha256(&hoid_io::read_bytes(&path)?));
    }
    let seal = Seal {
        plan_sha256: plan_sha256.to_owned(),
        block,
        tables: sums,
    };
    let text = serde_json::to_string_pretty(&seal).unwrap_or_default();
    Ok(hoid_io::write_atomically(&seal_path(directory, block), |file| {
        writeln!(file, "{text}")
    })?)
}

/// Returns the state of a block on disk.
pub(crate) fn block_state(directory: &Path, plan_sha256: &str, block: u64) -> BlockState {
    let path = seal_path(directory, block);
    if !path.exists() {
        return BlockState::Missing;
    }
    let read = hoid_io::read_text(&path).ok();
    let Some(seal) = read.and_then(|text| serde_json::from_str::<Seal>(&text).ok()) else {
        return BlockState::Damaged("its seal cannot be read".to_owned());
    };
    if seal.block != block {
        return BlockState::Damaged(format!("it is block {}", seal.block));
    }
    if seal.plan_sha256 != plan_sha256 {
        return BlockState::Damaged("it is from another plan".to_owned());
    }
    for (table, sum) in &seal.tables {
        match hoid_io::read_bytes(&part_path(directory, block, table)) {
            Ok(bytes) if sha256(&bytes) == *sum => {}
            Ok(_) => return BlockState::Damaged(format!("its table {table} was changed after it was written")),
            Err(_) => return BlockState::Damaged(format!("its table {table} cannot be read")),
        }
    }
    BlockState::Whole
}

/// Returns the SHA-256 of some bytes in hexadecimal digits.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Maximum number of damaged blocks that are reported individually.
const MAX_LISTED_BLOCKS: usize = 5;

/// Returns notes on damaged blocks, which are computed again.
pub(crate) fn damage_notes(damaged: &[(u64, String)]) -> Vec<String> {
    let mut notes: Vec<String> = damaged
        .iter()
        .take(MAX_LISTED_BLOCKS)
        .map(|(block, why)| format!("block {block} is damaged ({why}) and was recomputed"))
        .collect();
    if damaged.len() > MAX_LISTED_BLOCKS {
        notes.push(format!(
            "further damaged blocks ({}) were also recomputed",
            damaged.len() - MAX_LISTED_BLOCKS
        ));
    }
    notes
}

#[cfg(test)]
mod tests {
    use std::fs;

    use hoid_io::{ColumnValues, OutputColumn};

    use super::*;

    #[test]
    fn any_changed_byte_damages_a_block() {
        let dir = tempfile::tempdir().unwrap();
        let d = dir.path();
        fs::create_dir(d.join("parts")).unwrap();
        let table = |value: f64| OutputTable {
            comments: Vec::new(),
            columns: vec![OutputColumn {
                name: "x".into(),
                values: ColumnValues::Real(vec![value; 3]),
            }],
        };
        assert_eq!(block_state(d, "plan", 0), BlockState::Missing);
        write_block(d, "plan", 0, &[("fits", &table(1.0)), ("traces", &table(2.0))]).unwrap();
        write_block(d, "plan", 1, &[("fits", &table(3.0))]).unwrap();
        assert_eq!(block_state(d, "plan", 0), BlockState::Whole);
        assert_eq!(block_state(d, "plan", 1), BlockState::Whole);
        assert_eq!(
            block_state(d, "other", 1),
            BlockState::Damaged("it is from another plan".into())
        );
        let path = part_path(d, 0, "fits");
        let good = fs::read(&path).unwrap();
        for at in 0..good.len() {
            let mut bad = good.clone();
            bad[at] ^= 1;
            fs::write(&path, bad).unwrap();
            assert!(matches!(block_state(d, "plan", 0), BlockState::Damaged(_)), "{at}");
        }
        fs::write(&path, &good[..good.len() - 1]).unwrap();
        assert!(matches!(block_state(d, "plan", 0), BlockState::Damaged(_)));
        fs::remove_file(&path).unwrap();
        assert!(matches!(block_state(d, "plan", 0), BlockState::Damaged(_)));
        fs::write(&path, good).unwrap();
        assert_eq!(block_state(d, "plan", 0), BlockState::Whole);
        // Block 1 is replaced by block 0, including its seal.
        for (from, to) in [
            (part_path(d, 0, "fits"), part_path(d, 1, "fits")),
            (seal_path(d, 0), seal_path(d, 1)),
        ] {
            fs::copy(from, to).unwrap();
        }
        assert_eq!(block_state(d, "plan", 1), BlockState::Damaged("it is block 0".into()));
    }

    #[test]
    fn many_damaged_blocks_are_counted() {
        let all: Vec<(u64, String)> = (0..9).map(|block| (block, "cut".to_owned())).collect();
        assert_eq!(damage_notes(&all).len(), MAX_LISTED_BLOCKS + 1);
        assert!(damage_notes(&[]).is_empty());
    }
}
