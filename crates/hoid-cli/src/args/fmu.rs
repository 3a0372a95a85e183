//! Options of `hoid fmu`.

use std::path::PathBuf;

use clap::Args;
use hoid::io::fmu::FmiVersion;
use hoid::model::{ContinuousTransferFunction, scenario::Condition};
use hoid::track::Method;

use super::{choices::choice_of, recursion::method_names};

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct FmuArgs {
    /// File of the unit
    #[arg(long, value_name = "FILE.fmu")]
    pub out: PathBuf,
    /// A unit that controls in place of a person: the operator of a condition of the thesis, C1 to
    /// C6, or of a scenario file (TOML)
    #[arg(long, value_name = "SCENARIO", value_parser = parse_operator)]
    pub operator: Option<OperatorChoice>,
    /// Shared library that `cargo xtask ffi` has built; may be repeated, one for each platform
    /// [default: libhoid next to this program]
    #[arg(long = "library", value_name = "FILE")]
    pub libraries: Vec<PathBuf>,
    /// Version of the Functional Mock-up Interface
    #[arg(long, value_name = "N", default_value = "2", value_parser = choice_of(&FmiVersion::ALL))]
    pub fmi: FmiVersion,
    /// Sample time in s, the start of the parameter sample_time
    #[arg(long, value_name = "S", default_value_t = 0.01, conflicts_with = "operator")]
    pub sample_time: f64,
    /// The recursion, the start of the parameter method
    #[arg(long, value_name = "NAME", default_value_t = Method::default().name().to_owned(),
          value_parser = method_names(), conflicts_with = "operator")]
    pub method: String,
    /// Known properties of the person: population, none, NAME=CENTRE:SPREAD..., or the file of a fit that hoid identify
    /// --json has printed, which goes into the unit [default: population]
    #[arg(long, value_name = "PRIOR", conflicts_with = "operator")]
    pub prior: Option<String>,
    /// Controlled element in s, as 90/(s(s+6)): crossover and phase margin are reported
    #[arg(
        long,
        value_name = "ELEMENT",
        allow_hyphen_values = true,
        conflicts_with = "operator"
    )]
    pub controlled_element: Option<ContinuousTransferFunction>,
    /// Seed of the remnant of an operator, the start of the parameter seed
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
