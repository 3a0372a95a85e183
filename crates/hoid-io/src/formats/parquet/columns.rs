//! Columns as read, before conversion.

/// The key of the comments, one per line.
pub(super) const COMMENTS: &str = "hoid.comments";

/// The values of a column.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Data {
    Real(Vec<f64>),
    Signed(Vec<i64>),
    Unsigned(Vec<u64>),
    Text(Vec<String>),
    /// Clock times, or times of day, ns.
    Moments(Vec<i64>),
    /// Unsupported content, as text.
    Unread(&'static str),
}

/// A column as read.
#[derive(Debug)]
pub(super) struct ReadColumn {
    /// Its name; the parts of a path are joined by points.
    pub(super) name: String,
    /// Values of single precision.
    pub(super) single: bool,
    /// One value per row, undefined where it is missing.
    pub(super) data: Data,
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
