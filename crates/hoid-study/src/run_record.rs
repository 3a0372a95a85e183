//! The file `study.json` in the directory of the results.
//!
//! It records which plan and which version of hoid produced the parts in a directory, and to which shard of the study
//! they belong. Two directories belong together if plan, number of replications, seed and version are equal.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::{Plan, Shard, StudyError};

/// The content of `study.json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct RunRecord {
    /// Version of hoid.
    pub hoid: String,
    pub study: String,
    pub plan_sha256: String,
    pub seed: u64,
    pub replications: u64,
    /// Number of blocks of the whole study.
    pub blocks: u64,
    pub shard: Option<Shard>,
    /// True once the tables have been written.
    pub complete: bool,
    /// True if the blocks have seals; earlier versions of hoid wrote none.
    #[serde(default)]
    pub sealed: bool,
}

const FILE_NAME: &str = "study.json";

impl RunRecord {
    pub fn of(plan: &Plan, blocks: u64, shard: Option<Shard>) -> Self {
        Self {
            hoid: env!("CARGO_PKG_VERSION").to_owned(),
            study: plan.name.clone(),
            plan_sha256: plan.hash(),
            seed: plan.seed,
            replications: plan.replications,
            blocks,
            shard,
            complete: false,
            sealed: true,
        }
    }

    /// Returns a note if the blocks in the directory have no seals.
    pub fn missing_seals_note(&self) -> Option<String> {
        let unsealed = !self.sealed && !self.complete;
        unsealed.then(|| {
            "the blocks had no checksums because an earlier version of hoid wrote them: all were recomputed".to_owned()
        })
    }

    /// Reads the record of a directory; `None` if the directory holds no study.
    pub fn read(directory: &Path) -> Result<Option<Self>, StudyError> {
        let path = directory.join(FILE_NAME);
        if !path.exists() {
            return Ok(None);
        }
        let text = hoid_io::read_text(&path)?;
        serde_json::from_str(&text)
            .map(Some)
            .map_err(|error| StudyError::Manifest {
                file: path.display().to_string(),
                reason: error.to_string(),
            })
    }

    pub fn write(&self, directory: &Path) -> Result<(), StudyError> {
        let text = serde_json::to_string_pretty(self).unwrap_or_default();
        let path = directory.join(FILE_NAME);
        Ok(hoid_io::write_atomically(&path, |file| writeln!(file, "{text}"))?)
    }

    /// Returns the difference that prevents two parts from being merged into one study; `None` if they match.
    pub fn difference(&self, other: &Self) -> Option<String> {
        // Settings that a user may have changed are compared first. Each of them also changes the hash of the plan, but
        // a different hash is less informative.
        let pairs = [
            ("hoid version", self.hoid.clone(), other.hoid.clone()),
            ("study", self.study.clone(), other.study.clone()),
            ("seed", self.seed.to_string(), other.seed.to_string()),
            (
                "replications",
                self.replications.to_string(),
                other.replications.to_string(),
            ),
            ("plan (sha256)", self.plan_sha256.clone(), other.plan_sha256.clone()),
            ("blocks", self.blocks.to_string(), other.blocks.to_string()),
        ];
        pairs
            .into_iter()
            .find(|(_, a, b)| a != b)
            .map(|(name, a, b)| format!("its {name} is {a}, but this run has {b}"))
    }
}
