//! The directory of a study: its plan, parts and tables.

use std::{
    fs,
    path::{Path, PathBuf},
};

use hoid_io::IoError;

use crate::{Plan, StudyError};

pub(crate) const PLAN_FILE: &str = "plan.toml";

/// Returns the path of the part that holds one table of a block.
pub(crate) fn part_path(directory: &Path, block: u64, table: &str) -> PathBuf {
    directory.join("parts").join(format!("{block:06}-{table}.parquet"))
}

/// Returns the path of the seal of a block.
pub(crate) fn seal_path(directory: &Path, block: u64) -> PathBuf {
    directory.join("parts").join(format!("{block:06}-seal.json"))
}

/// Writes a copy of the plan to the directory of the results.
pub(crate) fn write_plan(plan: &Plan, directory: &Path) -> Result<(), StudyError> {
    write_source(&directory.join(PLAN_FILE), plan.text())
}

/// Writes a copy of a plan or manifest to the directory of the results; a different file of the same name is not
/// replaced.
pub(crate) fn write_source(path: &Path, text: &str) -> Result<(), StudyError> {
    if path.exists() {
        if hoid_io::read_bytes(path)? == text.as_bytes() {
            return Ok(());
        }
        return Err(StudyError::SourceExists {
            file: path.display().to_string(),
        });
    }
    Ok(hoid_io::write_atomically(path, |file| file.write_all(text.as_bytes()))?)
}

/// Removes the partial output of a killed run: all files in `parts` that do not have the name of a part or a seal.
pub(crate) fn remove_partial_files(parts: &Path) -> Result<(), StudyError> {
    hoid_io::make_directory(parts)?;
    let unwritable = |source| IoError::Unwritable {
        file: parts.display().to_string(),
        source,
    };
    for entry in fs::read_dir(parts).map_err(unwritable)? {
        let path = entry.map_err(unwritable)?.path();
        let is_part = path
            .extension()
            .is_some_and(|ending| ending == "parquet" || ending == "json");
        if !is_part || is_hidden(&path) {
            fs::remove_file(&path).map_err(unwritable)?;
        }
    }
    Ok(())
}

fn is_hidden(path: &Path) -> bool {
    path.file_name()
        .is_some_and(|name| name.to_string_lossy().starts_with('.'))
}

/// Removes the parts of a study after its tables have been written.
pub(crate) fn remove_parts(directory: &Path) -> Result<(), StudyError> {
    let parts = directory.join("parts");
    if !parts.exists() {
        return Ok(());
    }
    fs::remove_dir_all(&parts).map_err(|source| {
        StudyError::Io(IoError::Unwritable {
            file: parts.display().to_string(),
            source,
        })
    })
}

/// Returns the path of a table of a study.
pub(crate) fn table_path(directory: &Path, table: &str, csv: bool) -> PathBuf {
    directory.join(format!("{table}.{}", if csv { "csv" } else { "parquet" }))
}

/// Returns the paths of the tables that exist.
pub(crate) fn table_paths(directory: &Path) -> Vec<PathBuf> {
    let all = ["cells", "fits", "summary", "traces", "trace-summary"]
        .into_iter()
        .flat_map(|table| [false, true].map(|csv| table_path(directory, table, csv)));
    all.filter(|path| path.exists()).collect()
}
