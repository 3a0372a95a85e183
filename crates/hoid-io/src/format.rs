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
    Npz,
    Mat,
    /// One array, which is read only.
    Npy,
    /// Streams, which are read only.
    Xdf,
}

impl Format {
    const EXPECTED: &'static str = ".csv (also as .tsv or .txt), .parquet (also as .pq), .npz, .npy, .mat or .xdf";

    /// Its name for a person.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Csv { .. } => "CSV",
            Self::Parquet => "Parquet",
            Self::Npz => "NPZ",
            Self::Npy => "NPY",
            Self::Mat => "MATLAB",
            Self::Xdf => "XDF",
        }
    }

    /// Whether each column is one array, which says its length first.
    pub(crate) fn is_whole(self) -> bool {
        matches!(self, Self::Npz | Self::Mat)
    }

    /// What can be written.
    const WRITTEN: &'static str = ".csv (also as .tsv or .txt), .parquet (also as .pq), .npz or .mat";

    pub(crate) fn of(path: &Path) -> Result<Self, IoError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("csv" | "txt") => Ok(Self::Csv { separator: b',' }),
            Some("tsv") => Ok(Self::Csv { separator: b'\t' }),
            Some("parquet" | "pq") => Ok(Self::Parquet),
            Some("npz") => Ok(Self::Npz),
            Some("mat") => Ok(Self::Mat),
            Some("xdf") => Ok(Self::Xdf),
            Some("npy") => Ok(Self::Npy),
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
    let format = match known {
        Some(known) if known.is_dir() => Err(IoError::Directory {
            file: path.display().to_string(),
        }),
        Some(known) if !known.is_file() => Ok(Format::of(path).unwrap_or(Format::Csv { separator: b',' })),
        _ => Format::of(path),
    }?;
    let why = match format {
        Format::Npy => "the extension is .npy, a single array without names",
        Format::Xdf => "the extension is .xdf, the format of a recorder",
        format => return Ok(format),
    };
    Err(IoError::UnknownFormat {
        file: path.display().to_string(),
        found: why.to_owned(),
        expected: Format::WRITTEN,
    })
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
