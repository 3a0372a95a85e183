//! Options of `hoid fmu`.

use std::path::PathBuf;

use clap::Args;
use hoid::io::fmu::FmiVersion;
use hoid::model::{ContinuousTransferFunction, scenario::Condition};
use hoid::track::Method;

use super::{choices::choice_parser, recursion::method_names};

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct FmuArgs {
    /// File to write
    #[arg(long, value_name = "FILE.fmu")]
    pub out: PathBuf,
    /// Write a unit that controls in place of a person: the operator of a thesis condition, C1 to C6, or of a scenario
    /// file (TOML)
    #[arg(long, value_name = "SCENARIO", value_parser = parse_operator)]
    pub operator: Option<OperatorChoice>,
    /// Shared library built by `cargo xtask ffi`; repeat for each platform [default: libhoid next to this program]
    #[arg(long = "library", value_name = "FILE")]
    pub libraries: Vec<PathBuf>,
    /// FMI version
    #[arg(long, value_name = "N", default_value = "2", value_parser = choice_parser(&FmiVersion::ALL))]
    pub fmi: FmiVersion,
    /// Sample time in s: start value of the parameter sample_time
    #[arg(long, value_name = "S", default_value_t = 0.01, conflicts_with = "operator")]
    pub sample_time: f64,
    /// Recursive method: start value of the parameter method
    #[arg(long, value_name = "NAME", default_value_t = Method::default().name().to_owned(),
          value_parser = method_names(), conflicts_with = "operator")]
    pub method: String,
    /// Prior knowledge of the person: population, none, NAME=CENTRE:SPREAD..., or a fit (file from hoid identify
    /// --json), stored in the unit [default: population]
    #[arg(long, value_name = "PRIOR", conflicts_with = "operator")]
    pub prior: Option<String>,
    /// Controlled element, such as 90/(s(s+6)): adds crossover and phase margin
    #[arg(
        long,
        value_name = "ELEMENT",
        allow_hyphen_values = true,
        conflicts_with = "operator"
    )]
    pub controlled_element: Option<ContinuousTransferFunction>,
    /// Seed of the operator's remnant: start value of the parameter seed
    #[arg(long, value_name = "N", default_value_t = 0, requires = "operator")]
    pub seed: i32,
}

/// A condition or a file.
#[derive(Debug, Clone)]
pub enum OperatorChoice {
    Condition(Condition),
    File(PathBuf),
}

fn parse_operator(text: &str) -> Result<OperatorChoice, std::convert::Infallible> {
    Ok(match text.parse() {
        Ok(condition) => OperatorChoice::Condition(condition),
        Err(_) => OperatorChoice::File(PathBuf::from(text)),
    })
}
