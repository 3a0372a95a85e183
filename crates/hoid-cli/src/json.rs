//! JSON objects of results that `hoid::analysis` does not write, and printing of JSON, which is the interface to other
//! programs.

pub use hoid::analysis::json::*;
use serde_json::Value;

use crate::{error::CliError, output};

/// Prints one indented object as the only output.
///
/// # Errors
/// The errors of [`output::print`].
pub fn print(value: &Value) -> Result<(), CliError> {
    output::print(&format!("{value:#}\n"))
}
