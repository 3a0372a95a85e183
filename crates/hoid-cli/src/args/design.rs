//! Options of `hoid design`.

use std::path::PathBuf;

use clap::Args;
use hoid::design::experiment::{Remnant, Wanted};
use hoid::model::ContinuousTransferFunction;

use super::{parse::parse_span, show::ShowArgs};

#[derive(Debug, Args)]
pub struct DesignArgs {
    /// The person: a scenario of the family (.toml), or a fit that `hoid identify --json` printed
    #[arg(long, value_name = "PERSON.toml|FIT.json")]
    pub people: PathBuf,
    /// The controlled element, as 90/(s(s+6)) or 90/1,6,0 [default: that of the scenario]
    #[arg(long, value_name = "TF")]
    pub controlled_element: Option<ContinuousTransferFunction>,
    /// The quantities requested, with the standard error that is accepted: crossover=3%,tau_e=5%,phase_margin=2 (deg)
    /// [default: all parameters alike]
    #[arg(long = "for", value_name = "LIST", value_delimiter = ',', value_parser = parse_wanted)]
    pub wanted: Vec<Wanted>,
    /// The forcing function is a disturbance at the input of the controlled element, not a target
    #[arg(long)]
    pub disturbance: bool,
    /// Share of the remnant in the variance of u
    #[arg(long, value_name = "P", default_value_t = Remnant::default().share)]
    pub remnant_share: f64,
    /// Time constant of the remnant, of first order, in s; 0 is white
    #[arg(long, value_name = "S", default_value_t = Remnant::default().time_constant_s)]
    pub remnant_time_constant: f64,
    /// Length of a run in s: the period of the forcing function
    #[arg(long, value_name = "S", default_value_t = 81.92)]
    pub length: f64,
    /// Number of runs [default: the number for the target, else 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub runs: Option<u32>,
    /// Lines of the forcing function
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub lines: usize,
    /// Lowest and highest frequency of the lines, rad/s
    #[arg(long, value_name = "LO..HI", default_value = "0.2..18", value_parser = parse_span)]
    pub band: (f64, f64),
    /// Greatest amplitude of a line beyond the crossover, as a part of the mean of those below: of more, people let the crossover
    /// fall
    #[arg(long, value_name = "PART", default_value_t = 0.2)]
    pub shelf: f64,
    /// Greatest rms of the error; without this and --max-u the forcing function has an rms of 1
    #[arg(long, value_name = "RMS")]
    pub max_rms_e: Option<f64>,
    /// Greatest rms of the control
    #[arg(long, value_name = "RMS")]
    pub max_u: Option<f64>,
    /// A forcing function to be judged next to it: a scenario with a target or disturbance, or reference (the ten sines
    /// of the text)
    #[arg(long, value_name = "SCENARIO.toml|reference")]
    pub against: Option<PathBuf>,
    /// Directory for the design: design.json, scenario.toml, forcing.csv
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub show: ShowArgs,
}

/// `NAME=5%`, `NAME=0.05`.
fn parse_wanted(text: &str) -> Result<Wanted, String> {
    let (name, error) = text
        .split_once('=')
        .ok_or_else(|| format!("{text:?} has no error; write NAME=5%"))?;
    let error = error.trim();
    let (number, scale) = error.strip_suffix('%').map_or((error, 1.0), |number| (number, 0.01));
    let number: f64 = number
        .trim()
        .parse()
        .map_err(|_| format!("{error:?} is not an error; write NAME=5%"))?;
    let name = match name.trim() {
        "margin" => "phase_margin",
        "delay" => "tau_e",
        name => name,
    };
    Ok(Wanted {
        name: name.to_owned(),
        error: number * scale,
    })
}
