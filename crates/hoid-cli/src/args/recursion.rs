//! The options of `hoid track` and `hoid stream`.

use std::path::PathBuf;

use clap::{
    Args,
    builder::{PossibleValue, PossibleValuesParser, TypedValueParser},
};
use hoid::ident::{
    order_selection::Criterion,
    settings::{DelayRange, MethodSpec, NumberOrSpan},
};
use hoid::io::{Scaling, readable_extensions, writable_extensions};
use hoid::model::{ContinuousTransferFunction, Structure};
use hoid::survey::is_for_comparison;
use hoid::thesis::comparators;
use hoid::track::Method;

use super::{
    ReadArgs,
    choices::choice_parser,
    figure::FigureArgs,
    output_options::ShowArgs,
    parse::{parse_count, parse_frequency},
    parse_span,
    reading::DecimateArgs,
    settings::SettingArgs,
    udp::UdpAddresses,
};

/// Options of a recursion.
#[derive(Debug, Args)]
pub struct RecursionArgs {
    /// Recursive method
    #[arg(long, value_name = "NAME", long_help = method_help(), default_value_t = Method::default().name().to_owned(), value_parser = method_names())]
    pub method: String,
    /// Polynomial structure [default: arx for rls, else bj]
    #[arg(long, value_name = "NAME", value_parser = choice_parser(&Structure::ALL))]
    pub structure: Option<Structure>,
    /// Orders, or ranges to search on the start span, such as nb=2,nc=0,nd=1..4,nf=2 [default: bj nb=2,nd=1..4,nf=2
    /// (adaptive: nd=16; multiple-model: nd=6); arx na=2,nb=2]
    #[arg(long, value_name = "LIST")]
    pub orders: Option<String>,
    /// Delay of b0 in samples (29) or dead time in s (0.28s), or a range (20..40, 0.1s..0.4s) to search on the start
    /// span; with two inputs one number each (29,12) [default: 0.05 to 0.6 s; adaptive starts at 0.2 s and tracks the
    /// delay]
    #[arg(long, value_name = "N|Ss|LO..HI", value_delimiter = ',')]
    pub nk: Vec<DelayRange>,
    /// Delay tau_e in s, instead of --nk: .28, or a range (0.1..0.4) to search on the start span
    #[arg(long, value_name = "S|LO..HI", conflicts_with = "nk")]
    pub delay: Option<NumberOrSpan>,
    /// Criterion that selects among the candidates
    #[arg(long, value_name = "NAME", default_value = "bic", value_parser = choice_parser(&Criterion::ALL))]
    pub criterion: Criterion,
    /// Initial values of all coefficients, such as f1=-1.9,f2=.92,b0=.04,..., or `nothing` [default: a batch fit of the
    /// start span or warm-up; adaptive starts from --prior]
    #[arg(long, value_name = "LIST|nothing", allow_hyphen_values = true)]
    pub start: Option<String>,
    #[command(flatten)]
    pub settings: SettingArgs,
    /// Magnitude of e or u above which a sample is skipped as faulty
    #[arg(long, value_name = "X", default_value = "1e6")]
    pub largest: f64,
    /// Report gain and phase, with errors, at these frequencies in rad/s, such as 0.5,1,2.5
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub at: Vec<f64>,
    /// Controlled element, such as 90/(s(s+6)) or 90/1,6,0 (NUM/DEN in descending powers of s): adds crossover
    /// frequency and phase margin, with errors
    #[arg(long, value_name = "ELEMENT", allow_hyphen_values = true)]
    pub controlled_element: Option<ContinuousTransferFunction>,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct TrackArgs {
    #[arg(value_name = "RECORD", required_unless_present = "methods", help = format!("Record file: {}", readable_extensions()))]
    pub record: Option<PathBuf>,
    #[command(flatten)]
    pub read: ReadArgs,
    /// List all methods, including those for comparison, with description, structures and source. Needs no RECORD
    #[arg(long, conflicts_with = "record")]
    pub methods: bool,
    #[command(flatten)]
    pub recursion: RecursionArgs,
    /// Role of a second --input: feedforward, motion or output, such as r=motion [default: feedforward]; with the method
    /// adaptive also its preview in s (r=feedforward:0.5). The methods rls and rpem require --nk for two inputs
    #[arg(long, value_name = "COLUMN=ROLE")]
    pub role: Option<String>,
    /// Span of the start fit in s, for methods that have one [default: the first third of the record]
    #[arg(long, value_name = "S..S", value_parser = parse_span, allow_hyphen_values = true)]
    pub start_span: Option<(f64, f64)>,
    /// Time in s from which the estimate is updated; before it, only the filters run [default: the end of the start
    /// span; the first sample with --covariance or --start]
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub update_from: Option<f64>,
    /// Second run of the same person in the same task: selects the initial covariance (--covariance) whose estimates
    /// explain this run best (VAF) [for methods with --covariance]
    #[arg(long, value_name = "FILE")]
    pub validate: Option<PathBuf>,
    /// With --validate: instead of selecting the initial P, reduce P after every half second in which the estimate
    /// explains less of the second run than before
    #[arg(long, requires = "validate")]
    pub update_covariance: bool,
    /// Average the estimate over the last S seconds (lag S/2)
    #[arg(long, value_name = "S")]
    pub moving_average: Option<f64>,
    /// Keep every N-th sample of the trace
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = parse_count)]
    pub every: usize,
    #[arg(long, value_name = "TRACE", help = format!(
        "File for the trace (estimate and standard errors at each sample): {}",
        writable_extensions()
    ))]
    pub out: Option<PathBuf>,
    /// Write an HTML report to this directory: parameters over time with bands, innovations, standard errors
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    #[command(flatten)]
    pub picture: FigureArgs,
    /// Spans in s, such as 0..30.72,51.2..81.92, whose batch fits are shown as dashed lines [default: the start span
    /// and the last third]
    #[arg(long, value_name = "S..S", value_parser = parse_span, value_delimiter = ',', allow_hyphen_values = true)]
    pub batch: Vec<(f64, f64)>,
    #[command(flatten)]
    pub show: ShowArgs,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct StreamArgs {
    /// Sampling frequency in Hz
    #[arg(long, value_name = "HZ", value_parser = parse_frequency)]
    pub fs: f64,
    #[command(flatten)]
    pub rate: DecimateArgs,
    #[command(flatten)]
    pub recursion: RecursionArgs,
    /// Seconds to collect before the start fit, for methods that have one [default: 20; none with --start]
    #[arg(long, value_name = "S", conflicts_with = "start")]
    pub warm_up: Option<f64>,
    /// Print a line only for every N-th sample
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = parse_count)]
    pub every: usize,
    /// Input column (tracking error) in the header line, if there is one
    #[arg(long, value_name = "NAME", default_value = "e")]
    pub input: String,
    /// Output column (control) in the header line, if there is one
    #[arg(long, value_name = "NAME", default_value = "u")]
    pub output: String,
    /// Use UDP datagrams instead of standard input and output: a line of text, a JSON object such as {"t": 0.01, "e":
    /// 0.5, "u": -1}, or a C struct, answered in the same format (text in JSON). Ports on 127.0.0.1, or addresses and
    /// ports, such as 0.0.0.0:5005:192.168.1.7:5006
    #[arg(long, value_name = "IN:OUT")]
    pub udp: Option<UdpAddresses>,
    /// LabStreamingLayer stream; available only in Python (pyhoid.lsl)
    #[arg(long, value_name = "NAME", hide = true)]
    pub lsl_in: Option<String>,
    /// LabStreamingLayer stream; available only in Python (pyhoid.lsl)
    #[arg(long, value_name = "NAME", hide = true)]
    pub lsl_out: Option<String>,
    /// Scale e or u by a factor (u=12.5) or from unit to unit (e=rad:deg). May be repeated
    #[arg(long, value_name = "e|u=FACTOR", value_parser = super::reading::parse_scale)]
    pub scale: Vec<(String, Scaling)>,
}

/// Returns the help of `--method`, which names the methods for comparison.
fn method_help() -> String {
    let all = hoid::survey::methods();
    let others: Vec<&str> = all
        .iter()
        .filter(|of| is_for_comparison(of))
        .map(Method::name)
        .collect();
    format!(
        "Recursive method. Further methods, for comparison: {}; hoid track --methods lists all methods and the \
         options that only these have",
        others.join(", ")
    )
}

/// Returns a parser for the names of the recursive methods, each with its line of help.
pub(super) fn method_names() -> impl TypedValueParser<Value = String> {
    let value = |method: Method| {
        let MethodSpec { name, help, .. } = method.spec();
        let value = PossibleValue::new(name).help(help).aliases(method.earlier_name());
        value.hide(is_for_comparison(&method))
    };
    let batch = comparators::names_and_descriptions().map(|(name, _)| PossibleValue::new(name).hide(true));
    let all = hoid::survey::methods().into_iter().map(value).chain(batch);
    PossibleValuesParser::new(all).try_map(|name| match comparators::untracked_comparator_message(&name) {
        Some(reason) => Err(reason),
        None => Ok(name.to_lowercase()),
    })
}
