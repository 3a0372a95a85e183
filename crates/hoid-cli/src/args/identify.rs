//! Options of `hoid identify`.

use std::{ops::RangeInclusive, path::PathBuf};

use clap::Args;
use hoid_ident::{Focus, InitialState, IvMethod, SearchMethod, order_selection::Criterion};
use hoid_model::{ContinuousTransferFunction, Structure, remnant::RemnantDiscretisation};

use super::{
    choices::{by_name, choice_of},
    parse::{parse_span, parse_transfer_function},
    reading::{MaskArgs, ReadArgs},
};
use crate::orders::parse_range;

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
    #[arg(long, value_name = "NAME", value_parser = by_name(ModelKind::named()))]
    pub structure: Option<ModelKind>,
    /// How: pem the prediction error method; iv4 (for arx), sriv (for oe), rivbj (for bj) instrumental variables
    #[arg(long, value_name = "NAME", default_value = "pem", value_parser = by_name(fit_methods()))]
    pub method: std::option::Option<IvMethod>,
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
    #[arg(long, value_name = "NAME", default_value = "bic", value_parser = choice_of(&Criterion::ALL))]
    pub criterion: Criterion,
    /// Initial states of each record; auto: estimate, and backcast for an output alone (ar, ma, arma)
    #[arg(long, value_name = "RULE", default_value = "auto", value_parser = by_name(initial_states()))]
    pub initial_state: std::option::Option<InitialState>,
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
    #[arg(long, value_name = "WHAT", default_value = "prediction", value_parser = choice_of(&Focus::ALL))]
    pub focus: Focus,
    /// Take only models that are stable from e to u (C and F always are stable)
    #[arg(long)]
    pub stable: bool,
    /// How the search steps: gn Gauss-Newton, lm Levenberg-Marquardt, grad steepest descent
    #[arg(long, value_name = "METHOD", default_value = "auto", value_parser = choice_of(&SearchMethod::ALL))]
    pub search_method: SearchMethod,
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

/// What `identify` fits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// A polynomial structure.
    Polynomial(Structure),
    /// The operator and its remnant in physical parameters.
    GreyBox,
    /// The operator with gains that change once.
    TimeVarying,
}

impl ModelKind {
    /// The names that are typed, in the order of the help page.
    fn named() -> impl Iterator<Item = (&'static str, Self)> {
        let structures = Structure::ALL.map(|structure| (structure.name(), Self::Polynomial(structure)));
        let others = [("grey-box", Self::GreyBox), ("time-varying", Self::TimeVarying)];
        structures.into_iter().chain(others)
    }
}

/// Instrumental variables by name, and the prediction error method, which is none of them.
fn fit_methods() -> impl Iterator<Item = (&'static str, Option<IvMethod>)> {
    let instruments = IvMethod::ALL.map(|method| (method.name(), Some(method)));
    [("pem", None)].into_iter().chain(instruments)
}

/// The rules for initial states by name; automatic is none of them.
fn initial_states() -> impl Iterator<Item = (&'static str, Option<InitialState>)> {
    let rules = InitialState::ALL.map(|rule| (rule.name(), Some(rule)));
    [("auto", None)].into_iter().chain(rules)
}
