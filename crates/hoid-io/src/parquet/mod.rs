//! Apache Parquet (<https://parquet.apache.org/docs/file-format/>) by the crate `parquet`, as far as flat tables need it.
//!
//! | module | what it holds |
//! |---|---|
//! | `read` | [`read`]: the columns of a file of any program |
//! | `write` | [`Writer`]: row groups as they come |

mod read;
mod write;

pub(crate) use read::read;
pub(crate) use write::Writer;

/// The key of the comments, one a line.
const COMMENTS: &str = "hoid.comments";

/// The values of a column.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Data {
    Real(Vec<f64>),
    Signed(Vec<i64>),
    Unsigned(Vec<u64>),
    Text(Vec<String>),
    /// What is not read, in words.
    Unread(&'static str),
}

/// A column as it was read.
#[derive(Debug)]
pub(crate) struct ReadColumn {
    /// Its name; the parts of a path are joined by points.
    pub(crate) name: String,
    /// Values of single precision.
    pub(crate) single: bool,
    /// One value a row, of no meaning where there is none.
    pub(crate) data: Data,
    /// Rows without a value, in increasing order.
    pub(crate) nulls: Vec<usize>,
}

/// A file as it was read.
#[derive(Debug)]
pub(crate) struct ReadFile {
    pub(crate) columns: Vec<ReadColumn>,
    pub(crate) rows: usize,
    /// The lines under the key `hoid.comments`.
    pub(crate) comments: Vec<String>,
}
