//! Contents of a file of named arrays: values and their paths.

use super::array::Array;

/// Notation for the rows and columns of a matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Indexing {
    Matlab,
    Python,
}

/// Name of the array in which comments are stored as text.
pub(crate) const COMMENTS_ARRAY: &str = "hoid_comments";

/// First words of the description of a MATLAB object.
pub(crate) const OBJECT_PREFIX: &str = "an object of the class";

/// The value at a path.
#[derive(Debug, Clone)]
pub(crate) enum Value {
    Array(Array),
    Texts(Vec<String>),
    /// Unsupported content, described in words.
    Unread(String),
}

/// An entry of a file.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    /// Path of the entry, such as `e`, `data.run(3).e` or `c{2}`.
    pub(crate) path: String,
    /// Path of the enclosing structure, such as `data.run(3)`; empty at top level.
    pub(crate) parent: String,
    pub(crate) value: Value,
    /// Unit of the values; empty if unknown.
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

    /// Creates an entry in a structure, or at top level if the name of the structure is empty.
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
    /// Notes about the reading of the file, for the user.
    pub(crate) notes: Vec<String>,
    /// Notation for the rows and columns of a matrix.
    pub(crate) indexing: Indexing,
    /// True if each structure has its own times on a common clock, so that columns of different structures can be
    /// aligned.
    pub(crate) own_clocks: bool,
}

impl Contents {
    pub(crate) fn new(mut entries: Vec<Entry>, indexing: Indexing) -> Self {
        // Paths are printed and therefore must not contain terminal control characters.
        for text in entries
            .iter_mut()
            .flat_map(|entry| [&mut entry.path, &mut entry.parent])
        {
            text.retain(|c| !c.is_control());
        }
        let at = entries.iter().position(|entry| entry.path == COMMENTS_ARRAY);
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
