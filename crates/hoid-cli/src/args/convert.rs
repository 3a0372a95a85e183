//! Options of `hoid convert` and `hoid info`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use hoid::io::readable_extensions;
use hoid::model::{ContinuousTransferFunction, discretise};

use super::examination::ExaminationArgs;
use crate::orders::parse_numbers;

#[derive(Debug, Args)]
pub struct InfoArgs {
    #[arg(value_name = "FILE", help = format!("File to inspect: {}", readable_extensions()))]
    pub file: PathBuf,
    #[command(flatten)]
    pub examination: ExaminationArgs,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(group(clap::ArgGroup::new("what").required(true).args(["f", "operator", "transfer_function"])))]
pub struct ConvertArgs {
    /// F of the discrete operator: f1,f2 for a gain with a lead; one or three coefficients for other forms
    #[arg(
        long,
        value_name = "F1,F2,...",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true,
        requires = "b"
    )]
    pub f: Option<Vec<f64>>,
    /// B of the discrete operator: b0,b1, or as many coefficients as the form has
    #[arg(
        long,
        value_name = "B0,B1,...",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true,
        requires = "f"
    )]
    pub b: Option<Vec<f64>>,
    /// Delay of b0 in samples
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub nk: usize,
    /// Operator parameters: K_e=.09,T_L=.4,omega_nm=11.25,zeta_nm=.35,tau_e=.28 (K_e_dot may replace T_L)
    #[arg(long, value_name = "LIST", value_parser = parse_numbers, allow_hyphen_values = true)]
    pub operator: Option<std::vec::Vec<(String, f64)>>,
    /// Transfer function to discretise, such as (s+2)/(s^2+3s+4), or NUM/DEN in descending powers of s, such as
    /// 1,2/1,3,4
    #[arg(long, value_name = "H", allow_hyphen_values = true)]
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

/// A discretisation; `Prewarped` also needs a frequency.
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
    /// Returns the corresponding method of the library.
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
