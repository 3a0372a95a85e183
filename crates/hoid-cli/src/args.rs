//! What can be typed. The texts here are the help pages; each option states its default and unit.

use std::{ops::RangeInclusive, path::PathBuf};

use clap::{Args, Parser, Subcommand, ValueEnum};
use hoid_ident::{Focus, InitialState, IvMethod, SearchMethod, order_selection::Criterion};
use hoid_model::{
    ContinuousTransferFunction, Structure, discretise,
    remnant::RemnantDiscretisation,
    remnant_gain::NoiseDefinition,
    scenario::{Condition, Realisation},
};

use choice::{by_name, choice_of};

use crate::orders::{parse_numbers, parse_range};

/// Human-operator identification: finds out how a person controls a machine.
///
/// From the tracking error e and the control output u it identifies gain, lead, delay and neuromuscular dynamics, with ARX and
/// Box-Jenkins models and standard errors.
#[derive(Debug, Parser)]
#[command(name = "hoid", version, max_term_width = 110)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// The whole path on a simulated run: simulate, identify, write a report
    Demo(DemoArgs),
    /// Simulate one closed-loop run and write it as CSV, Parquet, NPZ or .mat
    Simulate(SimulateArgs),
    /// Identify a model and the operator's parameters from one or several records
    Identify(Box<IdentifyArgs>),
    /// Track a model and the operator's parameters over a record, sample by sample
    Track(Box<TrackArgs>),
    /// Track live: samples as lines on standard input, one JSON line a sample on standard output
    Stream(Box<StreamArgs>),
    /// Show what is inside of a file: columns, sampling, ranges, what is suspicious, and a sketch of each
    Info(InfoArgs),
    /// Take discrete coefficients to operator parameters or back, or discretise a transfer function
    Convert(ConvertArgs),
    /// Crossover frequency, phase and gain margin of a scenario, and its remnant gains
    Margins(MarginsArgs),
    /// Analyse many recorded runs by subject and condition
    Group(GroupArgs),
    /// Simulate a virtual experiment for `hoid group`: subjects, conditions and runs, with the truth beside them
    SimulateGroup(SimulateGroupArgs),
    /// Monte Carlo studies: run a plan, join shares, list plans
    #[command(subcommand)]
    Study(StudyCommand),
    /// The tables, figures and claims of the reference text, each from a named study
    Reproduce(ReproduceArgs),
}

#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Directory for the record, the results and the report; it is made if it is not there
    #[arg(long, value_name = "DIR", default_value = "hoid-demo")]
    pub out: PathBuf,
    /// Seed of the simulated run
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
}

/// A condition of the reference text or a scenario file.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub struct ScenarioChoice {
    /// Condition of the reference text: C1 to C6
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
    /// Noise level P_n; 0 is a run without remnant [default: 0.1, or the scenario's]
    #[arg(long, value_name = "P_N")]
    pub noise_level: Option<f64>,
    /// What the noise level is a share of: var(u_n)/var(u) or var(n)/var(u) [default: response, or the scenario's]
    #[arg(long, value_name = "WHICH", value_parser = choice_of(&NoiseDefinition::ALL))]
    pub noise_definition: Option<NoiseDefinition>,
    /// Remnant time constant T_n in s [default: 0.06, or the scenario's]
    #[arg(long, value_name = "S")]
    pub remnant_time_constant: Option<f64>,
    /// Sample time Ts in s [default: 0.01, or the scenario's]
    #[arg(long, value_name = "S")]
    pub sample_time: Option<f64>,
    /// Where K_c stands when it changes: in the input matrix (x stays continuous) or in the output matrix (as in the reference
    /// text) [default: input, or the scenario's]
    #[arg(long, value_name = "WHERE", value_parser = choice_of(&Realisation::ALL))]
    pub realisation: Option<Realisation>,
    /// Seed of the random streams
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Cell of a study, to repeat one of its runs: seed, cell and replication name the random stream
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub cell: u64,
    /// Replication: runs with the same seed and another replication are independent
    #[arg(long, value_name = "R", default_value_t = 0)]
    pub replication: u64,
    /// Keep the run-in (t < 0) in the file
    #[arg(long)]
    pub keep_run_in: bool,
    /// File to write; - writes CSV to standard output
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

#[derive(Debug, Args)]
pub struct IdentifyArgs {
    /// Record files (CSV, Parquet, NPZ, MATLAB .mat, XDF); several share one model and have initial states of their own
    #[arg(required = true, value_name = "RECORD")]
    pub records: Vec<PathBuf>,
    #[command(flatten)]
    pub read: ReadArgs,
    #[command(flatten)]
    pub mask: MaskArgs,
    /// What is fitted: a polynomial structure, grey-box (operator and remnant in physical parameters, with a real delay), or
    /// time-varying (the operator's gains change once, by a sigmoid) [default: bj, or that of --method]
    #[arg(long, value_name = "NAME", value_parser = by_name(Kind::named()))]
    pub structure: Option<Kind>,
    /// How: pem the prediction error method; iv4 (for arx), sriv (for oe), rivbj (for bj) instrumental variables
    #[arg(long, value_name = "NAME", default_value = "pem")]
    pub method: FitMethodName,
    /// Instruments of iv4, sriv and rivbj: a channel that the noise does not reach, or `simulated` from the input, for an open
    /// loop [default: f_t where all records have it, else simulated]
    #[arg(long, value_name = "CHANNEL|simulated")]
    pub instruments: Option<String>,
    /// Order m of the remnant, a number or a range to search, for grey-box [default: 1..4]
    #[arg(long, value_name = "M|LO..HI", value_parser = parse_range)]
    pub remnant_order: Option<RangeInclusive<usize>>,
    /// Shortest and longest delay tau_e in s, for grey-box and time-varying [default: 0.05..0.6]
    #[arg(long, value_name = "LO..HI", value_parser = parse_span)]
    pub delay: Option<(f64, f64)>,
    /// Parameters that each record has for itself, as K_e,T_L, for grey-box
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub individual: Vec<String>,
    /// Write K_e, T_L and K_e_dot over time into this file (CSV, Parquet, NPZ or .mat), for time-varying
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// Orders, each a number or a range to search, as nb=2,nc=0,nd=1..4,nf=2; nb counts b0, b1, ...
    /// [default: the operator's: bj nb=2,nd=1..4,nf=2; arx na=2,nb=2]
    #[arg(long, value_name = "LIST")]
    pub orders: Option<String>,
    /// Delay of b0 in samples, a number or a range to search [default: 0.05 to 0.6 s]
    #[arg(long, value_name = "N|LO..HI", value_parser = parse_range)]
    pub nk: Option<RangeInclusive<usize>>,
    /// What decides between candidates when something is searched
    #[arg(long, value_name = "NAME", default_value = "bic")]
    pub criterion: CriterionName,
    /// Initial states of each record; auto: estimate, and backcast for an output alone (ar, ma, arma)
    #[arg(long, value_name = "RULE", default_value = "auto")]
    pub initial_state: InitialStateName,
    /// Start of the search, all coefficients as f1=-1.9,f2=.92,b0=.04,... [default: own starts]
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    pub start: Option<String>,
    /// Coefficients held at a value, as d1=-0.85,f1=-1.9
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    pub fix: Option<String>,
    /// Bounds of coefficients, as b0=0..0.2,f2=..0.99; an end may be left open
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    pub bound: Option<String>,
    /// Guesses of coefficients with a weight W, as f1=-1.9:0.5: the loss grows by W (f1 + 1.9)^2
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    pub prior: Option<String>,
    /// Loss of Huber instead of squares: residuals beyond K standard deviations count linearly
    #[arg(long, value_name = "K", num_args = 0..=1, default_missing_value = "1.345")]
    pub robust: Option<f64>,
    /// What the model is to be good at: one-step prediction, or simulation from the input alone
    #[arg(long, value_name = "WHAT", default_value = "prediction")]
    pub focus: FocusName,
    /// Take only models that are stable from e to u (C and F always are stable)
    #[arg(long)]
    pub stable: bool,
    /// How the search steps: gn Gauss-Newton, lm Levenberg-Marquardt, grad steepest descent
    #[arg(long, value_name = "METHOD", default_value = "auto")]
    pub search_method: SearchMethodName,
    /// Largest number of search steps from each start
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub max_iterations: usize,
    /// Relative decrease of the loss below which the search has converged
    #[arg(long, value_name = "X", default_value = "1e-12")]
    pub tolerance: f64,
    /// Discretisation that is inverted to get T_n and K_n from the noise model
    #[arg(long, value_name = "NAME", default_value = "zoh", value_parser = choice_of(&RemnantDiscretisation::ALL))]
    pub remnant_discretisation: RemnantDiscretisation,
    /// Controlled element NUM/DEN by descending powers of s, as 90/1,6,0: adds crossover frequency and margins
    #[arg(long, value_name = "NUM/DEN", value_parser = parse_transfer_function, allow_hyphen_values = true)]
    pub controlled_element: Option<ContinuousTransferFunction>,
    /// Also judge the prediction K samples ahead
    #[arg(long, value_name = "K")]
    pub horizon: Option<usize>,
    /// Another record to judge the model on
    #[arg(long, value_name = "FILE")]
    pub validate: Option<PathBuf>,
    /// Write a report (HTML) into this directory
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct InfoArgs {
    /// File of any format that is read: CSV, Parquet, NPZ, NPY, MATLAB .mat, XDF
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(group(clap::ArgGroup::new("what").required(true).args(["f", "operator", "transfer_function"])))]
pub struct ConvertArgs {
    /// F of the discrete operator: f1,f2
    #[arg(
        long,
        value_name = "F1,F2",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true,
        requires = "b"
    )]
    pub f: Option<Vec<f64>>,
    /// B of the discrete operator: b0,b1
    #[arg(
        long,
        value_name = "B0,B1",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true,
        requires = "f"
    )]
    pub b: Option<Vec<f64>>,
    /// Delay of b0 in samples
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub nk: usize,
    /// Operator parameters: K_e=.09,T_L=.4,omega_nm=11.25,zeta_nm=.35,tau_e=.28 (K_e_dot may stand for T_L)
    #[arg(long, value_name = "LIST", value_parser = parse_numbers, allow_hyphen_values = true)]
    pub operator: Option<std::vec::Vec<(String, f64)>>,
    /// Transfer function NUM/DEN to discretise, by descending powers of s, as 1,2/1,3,4
    #[arg(long, value_name = "NUM/DEN", value_parser = parse_transfer_function, allow_hyphen_values = true)]
    pub transfer_function: Option<ContinuousTransferFunction>,
    /// Discretisation of the transfer function
    #[arg(long, value_name = "NAME", default_value = "zoh")]
    pub method: MethodName,
    /// Prewarp frequency in rad/s, for --method prewarped
    #[arg(long, value_name = "RAD/S", required_if_eq("method", "prewarped"))]
    pub prewarp: Option<f64>,
    /// Sample time Ts in s
    #[arg(long, value_name = "S", default_value_t = 0.01)]
    pub sample_time: f64,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct MarginsArgs {
    #[command(flatten)]
    pub base: ScenarioChoice,
    /// Which state of a scenario that changes
    #[arg(long, value_name = "WHICH", default_value = "initial")]
    pub state: StateName,
    /// Noise levels P_n for the remnant gains
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [0.01, 0.1, 0.2, 0.3])]
    pub noise_levels: Vec<f64>,
    /// What the noise level is a share of: var(u_n)/var(u) or var(n)/var(u)
    #[arg(long, value_name = "WHICH", default_value = "response", value_parser = choice_of(&NoiseDefinition::ALL))]
    pub noise_definition: NoiseDefinition,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub json: bool,
}

/// What `identify` fits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A polynomial structure.
    Polynomial(Structure),
    /// The operator and its remnant in physical parameters.
    GreyBox,
    /// The operator with gains that change once.
    TimeVarying,
}

impl Kind {
    /// The names that are typed, in the order of the help page.
    fn named() -> impl Iterator<Item = (&'static str, Self)> {
        let structures = Structure::ALL.map(|structure| (structure.name(), Self::Polynomial(structure)));
        let others = [("grey-box", Self::GreyBox), ("time-varying", Self::TimeVarying)];
        structures.into_iter().chain(others)
    }
}

/// `LO..HI`, finite and in order.
fn parse_span(text: &str) -> Result<(f64, f64), String> {
    let number = |part: &str| part.trim().parse::<f64>().ok().filter(|v| v.is_finite());
    let ends = text
        .split_once("..")
        .and_then(|(low, high)| Some((number(low)?, number(high)?)));
    match ends {
        Some((low, high)) if low <= high => Ok((low, high)),
        _ => Err(format!("{text:?} is no span; write LO..HI with LO <= HI, as 0.05..0.6")),
    }
}

/// A name on the command line for each value of a type of the library.
macro_rules! names {
    ($name:ident for $target:ty { $($variant:ident = $value:expr),+ $(,)? }) => {
        #[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
        pub enum $name { $($variant),+ }
        impl From<$name> for $target {
            fn from(name: $name) -> Self {
                match name { $($name::$variant => $value),+ }
            }
        }
    };
}

mod choice;
mod group;
mod reading;
mod recursion;
mod study;

pub use group::{GroupArgs, GroupCommand, GroupInitArgs, GroupRunArgs, SimulateGroupArgs};
pub use reading::{MaskArgs, ReadArgs};
pub use recursion::{ForgettingName, RecursionArgs, StreamArgs, TrackArgs};
pub use study::{ReproduceArgs, StudyCommand, StudyMergeArgs, StudyRunArgs};

names!(FitMethodName for Option<IvMethod> {
    Pem = None,
    Iv4 = Some(IvMethod::Iv4),
    Sriv = Some(IvMethod::Sriv),
    Rivbj = Some(IvMethod::RivBj),
});
names!(FocusName for Focus { Prediction = Focus::Prediction, Simulation = Focus::Simulation });
names!(SearchMethodName for SearchMethod {
    Auto = SearchMethod::Automatic,
    Gn = SearchMethod::GaussNewton,
    Lm = SearchMethod::LevenbergMarquardt,
    Grad = SearchMethod::SteepestDescent,
});
names!(CriterionName for Criterion {
    Loss = Criterion::Loss,
    Aic = Criterion::Aic,
    Aicc = Criterion::Aicc,
    Bic = Criterion::Bic,
    Fpe = Criterion::Fpe,
    Mdl = Criterion::Mdl,
    Yic = Criterion::Yic,
});
names!(InitialStateName for Option<InitialState> {
    Auto = None,
    Zero = Some(InitialState::Zero),
    Estimate = Some(InitialState::Estimate),
    Backcast = Some(InitialState::Backcast),
});
/// A discretisation; prewarping needs its frequency besides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum MethodName {
    Zoh,
    Foh,
    Tustin,
    Prewarped,
    ForwardEuler,
    BackwardEuler,
    Matched,
}

impl MethodName {
    /// The method of the library.
    pub fn method(self, prewarp_rad_s: Option<f64>) -> discretise::Method {
        match self {
            Self::Zoh => discretise::Method::ZeroOrderHold,
            Self::Foh => discretise::Method::FirstOrderHold,
            Self::Tustin => discretise::Method::Tustin,
            Self::Prewarped => discretise::Method::TustinPrewarped {
                omega_rad_s: prewarp_rad_s.unwrap_or(f64::NAN),
            },
            Self::ForwardEuler => discretise::Method::ForwardEuler,
            Self::BackwardEuler => discretise::Method::BackwardEuler,
            Self::Matched => discretise::Method::Matched,
        }
    }
}

/// Which state of a scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum StateName {
    Initial,
    Last,
}

/// `NUM/DEN`, coefficients by descending powers of s, separated by commas.
pub fn parse_transfer_function(text: &str) -> Result<ContinuousTransferFunction, String> {
    let usage = "write NUM/DEN by descending powers of s, as 90/1,6,0";
    let (num, den) = text
        .split_once('/')
        .ok_or_else(|| format!("{text:?} has no '/'; {usage}"))?;
    let coefficients = |part: &str| {
        part.split(',')
            .map(|c| {
                c.trim()
                    .parse::<f64>()
                    .map_err(|_| format!("{c:?} is no number; {usage}"))
            })
            .collect::<Result<Vec<f64>, String>>()
    };
    ContinuousTransferFunction::new(&coefficients(num)?, &coefficients(den)?).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_definitions_do_not_contradict_each_other() {
        Cli::command().debug_assert();
    }

    /// The help pages as a page of the book.
    fn reference_page() -> String {
        let mut page = "# Command line\n\nThe help pages of the program, word for word.\n".to_owned();
        let mut cli = Cli::command().term_width(110);
        cli.build();
        for command in cli.get_subcommands_mut().filter(|c| c.get_name() != "help") {
            let help = command.render_long_help().to_string();
            let trimmed: Vec<&str> = help.lines().map(str::trim_end).collect();
            page.push_str(&format!(
                "\n## hoid {}\n\n```text\n{}\n```\n",
                command.get_name(),
                trimmed.join("\n").trim_end()
            ));
        }
        page
    }

    #[test]
    fn the_book_has_the_help_pages() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/reference/command-line.md");
        let page = reference_page();
        if std::env::var_os("HOID_UPDATE_DOCS").is_some() {
            std::fs::write(path, &page).unwrap();
        }
        let book = std::fs::read_to_string(path).unwrap();
        assert_eq!(
            book, page,
            "run HOID_UPDATE_DOCS=1 cargo test -p hoid-cli to renew the page"
        );
    }

    #[test]
    fn transfer_functions_as_typed() {
        let h = parse_transfer_function("90/1,6,0").unwrap();
        assert_eq!((h.num(), h.den()), (&[90.0][..], &[1.0, 6.0, 0.0][..]));
        for bad in ["90", "a/1", "1,0,0/1", "1/0", ""] {
            assert!(parse_transfer_function(bad).is_err(), "{bad}");
        }
    }
}
