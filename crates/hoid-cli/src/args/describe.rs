//! Options of `hoid describe`.

use std::path::PathBuf;

use clap::Args;
use hoid::ident::frequency::COMMON_EXCITATIONS;
use hoid::io::readable_extensions;
use hoid::model::ContinuousTransferFunction;

use super::{
    figure::FigureArgs,
    output_options::ShowArgs,
    parse::parse_duration,
    reading::{FaultArgs, MaskArgs, ReadArgs},
};

#[derive(Debug, Args)]
pub struct DescribeArgs {
    #[arg(required = true, value_name = "RECORD", help = format!(
        "Record files: {}; several files are runs of one person in one task",
        readable_extensions()
    ))]
    pub records: Vec<PathBuf>,
    #[command(flatten)]
    pub read: ReadArgs,
    #[command(flatten)]
    pub mask: MaskArgs,
    #[command(flatten)]
    pub faults: FaultArgs,
    #[arg(long, value_name = "COLUMN", help = format!(
        "Column of the disturbance or target that defines the lines; the span must be a whole number of periods \
         [default: the first of {} with lines]",
        COMMON_EXCITATIONS.join(", ")
    ))]
    pub excitation: Option<String>,
    /// Excitation lines in rad/s, such as 0.63,1.57,2.2; requires --period [default: the lines found]
    #[arg(long, value_name = "LIST", value_delimiter = ',', requires = "period")]
    pub lines: Option<Vec<f64>>,
    /// Period of the excitation in s [default: shortest common period of the lines found]
    #[arg(long, value_name = "S", value_parser = parse_duration, allow_hyphen_values = true)]
    pub period: Option<f64>,
    /// Controlled element, such as 90/(s(s+6)) or 90/1,6,0 (NUM/DEN in descending powers of s): adds crossover
    /// frequency and margins
    #[arg(long, value_name = "ELEMENT", allow_hyphen_values = true)]
    pub controlled_element: Option<ContinuousTransferFunction>,
    #[command(flatten)]
    pub picture: FigureArgs,
    #[command(flatten)]
    pub show: ShowArgs,
}
