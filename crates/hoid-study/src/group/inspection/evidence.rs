//! Evidence from the files of a group for lines of its manifest.

/// Evidence for the line of the manifest that starts with `key`, in the table `table`.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Table of the manifest, such as `[read]`; empty for its head.
    pub table: String,
    /// Key in that table; empty for the table itself.
    pub key: &'static str,
    /// The evidence as text.
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
