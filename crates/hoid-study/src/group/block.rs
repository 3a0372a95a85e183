//! Unit of analysis, which is stored as one part on disk: a single run, or all runs of a person in a condition.

use super::manifest::{Manifest, RunEntry};

/// All runs of a person in a condition.
pub(super) struct Cell<'a> {
    pub runs: Vec<&'a RunEntry>,
    /// Description of the change if the task changes within the runs; the cell then has no operator. Otherwise `None`.
    pub changes: Option<String>,
}

impl Cell<'_> {
    /// Returns the names of subject and condition.
    pub fn key(&self) -> (&str, &str) {
        (&self.runs[0].subject, &self.runs[0].condition)
    }
}

/// Unit of analysis, which is stored as one part on disk.
pub(super) enum Block<'a> {
    Run(&'a RunEntry),
    Cell(Cell<'a>),
}

/// Returns the runs that are analysed, followed by their cells.
pub(super) fn blocks(manifest: &Manifest) -> Vec<Block<'_>> {
    let runs: Vec<&RunEntry> = manifest.runs.iter().filter(|run| run.counts).collect();
    let mut cells: Vec<Cell<'_>> = Vec::new();
    for &run in &runs {
        let key = (run.subject.as_str(), run.condition.as_str());
        match cells.iter_mut().find(|cell| cell.key() == key) {
            Some(cell) => cell.runs.push(run),
            None => cells.push(Cell {
                runs: vec![run],
                changes: None,
            }),
        }
    }
    for cell in &mut cells {
        let change_s = manifest
            .conditions
            .get(cell.key().1)
            .and_then(|settings| settings.change_s);
        cell.changes = match (change_s, cell.runs.iter().any(|run| run.then.is_some())) {
            (Some(at), _) => Some(format!("the task changes within the runs, at {at} s")),
            (None, true) => Some("the task changes where the files are joined".to_owned()),
            (None, false) => None,
        };
    }
    runs.into_iter()
        .map(Block::Run)
        .chain(cells.into_iter().map(Block::Cell))
        .collect()
}
