//! Options of `hoid compare`.

use std::path::PathBuf;

use clap::Args;
use hoid::design::compare::{Adjustment, Covariate, Factor, Quantity, Weights};

use super::{choices::choice_of, figure::FigureArgs, show::ShowArgs};

#[derive(Debug, Args)]
pub struct CompareArgs {
    /// Recordings with their manifest (group.toml), which are analysed first; or results: the directory that
    /// `hoid group DIR --out` wrote, or what `hoid group --json` printed
    #[arg(value_name = "DIR|MANIFEST|RESULTS.json")]
    pub results: PathBuf,
    /// Differences between conditions or people, as NAME:LEVEL=A,B;LEVEL=C with conditions or people of the group;
    /// repeat it for several factors and their interactions [default: each condition is a level of the factor
    /// condition]
    #[arg(long, value_name = "FACTOR")]
    pub factor: Vec<Factor>,
    /// The factor varies within people: each is in all of its levels [default: found from the group]
    #[arg(long, conflicts_with = "between")]
    pub within: bool,
    /// The factor varies between people: each is in one of its levels
    #[arg(long)]
    pub between: bool,
    /// Quantities compared, separated by commas: crossover, phase_margin, tau_e, gain_db@W and phase_deg@W at W rad/s,
    /// rms_e, rms_u, or parameters such as K, T_L, for which recordings are analysed in one form, chosen by the
    /// evidence of all people [default: crossover,phase_margin,tau_e]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub of: Vec<Quantity>,
    /// Trend removed from the estimates, with its slope told: run
    #[arg(long, value_name = "NAME", value_parser = choice_of(&Covariate::ALL))]
    pub covariate: Option<Covariate>,
    /// Treatment of many tests: holm or none
    #[arg(long, value_name = "METHOD", default_value = "holm", value_parser = choice_of(&Adjustment::ALL))]
    pub adjust: Adjustment,
    /// How people are weighted: by a variance between them that is kept away from zero (penalised), or that of
    /// the restricted likelihood (reml), whose intervals are too short for few people
    #[arg(long, value_name = "METHOD", default_value = "penalised", value_parser = choice_of(&Weights::ALL))]
    pub weights: Weights,
    /// Directory for all of it: comparison.json, differences.csv, .md and .tex, people.svg, sentences.txt, and the
    /// results of recordings, which are not analysed again
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Threads for recordings. Default: one a core
    #[arg(long, value_name = "J", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    #[command(flatten)]
    pub picture: FigureArgs,
    #[command(flatten)]
    pub show: ShowArgs,
}
