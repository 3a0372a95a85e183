//! Writing of a result as a table for a paper.

use hoid::io::writable_extensions;
use hoid::report::PaperTable;
use serde_json::{Map, Value};

use crate::{args::ShowArgs, error::CliError, output};

/// Checks, before anything is read, that the table can be written.
///
/// # Errors
/// [`CliError::Usage`] if the name of the file does not correspond to any format.
pub fn check(show: &ShowArgs) -> Result<(), CliError> {
    let Some(path) = &show.table else { return Ok(()) };
    PaperTable::check_format(path).map_err(|_| {
        let endings = writable_extensions();
        CliError::Usage(format!(
            "--table {}: expected a file name that ends in .tex, .md, {endings}",
            path.display()
        ))
    })
}

/// Writes the table, if requested, from the JSON object of the result.
///
/// # Errors
/// Errors of `object` and of writing.
pub fn write(show: &ShowArgs, object: impl FnOnce() -> Result<Map<String, Value>, CliError>) -> Result<(), CliError> {
    let Some(path) = &show.table else { return Ok(()) };
    match PaperTable::of(&object()?) {
        Some(table) => {
            table.write(path)?;
            output::add_notice("", format!("table: {}", path.display()));
        }
        None => output::add_notice("", "no table is written: the result has no estimate".to_owned()),
    }
    Ok(())
}
