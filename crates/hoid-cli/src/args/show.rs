//! How results are shown, the same for all commands that identify.

use std::path::PathBuf;

use clap::Args;

#[derive(Debug, Clone, Args)]
pub struct ShowArgs {
    /// Print what is after the answer as well: other methods, candidates, roots, tests of residuals, and every setting
    #[arg(short, long)]
    pub verbose: bool,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub json: bool,
    /// Write estimates, errors, intervals as a table for a paper: .tex (booktabs), .md, .csv, .parquet ...
    #[arg(long, value_name = "FILE")]
    pub table: Option<PathBuf>,
}
