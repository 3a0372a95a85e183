//! Options of the commands that simulate: `hoid demo`, `hoid simulate`, `hoid margins`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use hoid::model::{
    remnant_gain::NoiseDefinition,
    scenario::{Condition, Realisation},
};

use super::choices::choice_parser;

#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Directory for the record and the reports; created if missing
    #[arg(long, value_name = "DIR", default_value = "hoid-demo")]
    pub out: PathBuf,
    /// Seed of the simulated run
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
}

/// A condition of the thesis or a scenario file.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub struct ScenarioChoice {
    /// Condition of the thesis
    #[arg(long, value_name = "C1..C6")]
    pub condition: Option<Condition>,
    /// Scenario file (TOML)
    #[arg(long, value_name = "FILE")]
    pub scenario: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct SimulateArgs {
    #[command(flatten)]
    pub base: ScenarioChoice,
    /// Order m of the remnant filter, 1 to 4 [default: 1, or the scenario's]
    #[arg(long, value_name = "M")]
    pub remnant_order: Option<usize>,
    /// Noise level P_n; 0 for no remnant [default: 0.1, or the scenario's]
    #[arg(long, value_name = "P_N")]
    pub noise_level: Option<f64>,
    /// Definition of the noise level: var(u_n)/var(u) (response) or var(n)/var(u) (remnant) [default: response, or the
    /// scenario's]
    #[arg(long, value_name = "WHICH", value_parser = choice_parser(&NoiseDefinition::ALL))]
    pub noise_definition: Option<NoiseDefinition>,
    /// Remnant time constant T_n in s [default: 0.06, or the scenario's]
    #[arg(long, value_name = "S")]
    pub remnant_time_constant: Option<f64>,
    /// Sample time Ts in s [default: 0.01, or the scenario's]
    #[arg(long, value_name = "S")]
    pub sample_time: Option<f64>,
    /// Where a changing K_c acts: input matrix (x stays continuous) or output matrix (as in the thesis) [default:
    /// input, or the scenario's]
    #[arg(long, value_name = "WHERE", value_parser = choice_parser(&Realisation::ALL))]
    pub realisation: Option<Realisation>,
    /// Response to a displayed target: its form and gain, then other parameters by name, such as
    /// derivative:0.15,tau_f=0.1,preview=0.25 [default: none, or the scenario's]
    #[arg(long, value_name = "FORM:GAIN,...")]
    pub feedforward: Option<String>,
    /// Rms in deg of a disturbance at the input of the controlled element, at lines between those of the target
    /// [default: 0, or the scenario's]
    #[arg(long, value_name = "RMS")]
    pub disturbance: Option<f64>,
    /// Seed of the random streams
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Cell of a study, to repeat one of its runs: seed, cell and replication determine the random stream
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub cell: u64,
    /// Replication: runs with the same seed but different replications are independent
    #[arg(long, value_name = "R", default_value_t = 0)]
    pub replication: u64,
    /// Keep the run-in (t < 0) in the file
    #[arg(long)]
    pub keep_run_in: bool,
    /// File to write; - for CSV on standard output
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct MarginsArgs {
    #[command(flatten)]
    pub base: ScenarioChoice,
    /// State of a scenario that changes
    #[arg(long, value_name = "WHICH", default_value = "initial")]
    pub state: StateName,
    /// Noise levels P_n for the remnant gains
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [0.01, 0.1, 0.2, 0.3])]
    pub noise_levels: Vec<f64>,
    /// Definition of the noise level: var(u_n)/var(u) (response) or var(n)/var(u) (remnant)
    #[arg(long, value_name = "WHICH", default_value = "response", value_parser = choice_parser(&NoiseDefinition::ALL))]
    pub noise_definition: NoiseDefinition,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub json: bool,
}

/// State of a scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum StateName {
    Initial,
    Last,
}
