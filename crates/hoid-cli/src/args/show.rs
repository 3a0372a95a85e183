//! How results are shown, the same for all commands that identify.

use clap::Args;

#[derive(Debug, Clone, Copy, Args)]
pub struct ShowArgs {
    /// Print what is behind the answer as well: other methods, candidates, roots, tests of residuals,
    /// and every setting
    #[arg(short, long)]
    pub verbose: bool,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub json: bool,
}
