//! Options of `hoid identify`: input and output. Options of the estimators are in the registry of the library.

use std::path::PathBuf;

use clap::{
    Args,
    builder::{PossibleValue, PossibleValuesParser},
};
use hoid::analysis::{
    AxisPair,
    registry::{OPERATOR, PEM},
};
use hoid::ident::IvMethod;
use hoid::io::{readable_extensions, writable_extensions};
use hoid::model::{Structure, remnant::RemnantDiscretisation};

use super::{
    choices::choice_parser,
    figure::FigureArgs,
    output_options::ShowArgs,
    parse::parse_horizon,
    reading::{FaultArgs, MaskArgs, ReadArgs},
    settings::{BatchEstimators, SettingArgs},
};

#[derive(Debug, Args)]
pub struct IdentifyArgs {
    #[arg(
        required = true,
        value_name = "RECORD",
        help = "Record files, such as .csv, .parquet or .mat; several files share one model",
        long_help = format!(
            "Record files: {}; several files share one model, each with its own initial states",
            readable_extensions()
        )
    )]
    pub records: Vec<PathBuf>,
    #[command(flatten)]
    pub read: ReadArgs,
    /// Error and control columns of an axis (ex,ux), optionally with its excitation (ex,ux,rx). Repeat for each axis;
    /// each has its own operator, and coupling between axes is tested
    #[arg(long, value_name = "INPUT,OUTPUT[,EXCITATION]", conflicts_with_all = ["input", "output"], allow_hyphen_values = true)]
    pub pair: Vec<AxisPair>,
    #[command(flatten)]
    pub mask: MaskArgs,
    #[command(flatten)]
    pub faults: FaultArgs,
    /// Model to fit: operator (human operator) or a polynomial structure [default: operator; with --method, its
    /// structure; with polynomial options such as --nk, bj]
    #[arg(long, value_name = "NAME", value_parser = structure_parser(), ignore_case = true)]
    pub structure: Option<String>,
    /// Fitting method for polynomials: pem (prediction error), or instrumental variables (iv4 for arx, sriv for oe,
    /// rivbj for bj)
    #[arg(long, value_name = "NAME", default_value = PEM, value_parser = PossibleValuesParser::new(fit_methods()))]
    pub method: String,
    #[command(flatten)]
    pub options: SettingArgs<BatchEstimators>,
    #[arg(long, value_name = "FILE", help = format!(
        "With --change sigmoid: write K_e, T_L, K_e_dot (K, T_L for other forms) over time to this file: {}",
        writable_extensions()
    ))]
    pub trace: Option<PathBuf>,
    /// Discretisation assumed to get T_n and K_n from the noise model
    #[arg(long, value_name = "NAME", default_value = "zoh", value_parser = choice_parser(&RemnantDiscretisation::ALL))]
    pub remnant_discretisation: RemnantDiscretisation,
    #[command(flatten)]
    pub picture: FigureArgs,
    /// Also evaluate the prediction of a polynomial model K samples ahead
    #[arg(long, value_name = "K", value_parser = parse_horizon)]
    pub horizon: Option<usize>,
    /// Also evaluate the model on this record
    #[arg(long, value_name = "FILE")]
    pub validate: Option<PathBuf>,
    /// Write an HTML report to this directory
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    #[command(flatten)]
    pub show: ShowArgs,
}

/// Returns a parser for the structures; earlier names are accepted but not shown.
fn structure_parser() -> PossibleValuesParser {
    let polynomials = Structure::ALL.map(|structure| PossibleValue::new(structure.name()));
    let before = ["grey-box", "family", "time-varying"].map(|name| PossibleValue::new(name).hide(true));
    let all = [PossibleValue::new(OPERATOR)].into_iter().chain(polynomials);
    PossibleValuesParser::new(all.chain(before))
}

fn fit_methods() -> impl Iterator<Item = PossibleValue> {
    let instruments = IvMethod::ALL.map(IvMethod::name);
    [PEM].into_iter().chain(instruments).map(PossibleValue::new)
}
