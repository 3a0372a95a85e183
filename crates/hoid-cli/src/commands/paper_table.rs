//! A result as a table for a paper.

use hoid::io::writable_endings;
use hoid::report::PaperTable;
use serde_json::{Map, Value};

use crate::{args::ShowArgs, error::CliError, output};

/// Whether it can be written: known before anything is read.
///
/// # Errors
/// [`CliError::Usage`] for a name that does not correspond to any format.
pub fn check(show: &ShowArgs) -> Result<(), CliError> {
    let Some(path) = &show.table else { return Ok(()) };
    PaperTable::check(path).map_err(|_| {
        let endings = writable_endings();
        CliError::Usage(format!(
            "--table {}: tables are written as .tex, .md, {endings}",
            path.display()
        ))
    })
}

/// Writes it where it is requested, from the object of the result.
///
/// # Errors
/// The errors of the object and of writing.
pub fn write(show: &ShowArgs, object: impl FnOnce() -> Result<Map<String, Value>, CliError>) -> Result<(), CliError> {
    let Some(path) = &show.table else { return Ok(()) };
    match PaperTable::of(&object()?) {
        Some(table) => {
            table.write(path)?;
            output::notice("", format!("table: {}", path.display()));
        }
        None => output::notice(
            "",
            "table: none is written, there is no estimate in the result".to_owned(),
        ),
    }
    Ok(())
}
