//! The list of inputs and calls, as written.

use std::collections::BTreeMap;

use serde::Deserialize;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Relative difference below which numbers count as equal.
    pub tolerance: f64,
    #[serde(rename = "input")]
    pub inputs: Vec<Input>,
    #[serde(rename = "call")]
    pub calls: Vec<Call>,
}

/// An input file of calls: made by the program, derived from another file, or written unchanged.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Input {
    pub file: String,
    /// Options of `hoid simulate`.
    pub simulate: Option<String>,
    /// A call whose standard output is the file, or which writes the file.
    pub command: Option<String>,
    /// Columns of another file, with modifications.
    pub of: Option<String>,
    pub columns: Vec<String>,
    pub rows: Option<[usize; 2]>,
    pub change: Vec<String>,
    pub text: Option<String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Call {
    pub name: String,
    pub command: String,
    /// A file of lines for standard input.
    pub stdin: Option<String>,
    /// Written tables, of which some rows are kept.
    #[serde(default)]
    pub tables: Vec<String>,
    pub tolerance: Option<f64>,
    /// Reason for a larger tolerance.
    #[allow(dead_code)]
    pub reason: Option<String>,
    /// The corresponding call in Python: function, records and keywords.
    pub python: Option<BTreeMap<String, toml::Value>>,
}
