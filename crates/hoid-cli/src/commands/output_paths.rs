//! Checks of the output paths before a command does any work: inputs are never overwritten, and a path that cannot be
//! written is reported at once.

use std::path::Path;

use hoid::io::{check_output, check_output_directory};

use crate::error::CliError;

/// Name of the page in the directory of a report.
const PAGE_FILE: &str = "report.html";

/// Checks the files and the report directories that a command with these inputs writes.
///
/// # Errors
/// [`CliError::Io`] if an output is also an input, possibly through a link, or if a path cannot be written.
pub fn check(inputs: &[&Path], files: &[Option<&Path>], reports: &[Option<&Path>]) -> Result<(), CliError> {
    for file in files.iter().flatten().filter(|file| file.as_os_str() != "-") {
        check_output(file, inputs)?;
    }
    for directory in reports.iter().flatten() {
        check_output_directory(directory, &[])?;
        if directory.is_dir() {
            check_output(&directory.join(PAGE_FILE), inputs)?;
        }
    }
    Ok(())
}
