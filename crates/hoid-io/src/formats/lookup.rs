//! Choice of the file format by extension, and the known extensions.

use std::fs;
use std::io::{self, Read};
use std::path::Path;

use flate2::read::MultiGzDecoder;

use super::format::{Format, FormatWriter, with_time_and_selection};
use super::{FORMATS, bids, csv, gzip};
use crate::IoError;
use crate::record::ReadOptions;
use crate::table::Table;

/// Returns the extensions of the files that can be read, for help texts and messages:
/// `.csv (also as .txt), .tsv, ... or .xdf`.
#[must_use]
pub fn readable_extensions() -> String {
    extensions(FORMATS)
}

/// Returns the extensions of the files that can be written, for help texts and messages.
#[must_use]
pub fn writable_extensions() -> String {
    let written: Vec<&Format> = FORMATS.iter().copied().filter(|format| format.is_written()).collect();
    extensions(&written)
}

/// Lists the extensions of some formats as text.
fn extensions(formats: &[&Format]) -> String {
    let of_one = |format: &&Format| {
        let dotted: Vec<String> = format.extensions.iter().map(|ending| format!(".{ending}")).collect();
        match dotted.as_slice() {
            [first, others @ ..] if !others.is_empty() => format!("{first} (also as {})", others.join(" or ")),
            all => all.concat(),
        }
    };
    let all: Vec<String> = formats.iter().map(of_one).collect();
    match all.as_slice() {
        [others @ .., last] if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        all => all.concat(),
    }
}

/// Remedies for files of other programs, by extension. In Python, `pyhoid.read` reads the formats with the remedy
/// `PYTHON_REMEDY`.
const UNSUPPORTED_FORMAT_REMEDIES: [(&[&str], &str); 12] = [
    (&["gz", "zip", "bz2", "xz", "zst"], "unpack it first"),
    (&["arrow", "feather", "ipc", "xlsx", "xls", "ods"], PYTHON_REMEDY),
    (
        &["mcap"],
        "read its topics with the Python package mcap and make a pyhoid.Record from them",
    ),
    (
        &["bag", "db3"],
        "read its topics with the Python package rosbags and make a pyhoid.Record from them",
    ),
    (
        &["edf"],
        "read it with the Python package pyedflib or mne and make a pyhoid.Record from it",
    ),
    (
        &["bdf"],
        "read it with the Python package mne and make a pyhoid.Record from it",
    ),
    (
        &["c3d"],
        "read it with the Python package ezc3d and make a pyhoid.Record from it",
    ),
    (
        &["tdms"],
        "read it with the Python package nptdms and make a pyhoid.Record from it",
    ),
    (
        &["mf4"],
        "read it with the Python package asammdf and make a pyhoid.Record from it",
    ),
    (
        &["sav"],
        "read it with pandas.read_spss and pass the table to pyhoid.Record.from_pandas",
    ),
    (&["rds", "rda"], "write it as CSV or Parquet in R"),
    (&["mlx", "slx"], "save the variables in MATLAB: save run1.mat e u t"),
];
/// The remedy for files that pyhoid reads.
const PYTHON_REMEDY: &str = "save it as CSV or Parquet, or read it in Python with pyhoid.read";

/// Returns the extension of a file in lower case.
fn extension_of(path: &Path) -> Option<String> {
    path.extension().map(|ending| ending.to_string_lossy().to_lowercase())
}

/// Returns the format that corresponds to the extension of a file.
fn format_of(path: &Path) -> Option<&'static Format> {
    let ending = extension_of(path)?;
    FORMATS
        .iter()
        .copied()
        .find(|format| format.extensions.contains(&ending.as_str()))
}

/// Returns the error for an extension that belongs to no format, with the `expected` extensions and, if there is one,
/// the remedy.
fn unknown_format_error(path: &Path, expected: String, remedy: Option<&str>) -> IoError {
    IoError::UnknownFormat {
        file: path.display().to_string(),
        found: extension_of(path).map_or(String::from("the name has no extension"), |ending| {
            format!(".{ending} is not the extension of a record format")
        }),
        expected,
        remedy: remedy.map_or_else(String::new, |remedy| format!("; {remedy}")),
    }
}

/// Returns the error for a file that will be read and whose extension belongs to no format.
fn unreadable_format_error(path: &Path) -> IoError {
    let ending = extension_of(path).unwrap_or_default();
    let elsewhere = UNSUPPORTED_FORMAT_REMEDIES
        .iter()
        .find(|(endings, _)| endings.contains(&ending.as_str()));
    unknown_format_error(path, readable_extensions(), elsewhere.map(|(_, remedy)| *remedy))
}

/// Returns the format of a file that will be read: the format of its extension, or text if the extension belongs to no
/// format and the file starts with a table. Many programs write text files with the extension `.dat` or `.log`, or
/// without an extension.
fn format_to_read(path: &Path) -> Result<&'static Format, IoError> {
    let inner = gzip::path_without_gz(path);
    match format_of(inner.as_deref().unwrap_or(path)) {
        // Binary formats compress their columns themselves.
        Some(format) if inner.is_none() || format.name == csv::CSV.name => Ok(format),
        None if starts_with_table(path, inner.is_some()) => Ok(&csv::CSV),
        _ => Err(unreadable_format_error(path)),
    }
}

/// Number of bytes at the start of a file from which a table is recognised.
const PROBE_BYTES: u64 = 64 << 10;

/// True if a file, which may be packed, starts with a table of text. Pipes are not read, because the bytes read would
/// be lost.
fn starts_with_table(path: &Path, is_packed: bool) -> bool {
    let read = || -> io::Result<Vec<u8>> {
        let mut start = Vec::new();
        let file = fs::File::open(path)?;
        if !file.metadata()?.is_file() {
            return Ok(start);
        }
        if is_packed {
            MultiGzDecoder::new(file).take(PROBE_BYTES).read_to_end(&mut start)?;
        } else {
            file.take(PROBE_BYTES).read_to_end(&mut start)?;
        }
        Ok(start)
    };
    read().is_ok_and(|start| csv::is_table(&start))
}

/// Returns the format of a file that will be written; the path must not be a directory. A pipe or a device without a
/// known extension is written as CSV.
pub(crate) fn format_to_write(path: &Path) -> Result<&'static Format, IoError> {
    let known = fs::metadata(path).ok();
    let format = match known {
        Some(known) if known.is_dir() => Err(IoError::Directory {
            file: path.display().to_string(),
        }),
        Some(known) if !known.is_file() => Ok(format_of(path).unwrap_or(&csv::CSV)),
        _ => format_of(path).ok_or_else(|| unknown_format_error(path, writable_extensions(), None)),
    }?;
    let FormatWriter::ReadOnly(what) = format.writing else {
        return Ok(format);
    };
    Err(IoError::UnknownFormat {
        file: path.display().to_string(),
        found: format!(
            ".{} cannot be written ({what})",
            format.extensions.first().copied().unwrap_or_default()
        ),
        expected: writable_extensions(),
        remedy: String::new(),
    })
}

/// Returns the format of a file and its bytes. A text compressed by gzip is decompressed, and a BIDS table gets a
/// header.
pub(crate) fn read_with_format(path: &Path) -> Result<(&'static Format, Vec<u8>), IoError> {
    let file = path.display().to_string();
    if path.is_dir() {
        return Err(IoError::Directory { file });
    }
    let format = format_to_read(path)?;
    let inner = gzip::path_without_gz(path);
    let read = |path| {
        fs::read(path).map_err(|source| IoError::Unreadable {
            file: file.clone(),
            source,
        })
    };
    let mut bytes = match (&inner, format.name == csv::CSV.name) {
        (Some(_), _) => {
            let bytes = gzip::decompress(&read(path)?, &file)?;
            csv::LineLimit::default().add(&bytes, &file)?;
            bytes
        }
        (None, true) => csv::read_whole_text(path, &file)?,
        (None, false) => read(path)?,
    };
    if format.extensions == csv::TSV.extensions {
        bytes = bids::with_header(bytes, inner.as_deref().unwrap_or(path));
    }
    Ok((format, bytes))
}

/// Returns the format and the table of a long text file of plain numbers, which is read block by block; `None` for any
/// other file.
///
/// # Errors
/// [`IoError::Unreadable`]; [`IoError::LongLine`].
pub(crate) fn read_long_text<'a>(
    path: &Path,
    file: &'a str,
    options: &ReadOptions,
) -> Result<Option<(&'static Format, Table<'a>)>, IoError> {
    let is_text = |format: &&Format| gzip::path_without_gz(path).is_none() && format.name == csv::CSV.name;
    let Some(format) = format_to_read(path).ok().filter(is_text) else {
        return Ok(None);
    };
    Ok(csv::long_table(path, file, options)?.map(|table| (format, table)))
}

/// Returns the requested columns of a file of any format; the table may borrow from `bytes`.
///
/// # Errors
/// The errors of [`crate::read_record`].
pub(crate) fn table_of_file<'a>(
    path: &Path,
    file: &'a str,
    bytes: &'a mut Vec<u8>,
    options: &ReadOptions,
) -> Result<Table<'a>, IoError> {
    if let Some((_, table)) = read_long_text(path, file, options)? {
        return with_time_and_selection(table, false, options);
    }
    let (format, read) = read_with_format(path)?;
    *bytes = read;
    format.table(bytes, file, options)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_extension_belongs_to_one_format() {
        let mut endings: Vec<&str> = FORMATS.iter().flat_map(|format| format.extensions).copied().collect();
        let count = endings.len();
        endings.sort_unstable();
        endings.dedup();
        assert_eq!(endings.len(), count);
        assert!(FORMATS.iter().all(|format| !format.extensions.is_empty()));
    }

    #[test]
    fn each_unsupported_extension_has_one_remedy() {
        let mut endings: Vec<&str> = UNSUPPORTED_FORMAT_REMEDIES
            .iter()
            .flat_map(|(endings, _)| *endings)
            .copied()
            .collect();
        assert!(
            endings
                .iter()
                .all(|ending| format_of(Path::new(&format!("run.{ending}"))).is_none())
        );
        let count = endings.len();
        endings.sort_unstable();
        endings.dedup();
        assert_eq!(endings.len(), count);
        let message = |file: &str| {
            format_to_read(Path::new(file))
                .err()
                .map(|error| error.to_string())
                .unwrap_or_default()
        };
        assert!(message("run.npz.gz").ends_with("; unpack it first"));
        assert!(message("run.TDMS").contains("package nptdms"));
        assert!(message("run.abc").ends_with("or .xdf"));
    }

    #[test]
    fn extensions_are_listed_as_text() {
        assert_eq!(extensions(&[&csv::CSV]), ".csv (also as .txt)");
        assert_eq!(
            extensions(&[&csv::CSV, &csv::TSV, &csv::TSV]),
            ".csv (also as .txt), .tsv or .tsv"
        );
        assert!(readable_extensions().contains(".xdf"));
        assert!(!writable_extensions().contains(".xdf"));
    }
}
