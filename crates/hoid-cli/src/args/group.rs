//! Options of `hoid group`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use hoid::model::{Form, scenario::Condition};
use hoid::sim::people::{Plant, RemnantKind};
use hoid::study::group::{ConditionElement, SamplingDefect};

use super::{
    choices::choice_parser, examination::ExaminationArgs, figure::FigureArgs, output_options::ShowArgs,
    parse::parse_span,
};

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct GroupArgs {
    #[command(subcommand)]
    pub command: Option<GroupCommand>,
    #[command(flatten)]
    pub run: GroupRunArgs,
}

#[derive(Debug, Subcommand)]
pub enum GroupCommand {
    /// Write a manifest of a directory's files, for you to check and complete
    Init(GroupInitArgs),
}

#[derive(Debug, Args)]
pub struct GroupRunArgs {
    /// Manifest (TOML), or a directory with group.toml
    #[arg(value_name = "DIR|MANIFEST", required = true)]
    pub manifest: Option<PathBuf>,
    /// Directory for the results; created if missing
    #[arg(long, value_name = "DIR", required = true)]
    pub out: Option<PathBuf>,
    /// Threads [default: one per core]
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    /// Resume a stopped analysis
    #[arg(long)]
    pub resume: bool,
    /// Write CSV as well as Parquet
    #[arg(long)]
    pub csv: bool,
    /// Also estimate each person using the data of all people; writes pooled.csv and population.json
    /// (population-NAME.json for several conditions) for --prior
    #[arg(long)]
    pub pool: bool,
    #[command(flatten)]
    pub picture: FigureArgs,
    #[command(flatten)]
    pub show: ShowArgs,
}

#[derive(Debug, Args)]
pub struct GroupInitArgs {
    /// Directory with one file per run
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,
    /// Pattern of the file names: gives {subject}, {condition}, {axis} and {run}; * matches anything. With {axis}, the
    /// condition is CONDITION-AXIS
    #[arg(long, value_name = "PATTERN", default_value = "{subject}_{condition}_{run}.csv")]
    pub pattern: String,
    #[command(flatten)]
    pub examination: ExaminationArgs,
    /// Controlled element of the named conditions (* matches all); if it changes, also the new element, the time in s
    /// and the rate G in 1/s (without G: sudden). May be repeated
    #[arg(
        long,
        value_name = "NAMES=ELEMENT[>ELEMENT@S[:G]]",
        allow_hyphen_values = true,
        conflicts_with = "controlled_element"
    )]
    pub element: Vec<ConditionElement>,
    /// Further input of the person in all conditions, with its role and preview time in s, as in hoid identify, such as
    /// r=feedforward:0.25. May be repeated
    #[arg(long, value_name = "COLUMN=ROLE[:S]")]
    pub role: Vec<String>,
    /// Samples by which the control is recorded later than the error [default: found with the controlled element, else
    /// 0]
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub offset: Option<f64>,
    /// Manifest to write, - for standard output [default: group.toml in the directory]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct SimulateGroupArgs {
    /// Directory for the files, truth.csv and group.toml
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Number of subjects
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub subjects: u64,
    /// Simulate realistic people from the operator family instead of variants of the thesis operator; uses the elements
    /// of --plants and columns t, e, u, d, y
    #[arg(long, conflicts_with_all = ["conditions", "between_subjects", "remnant_order", "noise_level"])]
    pub people: bool,
    #[command(flatten)]
    pub people_options: PeopleOptions,
    /// Conditions, comma-separated
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "C1,C2,C3,C4,C5,C6"
    )]
    pub conditions: Vec<Condition>,
    /// Number of runs per subject and condition
    #[arg(long, value_name = "N", default_value_t = 5)]
    pub runs: u64,
    /// Spread of the parameters between subjects, 0.1 for 10 %
    #[arg(long, value_name = "S", default_value_t = 0.1)]
    pub between_subjects: f64,
    /// Spread of the parameters between the runs of a subject
    #[arg(long, value_name = "S", default_value_t = 0.03)]
    pub between_runs: f64,
    /// Order of the remnant filter
    #[arg(long, value_name = "1..4", default_value_t = 1)]
    pub remnant_order: usize,
    /// Noise level P_n = var(u_n) / var(u)
    #[arg(long, value_name = "P", default_value_t = 0.1)]
    pub noise_level: f64,
    /// Seed of the random streams
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Recording problems to add: jitter, missing, repeated, slow-clock, saturated, quantised, stalled
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = parse_defect)]
    pub trouble: Vec<SamplingDefect>,
}

/// Additional options of --people.
#[derive(Debug, Args)]
pub struct PeopleOptions {
    /// With --people: controlled elements (1/s, 1/(s(s+1)), 1/s^2) by name, comma-separated
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        requires = "people",
        default_value = "integrator,lagged-integrator,double-integrator",
        value_parser = choice_parser(&Plant::ALL)
    )]
    pub plants: Vec<Plant>,
    /// With --people: form of all operators [default: lead-lag on 1/s, lead2-lag or lead on the
    /// others]
    #[arg(long, value_name = "FORM", requires = "people", value_parser = choice_parser(&Form::ALL))]
    pub form: Option<Form>,
    /// With --people: kinds of remnant, comma-separated, assigned to subjects in turn
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        requires = "people",
        default_value = "lag,broad-band,signal-dependent,pulsed,intermittent",
        value_parser = choice_parser(&RemnantKind::ALL)
    )]
    pub remnants: Vec<RemnantKind>,
    /// With --people: range of the remnant's share of the variance of u
    #[arg(long, value_name = "LO..HI", requires = "people", default_value = "0.05..0.5", value_parser = parse_span)]
    pub remnant_share: (f64, f64),
    /// With --people: sample time in s [default: 1/60]
    #[arg(long, value_name = "S", requires = "people")]
    pub sample_time: Option<f64>,
}

fn parse_defect(text: &str) -> Result<SamplingDefect, String> {
    let names = || SamplingDefect::ALL.map(SamplingDefect::name).join(", ");
    SamplingDefect::ALL
        .into_iter()
        .find(|trouble| trouble.name() == text.trim())
        .ok_or_else(|| format!("{text:?} is not a recording problem; expected one of {}", names()))
}
