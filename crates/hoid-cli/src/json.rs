//! Results as JSON objects, the contract with other programs: what `hoid::analysis` does not write, and how
//! one is printed.

pub use hoid::analysis::json::*;
use serde_json::Value;

use crate::{error::CliError, output};

/// Prints one object, indented, and nothing else.
///
/// # Errors
/// The errors of [`output::print`].
pub fn print(value: &Value) -> Result<(), CliError> {
    output::print(&format!("{value:#}\n"))
}
