//! Options of `hoid lab`.

use std::path::PathBuf;

use clap::Args;

#[derive(Debug, Args)]
pub struct LabArgs {
    /// Experiment folder: one folder per session, and the manifest for `hoid group`. Unfinished sessions can be resumed
    #[arg(long, value_name = "DIR", default_value = "hoid-lab")]
    pub out: PathBuf,
    /// Experiment in TOML: conditions, order, consent, limits [default: a two-minute trial with 4/s]
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Port on 127.0.0.1 [default: any free port]
    #[arg(long, value_name = "N")]
    pub port: Option<u16>,
    /// Open the page in the browser
    #[arg(long)]
    pub open: bool,
    /// Verify and replay the session in this folder, such as hoid-lab/sub-P01/ses-01
    #[arg(long, value_name = "DIR", conflicts_with_all = ["config", "calibrate"])]
    pub replay: Option<PathBuf>,
    /// With a simulated operator, measure the delay added by page, frames and events
    #[arg(long, conflicts_with = "config")]
    pub calibrate: bool,
}
