//! Options of `hoid compare`.

use std::path::PathBuf;

use clap::Args;
use hoid::design::compare::{Adjustment, Covariate, Factor, Quantity, Weights};

use super::{choices::choice_parser, figure::FigureArgs, output_options::ShowArgs};

#[derive(Debug, Args)]
pub struct CompareArgs {
    /// Directory written by `hoid group DIR --out`, output of `hoid group --json`, or recordings with a manifest
    /// (group.toml), which are analysed first
    #[arg(value_name = "DIR|MANIFEST|RESULTS.json")]
    pub results: PathBuf,
    /// Factor to compare: NAME:LEVEL=A,B;LEVEL=C, where A, B, C are conditions or people; repeat for several factors
    /// and their interactions [default: factor condition, with each condition as a level]
    #[arg(long, value_name = "FACTOR")]
    pub factor: Vec<Factor>,
    /// The factor varies within people: each person is at all levels [default: detected]
    #[arg(long, conflicts_with = "between")]
    pub within: bool,
    /// The factor varies between people: each person is at one level
    #[arg(long)]
    pub between: bool,
    /// Quantities to compare, comma-separated: crossover, phase_margin, tau_e, gain_db@W and phase_deg@W at W rad/s,
    /// rms_e, rms_u, parameters such as K, T_L (recordings are then fitted with one form, chosen on the data of all
    /// people), or parameters of the response to a further input, such as tau_f[f_t] [default:
    /// crossover,phase_margin,tau_e]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub of: Vec<Quantity>,
    /// Remove the trend over this covariate from the estimates, and report its slope
    #[arg(long, value_name = "NAME", value_parser = choice_parser(&Covariate::ALL))]
    pub covariate: Option<Covariate>,
    /// Adjustment for multiple tests
    #[arg(long, value_name = "METHOD", default_value = "holm", value_parser = choice_parser(&Adjustment::ALL))]
    pub adjust: Adjustment,
    /// Estimator of the variance between people: penalised (kept away from zero) or reml (restricted maximum
    /// likelihood; intervals too short with few people)
    #[arg(long, value_name = "METHOD", default_value = "penalised", value_parser = choice_parser(&Weights::ALL))]
    pub weights: Weights,
    /// Directory for all results: comparison.json, differences.csv, .md and .tex, people.svg, sentences.txt, and the
    /// analysis of recordings, which the next run reuses
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Threads for the analysis of recordings [default: one per core]
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    #[command(flatten)]
    pub picture: FigureArgs,
    #[command(flatten)]
    pub show: ShowArgs,
}
