//! Export of a session as one archive, with the common files of its experiment.

use std::{
    io::{Cursor, Write as _},
    path::{Path, PathBuf},
};

use zip::{CompressionMethod, DateTime, ZipWriter, write::SimpleFileOptions};

use crate::LabError;

/// Files of the experiment that are included in the archive.
const ARCHIVED_FILES: [&str; 3] = ["README", "dataset_description.json", "participants.tsv"];

/// Returns the archive of a session, with the same paths as in the experiment. The same files give the same bytes.
///
/// # Errors
/// Errors of reading files.
pub fn archive(out: &Path, folder: &Path) -> Result<Vec<u8>, LabError> {
    let mut files: Vec<PathBuf> = ARCHIVED_FILES
        .iter()
        .map(|name| out.join(name))
        .filter(|path| path.exists())
        .collect();
    collect_files(folder, &mut files)?;
    files.sort();
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default());
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let unwritable = |error: String| LabError::damaged_file(folder, format!("the archive cannot be written: {error}"));
    for path in &files {
        let name = path
            .strip_prefix(out)
            .unwrap_or(path)
            .to_string_lossy()
            .replace('\\', "/");
        let bytes = hoid_io::read_bytes(path)?;
        archive
            .start_file(name, options)
            .map_err(|error| unwritable(error.to_string()))?;
        archive
            .write_all(&bytes)
            .map_err(|error| unwritable(error.to_string()))?;
    }
    let cursor = archive.finish().map_err(|error| unwritable(error.to_string()))?;
    Ok(cursor.into_inner())
}

fn collect_files(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), LabError> {
    let entries = std::fs::read_dir(folder).map_err(|source| LabError::file(folder, source))?;
    for entry in entries.flatten() {
        let path = entry.path();
        let hidden = entry.file_name().to_string_lossy().starts_with('.');
        match entry.file_type() {
            Ok(kind) if kind.is_dir() => collect_files(&path, files)?,
            Ok(kind) if kind.is_file() && !hidden => files.push(path),
            _ => {}
        }
    }
    Ok(())
}
