//! Shards: parts of a study that run separately.

use serde::{Deserialize, Serialize};

use crate::StudyError;

/// A shard of a study: part `index` of `of`, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Index of the shard.
    pub index: u64,
    /// Number of shards.
    pub of: u64,
}

impl std::str::FromStr for Shard {
    type Err = StudyError;

    /// Parses `I/N` with `1 <= I <= N`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let parts = text.split_once('/').map(|(i, n)| (i.trim().parse(), n.trim().parse()));
        match parts {
            Some((Ok(index), Ok(of))) if index >= 1 && index <= of => Ok(Self { index, of }),
            _ => Err(StudyError::BadShard { found: text.to_owned() }),
        }
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

impl Shard {
    /// True if a block belongs to the shard. Blocks are assigned to the shards in turn, so that all shards take about
    /// the same time.
    pub(crate) fn contains(self, block: u64) -> bool {
        block % self.of == self.index - 1
    }
}
