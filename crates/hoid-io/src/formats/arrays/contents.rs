//! Contents of a file of named arrays: paths with values.

use super::array::Array;

/// Notation of the lines of a matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Indexing {
    Matlab,
    Python,
}

/// Name under which comments are stored as text.
pub(crate) const COMMENTS: &str = "hoid_comments";

/// First words of the description of a MATLAB object.
pub(crate) const OBJECT: &str = "an object of the class";

/// Value of a path.
#[derive(Debug, Clone)]
pub(crate) enum Value {
    Array(Array),
    Texts(Vec<String>),
    /// Unsupported content, as text.
    Unread(String),
}

/// An entry of a file.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    /// Path, such as `e`, `data.run(3).e` or `c{2}`.
    pub(crate) path: String,
    /// The enclosing structure, such as `data.run(3)`; empty at top level.
    pub(crate) parent: String,
    pub(crate) value: Value,
    /// Unit; empty when unknown.
    pub(crate) unit: String,
}

impl Entry {
    /// Creates an entry at top level.
    pub(crate) fn new(path: impl Into<String>, value: Value) -> Self {
        Self {
            path: path.into(),
            parent: String::new(),
            value,
            unit: String::new(),
        }
    }

    /// Creates an entry in a structure, or at top level if the structure has no name.
    pub(crate) fn field(parent: &str, name: &str, value: Value) -> Self {
        let path = if parent.is_empty() {
            name.to_owned()
        } else {
            format!("{parent}.{name}")
        };
        Self {
            parent: parent.to_owned(),
            ..Self::new(path, value)
        }
    }
}

/// Contents of a file.
#[derive(Debug)]
pub(crate) struct Contents {
    pub(crate) entries: Vec<Entry>,
    /// Comment lines that hoid wrote with the columns.
    pub(crate) comments: Vec<String>,
    /// Notes on reading.
    pub(crate) notes: Vec<String>,
    /// Notation of the lines of a matrix.
    pub(crate) indexing: Indexing,
    /// True if each structure holds its own times on a common clock, so that its columns can be
    /// aligned with those of another.
    pub(crate) own_clocks: bool,
}

impl Contents {
    pub(crate) fn new(mut entries: Vec<Entry>, indexing: Indexing) -> Self {
        // Names are printed: they must not contain terminal control characters.
        for text in entries
            .iter_mut()
            .flat_map(|entry| [&mut entry.path, &mut entry.parent])
        {
            text.retain(|c| !c.is_control());
        }
        let at = entries.iter().position(|entry| entry.path == COMMENTS);
        let comments = match at.map(|at| entries.remove(at).value) {
            Some(Value::Texts(texts)) => texts,
            _ => Vec::new(),
        };
        Self {
            entries,
            comments,
            notes: Vec::new(),
            indexing,
            own_clocks: false,
        }
    }
}
