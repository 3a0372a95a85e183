//! The page about a group: the manifest, the tables, and the selected subjects.

use hoid_study::group::{GroupSummary, Manifest};

use super::tables::GroupTables;

/// Contents of the page about a group.
#[derive(Debug)]
pub struct GroupReport<'a> {
    /// Manifest of the group.
    pub manifest: &'a Manifest,
    /// Failures, people and the overall verdict.
    pub summary: &'a GroupSummary,
    /// Tables of results.
    pub tables: GroupTables<'a>,
    /// Inputs and processing, as pairs of name and value.
    pub settings: Vec<(String, String)>,
    /// The only subject of the page; `None` for all subjects.
    pub subject: Option<&'a str>,
}

impl GroupReport<'_> {
    /// True if the page shows this subject.
    pub(super) fn shows(&self, subject: &str) -> bool {
        self.subject.is_none_or(|only| only == subject)
    }

    /// The subjects and the conditions, in the order of the manifest.
    pub(super) fn subjects_and_conditions(&self) -> (Vec<&str>, Vec<&str>) {
        let (mut subjects, mut conditions): (Vec<&str>, Vec<&str>) = (Vec::new(), Vec::new());
        for run in self
            .manifest
            .runs
            .iter()
            .filter(|run| run.counts && self.shows(&run.subject))
        {
            if !subjects.contains(&run.subject.as_str()) {
                subjects.push(&run.subject);
            }
            if !conditions.contains(&run.condition.as_str()) {
                conditions.push(&run.condition);
            }
        }
        (subjects, conditions)
    }
}

/// Creates an id from a prefix and a name.
pub(super) fn id_of(what: &str, name: &str) -> String {
    format!("{what}-{}", name.replace(|c: char| !c.is_ascii_alphanumeric(), "-"))
}
