//! Options of a figure, the same for all commands that draw one.

use std::path::PathBuf;

use clap::Args;

use super::parse::parse_width;

#[derive(Debug, Args)]
pub struct FigureArgs {
    /// Draw the result (.svg; .pdf and .png if built with --features pdf-png)
    #[arg(long, value_name = "FILE")]
    pub figure: Option<PathBuf>,
    /// Figure width, such as 85mm, 17cm or 3.3in [default: 420 pixels]
    #[arg(long, value_name = "WIDTH", value_parser = parse_width, requires = "figure")]
    pub width: Option<f64>,
}
