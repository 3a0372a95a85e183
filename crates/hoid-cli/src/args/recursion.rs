//! The options of `hoid track` and `hoid stream`.

use std::{ops::RangeInclusive, path::PathBuf};

use clap::{Args, ValueEnum};
use hoid_io::Scaling;
use hoid_model::Structure;
use hoid_track::{Memory, Method, Stable};

use super::{CriterionName, ReadArgs, parse_span};
use crate::orders::parse_range;

names!(RecursiveMethodName for Method {
    Rls = Method::Rls,
    Rpem = Method::Rpem,
    Physical = Method::Physical,
    Window = Method::Window,
    Rriv = Method::Refined,
    Adaptive = Method::Adaptive,
    Fused = Method::Fused,
    Ekf = Method::Ekf,
    Ukf = Method::Ukf,
});
names!(PolynomialStructureName for Structure {
    Arx = Structure::Arx,
    Armax = Structure::Armax,
    Oe = Structure::OutputError,
    Bj = Structure::BoxJenkins,
    Fir = Structure::Fir,
    Ar = Structure::Ar,
    Ma = Structure::Ma,
    Arma = Structure::Arma,
    Ararx = Structure::Ararx,
    Ararmax = Structure::Ararmax,
    General = Structure::General,
});
names!(StableName for Stable { Predictor = Stable::Predictor, Noise = Stable::PredictorAndNoise });

/// How a recursion forgets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ForgettingName {
    Exponential,
    RandomWalk,
    Window,
    Variable,
    Directional,
    Gradient,
}

/// What is tracked, and how.
#[derive(Debug, Args)]
pub struct RecursionArgs {
    /// The recursion: rls least squares (arx, fir); rpem prediction error method (every structure); physical the same in the
    /// operator's parameters; window a batch fit of the last seconds, again and again; rriv refined instrumental variable; adaptive a bank of
    /// hypotheses of when the person changed, which sets its memory itself and tells of changes; for comparison: fused (least squares with the poles of rpem),
    /// ekf and ukf (Kalman filters of state and parameters, extended and unscented)
    #[arg(long, value_name = "NAME", default_value = "physical")]
    pub method: RecursiveMethodName,
    /// Polynomial structure [default: arx for rls, else bj]
    #[arg(long, value_name = "NAME")]
    pub structure: Option<PolynomialStructureName>,
    /// Orders, each a number or a range to search on the start span, as nb=2,nc=0,nd=1..4,nf=2
    /// [default: the operator's: bj nb=2,nd=1..4,nf=2, for adaptive nd=6; arx na=2,nb=2]
    #[arg(long, value_name = "LIST")]
    pub orders: Option<String>,
    /// Delay of b0 in samples, a number or a range to search on the start span [default: 0.05 to 0.6 s]
    #[arg(long, value_name = "N|LO..HI", value_parser = parse_range)]
    pub nk: Option<RangeInclusive<usize>>,
    /// What decides between candidates when something is searched
    #[arg(long, value_name = "NAME", default_value = "bic")]
    pub criterion: CriterionName,
    /// Where the recursion starts: all coefficients as f1=-1.9,f2=.92,b0=.04,... or `nothing`
    /// [default: a batch fit of the start span, or of the warm-up]
    #[arg(long, value_name = "LIST|nothing", allow_hyphen_values = true)]
    pub start: Option<String>,
    /// Memory of all parameters, in which the weight of a sample falls to 1/e: samples (256), seconds (2.56s) or inf
    /// [default: rls 2.56s; rpem, rriv 2.56s for b, 20.48s for the others; fused 2.56s for b, inf for the others; physical 5s for K_e, 1.5s for K_e_dot, inf for the others]
    #[arg(long, value_name = "N|Ss|inf", value_parser = str::parse::<Memory>)]
    pub memory: Option<Memory>,
    /// Factor of forgetting instead of --memory: lambda = 1 - 1/memory in samples
    #[arg(long, value_name = "L", value_parser = parse_lambda, conflicts_with = "memory")]
    pub lambda: Option<Memory>,
    /// Memory of single parameters, or of all of one letter, as b0=256,f=inf,K_e=5s
    #[arg(long, value_name = "LIST", value_parser = parse_memories)]
    pub memory_of: Option<std::vec::Vec<(String, Memory)>>,
    /// How it forgets; window, variable and directional take the shortest memory
    #[arg(long, value_name = "HOW", default_value = "exponential")]
    pub forgetting: ForgettingName,
    /// For --forgetting random-walk: by how much a parameter drifts in one second (standard deviation), as K_e=.01,K_e_dot=.01
    #[arg(long, value_name = "LIST", value_parser = crate::orders::parse_numbers)]
    pub drift: Option<std::vec::Vec<(String, f64)>>,
    /// For --forgetting gradient: step size, between 0 and 2 [default: 0.1]
    #[arg(long, value_name = "X")]
    pub rate: Option<f64>,
    /// Covariance P at the start: X times the unit matrix, in units of the innovation variance (the reference text: 0.1)
    /// [default: that of the start fit; 1e6 where there is none]
    #[arg(long, value_name = "X")]
    pub covariance: Option<f64>,
    /// Pseudo-linear regression (extended least squares) instead of the gradient, for rpem
    #[arg(long)]
    pub pseudo_linear: bool,
    /// Polynomials kept stable: predictor (C and F), or noise (D too)
    #[arg(long, value_name = "WHICH", default_value = "predictor")]
    pub stable: StableName,
    /// Bounds of physical parameters, as omega_nm=5..30,zeta_nm=0.1.., for physical, adaptive, ekf and ukf
    #[arg(long, value_name = "LIST", allow_hyphen_values = true)]
    pub bound: Option<String>,
    /// Track the delay tau_e too, within this range in s: as a parameter for physical, in whole samples for adaptive
    #[arg(long, value_name = "LO..HI", value_parser = parse_span)]
    pub track_delay: Option<(f64, f64)>,
    /// Length of the window for --method window: samples or seconds [default: 20s]
    #[arg(long, value_name = "N|Ss", value_parser = str::parse::<Memory>)]
    pub window: Option<Memory>,
    /// Samples between two fits for --method window [default: 25]
    #[arg(long, value_name = "N")]
    pub refit: Option<usize>,
    /// Standard deviations beyond which an innovation moves the estimate no further: a number or inf [default: 5 for rpem, fused
    /// and physical, 3.5 for adaptive, inf for rls]
    #[arg(long, value_name = "K")]
    pub limit: Option<f64>,
    /// For --method adaptive: logarithm of the odds from which a change is declared [default: 6]
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    pub alarm: Option<f64>,
    /// Magnitude of e or u beyond which a sample is taken for a fault and skipped
    #[arg(long, value_name = "X", default_value = "1e6")]
    pub largest: f64,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct TrackArgs {
    /// Record file (CSV, Parquet, NPZ, MATLAB .mat, XDF)
    #[arg(value_name = "RECORD")]
    pub record: PathBuf,
    #[command(flatten)]
    pub read: ReadArgs,
    #[command(flatten)]
    pub recursion: RecursionArgs,
    /// Span of the start fit, s [default: the first third of the record]
    #[arg(long, value_name = "S..S", value_parser = parse_span, allow_hyphen_values = true)]
    pub start_span: Option<(f64, f64)>,
    /// Time from which the estimate moves, s; before it only the filters follow
    /// [default: the end of the start span; the first sample with --covariance or --start]
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub update_from: Option<f64>,
    /// Mean of the estimate over the last S seconds in place of each; it lags by S/2
    #[arg(long, value_name = "S")]
    pub moving_average: Option<f64>,
    /// For --method adaptive: at each sample what all of the record says of it, by hypotheses run from both ends, in place of what the past alone says
    #[arg(long)]
    pub smooth: bool,
    /// Keep every N-th sample of the trace
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = parse_count)]
    pub every: usize,
    /// File for the trace (CSV, Parquet, NPZ or .mat): the estimate at each sample with its standard errors
    #[arg(long, value_name = "TRACE")]
    pub out: PathBuf,
    /// Write a report (HTML) into this directory: parameters over time with bands, innovations, standard errors
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// Spans in s whose batch fits the report draws as dashed lines, as 0..30.72,51.2..81.92
    /// [default: the start span and the last third]
    #[arg(long, value_name = "S..S", value_parser = parse_span, value_delimiter = ',', allow_hyphen_values = true)]
    pub batch: Vec<(f64, f64)>,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct StreamArgs {
    /// Sampling frequency in Hz
    #[arg(long, value_name = "HZ", value_parser = parse_frequency)]
    pub fs: f64,
    #[command(flatten)]
    pub recursion: RecursionArgs,
    /// Seconds that are collected before the start fit [default: 20; none with --start]
    #[arg(long, value_name = "S", conflicts_with = "start")]
    pub warm_up: Option<f64>,
    /// Print a line for every N-th sample only
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = parse_count)]
    pub every: usize,
    /// Column of the input (tracking error) in the header line, where there is one
    #[arg(long, value_name = "NAME", default_value = "e")]
    pub input: String,
    /// Column of the output (control) in the header line, where there is one
    #[arg(long, value_name = "NAME", default_value = "u")]
    pub output: String,
    /// Multiply e or u: by a factor (u=12.5) or from unit to unit (e=rad:deg). May be repeated
    #[arg(long, value_name = "e|u=FACTOR", value_parser = super::reading::parse_scale)]
    pub scale: Vec<(String, Scaling)>,
}

fn parse_lambda(text: &str) -> Result<Memory, String> {
    match text.trim().parse::<f64>() {
        Ok(1.0) => Ok(Memory::Infinite),
        Ok(lambda) if lambda > 0.0 && lambda < 1.0 => Ok(Memory::Samples(1.0 / (1.0 - lambda))),
        _ => Err(format!(
            "{text:?} is no factor of forgetting; write a number above 0 and up to 1, as 0.996"
        )),
    }
}

fn parse_memories(text: &str) -> Result<Vec<(String, Memory)>, String> {
    crate::orders::parse_pairs(text)?
        .into_iter()
        .map(|(name, value)| match value.parse::<Memory>() {
            Ok(memory) => Ok((name, memory)),
            Err(e) => Err(format!("{name}: {e}")),
        })
        .collect()
}

fn parse_count(text: &str) -> Result<usize, String> {
    match text.trim().parse::<usize>() {
        Ok(n) if n > 0 => Ok(n),
        _ => Err(format!("{text:?} is no number of samples; write 1 or more")),
    }
}

fn parse_frequency(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(hz) if hz > 0.0 && hz.is_finite() => Ok(hz),
        _ => Err(format!(
            "{text:?} is no frequency; write a positive number in Hz, as 100"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memories_as_typed() {
        assert_eq!(parse_lambda("0.75").unwrap(), Memory::Samples(4.0));
        assert_eq!(parse_lambda("1").unwrap(), Memory::Infinite);
        for bad in ["0", "1.1", "-1", "x", "NaN"] {
            assert!(parse_lambda(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_memories("b=256, f1=inf").unwrap().len(), 2);
        assert!(parse_memories("b0").is_err() && parse_memories("b0=0").is_err());
        assert!(parse_count("0").is_err() && parse_frequency("0").is_err());
    }
}
