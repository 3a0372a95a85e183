//! A result as a table for a paper.

use hoid::io::writable_endings;
use hoid::report::PaperTable;
use serde_json::{Map, Value};

use crate::{args::ShowArgs, error::CliError, output};

/// Checks that the table can be written, before anything is read.
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

/// Writes the table if requested, from the JSON object of the result.
///
/// # Errors
/// Errors of the object and of writing.
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
