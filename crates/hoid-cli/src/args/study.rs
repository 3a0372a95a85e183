//! Options of `hoid study` and `hoid reproduce`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use hoid::study::Shard;

#[derive(Debug, Subcommand)]
pub enum StudyCommand {
    /// Run a plan, or a shard of it, and summarise the results
    Run(StudyRunArgs),
    /// Join the shards of a study that were run apart
    Merge(StudyMergeArgs),
    /// Check a plan and report what it would do, without running anything
    Check(StudyCheckArgs),
    /// List the plans that come with the program, or write one of them to standard output
    Plans(StudyPlansArgs),
    /// Write the JSON schema of plans to standard output
    Schema,
}

#[derive(Debug, Args)]
pub struct StudyRunArgs {
    /// Plan in TOML, or the name of a plan that comes with the program
    #[arg(value_name = "PLAN")]
    pub plan: PathBuf,
    /// Directory for the results; it is made if it is missing
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Replications of each cell instead of those of the plan
    #[arg(long, value_name = "M")]
    pub replications: Option<u64>,
    /// Run one shard of the study, to be joined by `hoid study merge`
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Threads. Default: one a core
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    /// Continue with a study that was stopped
    #[arg(long)]
    pub resume: bool,
    /// Write CSV instead of Parquet
    #[arg(long)]
    pub csv: bool,
    /// Print the outcome as JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct StudyMergeArgs {
    /// Directories that `hoid study run --shard` has written, in any order
    #[arg(value_name = "DIR", required = true)]
    pub shards: Vec<PathBuf>,
    /// Directory for the results
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Write CSV instead of Parquet
    #[arg(long)]
    pub csv: bool,
    /// Print the outcome as JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct StudyCheckArgs {
    /// Plan in TOML, or the name of a plan that comes with the program
    #[arg(value_name = "PLAN")]
    pub plan: PathBuf,
}

#[derive(Debug, Args)]
pub struct StudyPlansArgs {
    /// The plan to write out
    #[arg(value_name = "NAME")]
    pub name: Option<String>,
}

#[derive(Debug, Args)]
pub struct ReproduceArgs {
    /// Tables, figures, appendices, studies, the experiment or the claims, separated by commas, as
    /// fig-5,table-2,H,recursive,experiment,claims. Default: all
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub only: Vec<String>,
    /// Replications of each cell; 10 for a quick look
    #[arg(long, value_name = "M", default_value_t = 100)]
    pub replications: u64,
    /// Recorded people in place of virtual ones, with --only experiment: a directory with the manifest that
    /// `hoid group init` writes, or a manifest
    #[arg(long, value_name = "DIR|MANIFEST")]
    pub recordings: Option<PathBuf>,
    /// Directory for tables, figures, their data and the index page; studies that are already
    /// present are not run again
    #[arg(long, value_name = "DIR", default_value = "hoid-reproduction")]
    pub out: PathBuf,
    /// Threads. Default: one a core
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    /// List the names that --only takes, and run nothing
    #[arg(long)]
    pub list: bool,
}
