//! Options of `hoid completions` and `hoid man`.

use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;

#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_name = "SHELL")]
    pub shell: Shell,
}

#[derive(Debug, Args)]
pub struct ManArgs {
    /// Directory for the pages, one a command; it is made if it is missing
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,
}
