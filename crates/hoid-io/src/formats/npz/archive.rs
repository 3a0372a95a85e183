//! The zip archive around the arrays: each member `name.npy` is the array `name`.
//!
//! Reading accepts stored and deflated members. Writing stores the members without times, so the same columns give the
//! same bytes; `numpy.savez` also stores them uncompressed. Trailing null characters of strings are lost, since numpy's
//! text type cannot hold them.

use std::io::{self, Cursor, Read, Write};

use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

use super::npy::{self, NpyError};
use crate::IoError;
use crate::formats::arrays::{COMMENTS_ARRAY, Contents, Entry, Indexing};
use crate::formats::budget::Budget;
use crate::formats::panic_isolation::guard_read;
use crate::results::{TableSchema, Values};
use crate::wording::{abbreviate, quote_start, short_error};

/// Reads the arrays from the bytes of a file.
pub(super) fn read(bytes: &[u8], file: &str) -> Result<Contents, IoError> {
    if !bytes.starts_with(b"PK") {
        return Err(IoError::WrongFormat {
            file: file.to_owned(),
            format: "NPZ",
            found: quote_start(bytes),
            expected: "a zip archive, which starts with PK",
        });
    }
    guard_read(file, || read_members(bytes, file))
}

fn read_members(bytes: &[u8], file: &str) -> Result<Contents, IoError> {
    let mut budget = Budget::of(bytes.len());
    let mut archive =
        ZipArchive::new(Cursor::new(bytes)).map_err(|error| archive_error(&error, "the archive", file))?;
    let mut entries: Vec<Entry> = Vec::new();
    let mut others = Vec::new();
    for index in 0..archive.len() {
        let mut member = archive
            .by_index(index)
            .map_err(|error| archive_error(&error, &format!("member {}", index.saturating_add(1)), file))?;
        let path = match member.name() {
            Ok(name) => name.into_owned(),
            Err(error) => {
                return Err(archive_error(
                    &error,
                    &format!("the name of member {}", index.saturating_add(1)),
                    file,
                ));
            }
        };
        let Some(name) = path.strip_suffix(".npy") else {
            others.push(abbreviate(&path));
            continue;
        };
        let damaged = |what: &str| IoError::Damaged {
            file: file.to_owned(),
            found: format!("array {}: {what}", abbreviate(name)),
        };
        let size = member.size();
        budget.take(size, file)?;
        // The stated length is not allocated in advance: memory grows only with the data that are present.
        let mut data = Vec::new();
        let read = (&mut member).take(size.saturating_add(1)).read_to_end(&mut data);
        read.map_err(|error| damaged(&short_error(&error.to_string())))?;
        if data.len() as u64 != size {
            return Err(damaged(&format!("{} bytes or more, expected {size}", data.len())));
        }
        let found = npy::entries(data, name, false, (&mut budget, file)).map_err(|error| match error {
            NpyError::NoMagic(what) | NpyError::Damaged(what) => damaged(&what),
            NpyError::Other(error) => error,
        })?;
        entries.extend(found);
    }
    let mut contents = Contents::new(entries, Indexing::Python);
    if !others.is_empty() {
        contents.notes.push(format!(
            "members that are not arrays are left out: {}",
            others.join(", ")
        ));
    }
    Ok(contents)
}

fn archive_error(error: &ZipError, place: &str, file: &str) -> IoError {
    let found = format!("{place}: {}", short_error(&error.to_string()));
    let file = file.to_owned();
    match error {
        ZipError::UnsupportedArchive(_) | ZipError::CompressionMethodNotSupported(_) => IoError::Unsupported {
            file,
            found,
            remedy: "write it with numpy.savez or numpy.savez_compressed, without a password",
        },
        _ => IoError::Damaged { file, found },
    }
}

/// Writes the columns, and the comments as an array of strings.
pub(super) fn write(file: &mut dyn Write, schema: &TableSchema, columns: &[Values<'_>]) -> io::Result<()> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(DateTime::default());
    let mut member = |name: &str, values: Values<'_>| -> io::Result<()> {
        let bytes = npy::npy_bytes(values);
        let large = bytes.len() as u64 >= u64::from(u32::MAX);
        archive.start_file(format!("{name}.npy"), options.large_file(large))?;
        archive.write_all(&bytes)
    };
    for (column, values) in schema.columns.iter().zip(columns) {
        member(&column.name, *values)?;
    }
    if !schema.comments.is_empty() {
        member(COMMENTS_ARRAY, Values::Text(&schema.comments))?;
    }
    file.write_all(archive.finish()?.get_ref())
}
