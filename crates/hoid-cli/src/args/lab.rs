//! Options of `hoid lab`.

use std::path::PathBuf;

use clap::Args;

#[derive(Debug, Args)]
pub struct LabArgs {
    /// Folder of the experiment: one folder a session, and the manifest of `hoid group`. Sessions that were not
    /// finished continue
    #[arg(long, value_name = "DIR", default_value = "hoid-lab")]
    pub out: PathBuf,
    /// The experiment: conditions, order, consent, limits, in TOML
    /// [default: a first try of two minutes with 4/s]
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Port on 127.0.0.1 [default: any free one]
    #[arg(long, value_name = "N")]
    pub port: Option<u16>,
    /// Open the address in the browser
    #[arg(long)]
    pub open: bool,
    /// Check and show a session again: its folder, as hoid-lab/sub-P01/ses-01
    #[arg(long, value_name = "DIR", conflicts_with_all = ["config", "calibrate"])]
    pub replay: Option<PathBuf>,
    /// Measure what page, frames and events add to a delay, with a simulated operator
    #[arg(long, conflicts_with = "config")]
    pub calibrate: bool,
}
