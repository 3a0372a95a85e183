//! Columns as read, before conversion.

/// Metadata key of the comments, one comment per line.
pub(super) const COMMENTS_KEY: &str = "hoid.comments";

/// The values of a column.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum ColumnData {
    Real(Vec<f64>),
    Signed(Vec<i64>),
    Unsigned(Vec<u64>),
    Text(Vec<String>),
    /// Clock times or times of day, in ns.
    Moments(Vec<i64>),
    /// Unsupported content, described in words.
    Unread(&'static str),
}

/// A column as read.
#[derive(Debug)]
pub(super) struct ReadColumn {
    /// Name of the column; the parts of a path are joined by points.
    pub(super) name: String,
    /// True if the values have single precision.
    pub(super) single: bool,
    /// One value per row; undefined in rows without a value.
    pub(super) data: ColumnData,
    /// Rows without a value, in increasing order.
    pub(super) nulls: Vec<usize>,
}

/// A file as read.
#[derive(Debug)]
pub(super) struct ReadFile {
    pub(super) columns: Vec<ReadColumn>,
    pub(super) rows: usize,
    /// The comment lines, stored under the key `hoid.comments`.
    pub(super) comments: Vec<String>,
}
