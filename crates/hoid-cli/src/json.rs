//! Results as JSON objects, the interface to other programs: those that `hoid::analysis` does not write, and printing.

pub use hoid::analysis::json::*;
use serde_json::Value;

use crate::{error::CliError, output};

/// Prints one object, indented, without any other output.
///
/// # Errors
/// The errors of [`output::print`].
pub fn print(value: &Value) -> Result<(), CliError> {
    output::print(&format!("{value:#}\n"))
}
