//! Options of `hoid design`.

use std::path::PathBuf;

use clap::Args;
use hoid::design::experiment::{
    DEFAULT_ALPHA, DEFAULT_POWER, OtherForcing, People, Remnant, RequestedQuantity, SpreadSource, TargetDifference,
};
use hoid::model::{ContinuousTransferFunction, Form, family_scenario::Display};

use super::{choices::choice_parser, figure::FigureArgs, output_options::ShowArgs, parse::parse_span};

#[derive(Debug, Args)]
pub struct DesignArgs {
    /// People to design for: population (people in general, adapted to the controlled element), a family scenario
    /// (.toml), a fit (`hoid identify --json`), or a group (directory of `hoid group --out`, its JSON or
    /// population.json). For several people, reports the errors of the typical and the worst person
    #[arg(long, value_name = "population|FILE|DIR", default_value = "population")]
    pub people: People,
    /// Condition to use if the group has several
    #[arg(long, value_name = "NAME")]
    pub condition: Option<String>,
    /// Form of the population's operator [default: the form that people use with the element]
    #[arg(long, value_name = "FORM", value_parser = choice_parser(&Form::ERROR_FORMS))]
    pub form: Option<Form>,
    /// Controlled element, such as 90/(s(s+6)) or 90/1,6,0 [default: from the scenario or group]
    #[arg(long, value_name = "TF", allow_hyphen_values = true)]
    pub controlled_element: Option<ContinuousTransferFunction>,
    /// Required standard errors: crossover=3%,tau_e=5%,phase_margin=2 (deg), tau_f=0.02 (s) [default: all parameters
    /// equally]
    #[arg(long = "for", value_name = "LIST", value_delimiter = ',')]
    pub wanted: Vec<RequestedQuantity>,
    /// Apply the forcing function as a disturbance at the input of the controlled element, not as a target
    #[arg(long)]
    pub disturbance: bool,
    /// Share of the variance of u due to the remnant
    #[arg(long, value_name = "P", default_value_t = Remnant::default().share)]
    pub remnant_share: f64,
    /// Time constant of the first-order remnant in s; 0 for white
    #[arg(long, value_name = "S", default_value_t = Remnant::default().time_constant_s)]
    pub remnant_time_constant: f64,
    /// Length of a run in s (the period of the forcing function)
    #[arg(long, value_name = "S", default_value_t = 81.92, allow_negative_numbers = true)]
    pub length: f64,
    /// Number of runs [default: the number needed for --for, else 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub runs: Option<u32>,
    /// Run-to-run standard deviation of a person, as a fraction of the quantity (for phase margin: of the gain), or a
    /// `hoid group` directory from whose runs it is estimated [default: from --people if available, else .13]
    #[arg(long, value_name = "PART|DIR")]
    pub run_to_run: Option<SpreadSource>,
    /// Lines per forcing function
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub lines: usize,
    /// Minimum distance between lines, in multiples of the fundamental 1/length
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    pub spacing: u32,
    /// Lowest and highest frequencies of the lines in rad/s
    #[arg(long, value_name = "LO..HI", default_value = "0.2..18", value_parser = parse_span)]
    pub band: (f64, f64),
    /// Largest amplitude of a line above the crossover, relative to the mean below it; larger amplitudes make people
    /// lower their crossover
    #[arg(long, value_name = "PART", default_value_t = 0.2)]
    pub shelf: f64,
    /// Largest rms of the error; with neither this nor --max-u, the forcing function has rms 1
    #[arg(long, value_name = "RMS", allow_negative_numbers = true)]
    pub max_rms_e: Option<f64>,
    /// Largest rms of the control
    #[arg(long, value_name = "RMS", allow_negative_numbers = true)]
    pub max_u: Option<f64>,
    /// Forcing function to compare with the design: a scenario with a target or disturbance (or both), a table of lines
    /// (columns omega_rad_s, amplitude, phase_rad), or reference (the ten sines of the thesis)
    #[arg(long, value_name = "FORCING.toml|.csv|reference")]
    pub against: Option<OtherForcing>,
    /// Difference to detect between two conditions, with each person in both: crossover=.5 (rad/s), phase_margin=5
    /// (deg), tau_e=10% (of tau_e). Reports how many people, and runs per condition, are needed
    #[arg(long, value_name = "NAME=SIZE")]
    pub difference: Option<TargetDifference>,
    /// Power: probability of detecting the difference
    #[arg(long, value_name = "P", default_value_t = DEFAULT_POWER, requires = "difference")]
    pub power: f64,
    /// Two-sided significance level of the test
    #[arg(long, value_name = "P", default_value_t = DEFAULT_ALPHA, requires = "difference")]
    pub alpha: f64,
    /// Standard deviation of the difference across people, as a fraction like --run-to-run, or a file that contains it:
    /// output of `hoid compare --json`, the result of a group with several conditions, or a population.json [default:
    /// from --people if available, else .1]
    #[arg(long, value_name = "PART|FILE", requires = "difference")]
    pub between_people: Option<SpreadSource>,
    /// Display of the task: compensatory (error only), pursuit (target and output), preview (also the future target).
    /// For the last two, a target and a disturbance with different lines are designed, to separate the responses to
    /// error and target
    #[arg(long, value_name = "NAME", default_value = "compensatory", value_parser = choice_parser(&Display::ALL))]
    pub display: Display,
    /// Seed of the phase search: the same seed repeats the design; another changes only the phases
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Directory for the design: design.json, scenario.toml, lab.toml, forcing.csv, design.csv and .md, design.svg,
    /// runs.svg; with --difference also power.csv
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub picture: FigureArgs,
    #[command(flatten)]
    pub show: ShowArgs,
}
