//! Findings in the files of a group, for the line of the manifest that it belongs to.

/// The findings, for the line of the manifest that starts with `key`: below the table `table`.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Table of the manifest, as `[read]`; empty for its head.
    pub table: String,
    /// Key in that table; empty for the table itself.
    pub key: &'static str,
    /// The findings, and how.
    pub words: String,
}

impl Evidence {
    pub(super) fn new(table: impl Into<String>, key: &'static str, words: impl Into<String>) -> Self {
        Self {
            table: table.into(),
            key,
            words: words.into(),
        }
    }
}
