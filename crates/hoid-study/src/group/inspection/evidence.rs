//! Evidence, found in the files of a group, for single lines of its manifest.

/// Evidence for the line of the manifest that starts with `key`, in the table `table`.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Table of the manifest, such as `[read]`; empty for the keys above the first table.
    pub table: String,
    /// Key in that table; empty if the evidence concerns the table as a whole.
    pub key: &'static str,
    /// Text of the evidence.
    pub text: String,
}

impl Evidence {
    pub(super) fn new(table: impl Into<String>, key: &'static str, words: impl Into<String>) -> Self {
        Self {
            table: table.into(),
            key,
            text: words.into(),
        }
    }
}
