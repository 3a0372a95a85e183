//! Where a command writes, asked before its work: nothing that it reads is written over, and a place
//! that takes nothing is known at once.

use std::path::Path;

use hoid::io::{check_output, check_output_directory};

use crate::error::CliError;

/// The page in the directory of a report.
const PAGE: &str = "report.html";

/// Checks the files and the directories of reports that a command with these inputs writes.
///
/// # Errors
/// [`CliError::Io`] for an output that is an input, by a link too, and for a place that cannot be
/// written.
pub fn check(inputs: &[&Path], files: &[Option<&Path>], reports: &[Option<&Path>]) -> Result<(), CliError> {
    for file in files.iter().flatten().filter(|file| file.as_os_str() != "-") {
        check_output(file, inputs)?;
    }
    for directory in reports.iter().flatten() {
        check_output_directory(directory, &[])?;
        if directory.is_dir() {
            check_output(&directory.join(PAGE), inputs)?;
        }
    }
    Ok(())
}
