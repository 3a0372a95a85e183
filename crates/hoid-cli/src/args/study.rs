//! Options of `hoid study` and `hoid reproduce`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use hoid::study::Shard;

#[derive(Debug, Subcommand)]
pub enum StudyCommand {
    /// Run a plan, or a shard of it, and summarise the results
    Run(StudyRunArgs),
    /// Join the shards of a study
    Merge(StudyMergeArgs),
    /// Check a plan and report what it would do, without running it
    Check(StudyCheckArgs),
    /// List the built-in plans, or write one to standard output
    Plans(StudyPlansArgs),
    /// Write the JSON schema of plans to standard output
    Schema,
}

#[derive(Debug, Args)]
pub struct StudyRunArgs {
    /// Plan (TOML), or the name of a built-in plan
    #[arg(value_name = "PLAN")]
    pub plan: PathBuf,
    /// Directory for the results; created if missing
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Replications of each cell, instead of the plan's
    #[arg(long, value_name = "M")]
    pub replications: Option<u64>,
    /// Run one shard of the study, to be joined by `hoid study merge`
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Threads [default: one per core]
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    /// Resume a stopped study
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
    /// Directories written by `hoid study run --shard`, in any order
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
    /// Plan (TOML), or the name of a built-in plan
    #[arg(value_name = "PLAN")]
    pub plan: PathBuf,
}

#[derive(Debug, Args)]
pub struct StudyPlansArgs {
    /// Plan to write
    #[arg(value_name = "NAME")]
    pub name: Option<String>,
}

#[derive(Debug, Args)]
pub struct ReproduceArgs {
    /// Tables, figures, appendices, studies, the experiment or the claims, comma-separated, such as
    /// fig-5,table-2,H,recursive,experiment,claims [default: all]
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub only: Vec<String>,
    /// Replications of each cell; 10 for a quick look
    #[arg(long, value_name = "M", default_value_t = 100)]
    pub replications: u64,
    /// With --only experiment: recorded people instead of virtual people, given by a manifest (see `hoid group init`)
    /// or a directory with a manifest
    #[arg(long, value_name = "DIR|MANIFEST")]
    pub recordings: Option<PathBuf>,
    /// Directory for tables, figures, their data and the index page; existing studies are not rerun
    #[arg(long, value_name = "DIR", default_value = "hoid-reproduction")]
    pub out: PathBuf,
    /// Threads [default: one per core]
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    /// List the names for --only, and run nothing
    #[arg(long)]
    pub list: bool,
}
