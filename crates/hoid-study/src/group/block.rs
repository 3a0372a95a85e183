//! What is analysed at once and is a part on disk: a run, or all runs of a person in a condition.

use std::collections::BTreeMap;

use super::manifest::{Manifest, RunEntry};

/// What is analysed at once and is a part on disk.
pub(super) enum Block<'a> {
    Run(&'a RunEntry),
    /// All runs of a person in a condition that does not change.
    Together(Vec<&'a RunEntry>),
}

/// The runs that count, and then those that are fitted together.
pub(super) fn blocks(manifest: &Manifest) -> Vec<Block<'_>> {
    let runs: Vec<&RunEntry> = manifest.runs.iter().filter(|run| run.counts).collect();
    let steady = |run: &&&RunEntry| {
        let facts = manifest.conditions.get(&run.condition);
        run.then.is_none() && facts.is_none_or(|facts| facts.change_s.is_none())
    };
    let mut together: BTreeMap<(&str, &str), Vec<&RunEntry>> = BTreeMap::new();
    for run in runs.iter().filter(steady) {
        together.entry((&run.subject, &run.condition)).or_default().push(run);
    }
    let together = together.into_values().filter(|runs| runs.len() > 1);
    runs.into_iter()
        .map(Block::Run)
        .chain(together.map(Block::Together))
        .collect()
}
