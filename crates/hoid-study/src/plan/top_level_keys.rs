//! The keys of a plan above its tables, and the table `[keep]`.

use schemars::JsonSchema;
use serde::Deserialize;

/// The keys of a plan above its tables.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Head {
    /// Name of the study: letters, digits, - and _.
    pub name: String,
    /// Description in one line.
    #[serde(default)]
    pub title: String,
    /// Content of the study, or notes on it.
    #[serde(default)]
    pub description: String,
    /// Seed of the random streams. Default 1.
    #[serde(default = "default_one")]
    pub seed: u64,
    /// Number of replications of each cell.
    pub replications: u64,
    /// Number of replications that are run and stored together. A stopped study loses at most this many replications
    /// per thread. Default 50.
    #[serde(default = "default_block")]
    pub block: u64,
    /// Data to store.
    #[serde(default)]
    pub keep: Keep,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Keep {
    /// Number of samples from one stored point of a trace to the next. Default: no traces are stored.
    pub trace_every: Option<usize>,
    /// Whether the points of each trace are stored, or only the summary over replications. Default true.
    pub trace_points: bool,
    /// Whether standard errors are stored. Default true.
    pub standard_errors: bool,
    /// Whether to measure, for recursions, the bias before and after a change, the coverage of the bands and the
    /// declared changes. Default false.
    pub changes: bool,
}

impl Default for Keep {
    fn default() -> Self {
        Self {
            trace_every: None,
            trace_points: true,
            standard_errors: true,
            changes: false,
        }
    }
}

fn default_one() -> u64 {
    1
}

fn default_block() -> u64 {
    50
}
