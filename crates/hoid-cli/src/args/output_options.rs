//! How results are shown, the same for all commands that identify.

use std::path::PathBuf;

use clap::Args;

#[derive(Debug, Clone, Args)]
pub struct ShowArgs {
    /// Also print other methods, candidates, roots, residual tests and every setting
    #[arg(short, long)]
    pub verbose: bool,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub json: bool,
    /// Write a table of estimates, errors and intervals for a paper: .tex (booktabs), .md, .csv, .parquet ...
    #[arg(long, value_name = "FILE")]
    pub table: Option<PathBuf>,
}
