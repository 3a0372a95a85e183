//! The formats of files, by extension, here and nowhere else.

use std::fs;
use std::path::Path;

use crate::IoError;

/// A format of columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    /// The separator is the one to write; any is read.
    Csv {
        separator: u8,
    },
    Parquet,
}

impl Format {
    const EXPECTED: &'static str = ".csv (also as .tsv or .txt) or .parquet (also as .pq)";

    pub(crate) fn of(path: &Path) -> Result<Self, IoError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("csv" | "txt") => Ok(Self::Csv { separator: b',' }),
            Some("tsv") => Ok(Self::Csv { separator: b'\t' }),
            Some("parquet" | "pq") => Ok(Self::Parquet),
            other => Err(IoError::UnknownFormat {
                file: path.display().to_string(),
                found: other.map_or(String::from("there is no extension"), |e| {
                    format!("the extension is .{e}")
                }),
                expected: Self::EXPECTED,
            }),
        }
    }
}

/// The format of a file to write, which is no directory. A pipe or a device takes CSV under any other name.
pub(crate) fn format_to_write(path: &Path) -> Result<Format, IoError> {
    let known = fs::metadata(path).ok();
    match known {
        Some(known) if known.is_dir() => Err(IoError::Directory {
            file: path.display().to_string(),
        }),
        Some(known) if !known.is_file() => Ok(Format::of(path).unwrap_or(Format::Csv { separator: b',' })),
        _ => Format::of(path),
    }
}

/// The format of a file, and what is in it.
pub(crate) fn bytes_of(path: &Path) -> Result<(Format, Vec<u8>), IoError> {
    let file = || path.display().to_string();
    if path.is_dir() {
        return Err(IoError::Directory { file: file() });
    }
    let format = Format::of(path)?;
    let bytes = fs::read(path).map_err(|source| IoError::Unreadable { file: file(), source })?;
    Ok((format, bytes))
}
