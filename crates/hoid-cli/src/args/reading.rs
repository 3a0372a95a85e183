//! The options by which `hoid identify` and `hoid track` read records and prepare them.

use clap::Args;
use hoid::io::{Offset, QualityIssueKind, Scaling, SparseTreatment, TimeChoice, TrialChoice};
use hoid::model::{Decimation, Detrend, FaultHandling};

use super::{
    choices::choice_parser,
    parse::{parse_duration, parse_frequency},
};

/// Times of the rows of record files, and their trials.
#[derive(Debug, Clone, Args)]
pub struct ClockArgs {
    /// Time column, and its unit if it is not recognised: s, ms, us, ns, min, h, days, iso (dates and times),
    /// sec+nanosec
    /// [default: t, or a column recognised as time]
    #[arg(long, value_name = "COLUMN[:UNIT]", value_parser = parse_time)]
    pub time: Option<TimeChoice>,
    /// Column that numbers the trials, or t (time restarts at each trial); each trial becomes a record. COLUMN=VALUE,
    /// such as trial=3, reads one trial [default: t if time restarts]
    #[arg(long, value_name = "COLUMN[=VALUE]", value_parser = parse_trial)]
    pub trial: Option<TrialChoice>,
    /// Sampling frequency in Hz [default: from column t, in s]
    #[arg(long, value_name = "HZ", value_parser = parse_frequency, allow_hyphen_values = true)]
    pub fs: Option<f64>,
}

/// How record files are read.
#[derive(Debug, Clone, Args)]
pub struct ReadArgs {
    /// Input column (tracking error): a name, -name, or a difference such as r-y; repeat for more inputs
    #[arg(
        id = "input",
        long = "input",
        value_name = "COLUMN",
        default_value = "e",
        allow_hyphen_values = true
    )]
    pub inputs: Vec<String>,
    /// Output column (control): a name, -name, or a difference
    #[arg(long, value_name = "COLUMN", default_value = "u", allow_hyphen_values = true)]
    pub output: String,
    #[command(flatten)]
    pub clock: ClockArgs,
    /// Start of the span to use, s
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub from: Option<f64>,
    /// End of the span to use (excluded), s
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub to: Option<f64>,
    /// Interpolate unevenly sampled data linearly onto an even grid
    #[arg(long)]
    pub resample: bool,
    /// Interpolate missing values (empty, NaN) linearly
    #[arg(long)]
    pub fill: bool,
    /// Column logged at its own times and missing in some rows: hold the last value, interpolate (linear), or drop
    /// those rows. May be repeated
    #[arg(long, value_name = "COLUMN=hold|linear|drop", value_parser = parse_sparse, value_delimiter = ',', allow_hyphen_values = true)]
    pub sparse: Vec<(String, SparseTreatment)>,
    /// Other columns to keep, such as f_t,r, or none, to save time and memory on long files [default: all]
    #[arg(long, value_name = "COLUMN,...", value_delimiter = ',')]
    pub columns: Option<Vec<String>>,
    #[command(flatten)]
    pub prepare: PrepareArgs,
    /// Finally, remove the mean or linear trend of input and output
    #[arg(long, value_name = "HOW", default_value = "none", value_parser = choice_parser(&Detrend::ALL))]
    pub detrend: Detrend,
}

impl ReadArgs {
    /// Returns these options with the first input alone; further inputs are kept as channels of the record.
    pub fn with_one_input(&self) -> Self {
        let further = self.inputs[1..].iter().cloned();
        Self {
            inputs: self.inputs[..1].to_vec(),
            columns: self
                .columns
                .clone()
                .map(|kept| kept.into_iter().chain(further).collect()),
            ..self.clone()
        }
    }

    /// Returns the columns to keep in addition to the input, output and time; `None` for all.
    pub fn kept_columns(&self) -> Option<Vec<String>> {
        let kept = self.columns.as_ref()?;
        Some(kept.iter().filter(|column| *column != "none").cloned().collect())
    }
}

/// Treatment of a record before it is used, in this order.
#[derive(Debug, Clone, Args)]
pub struct PrepareArgs {
    /// Units missing from the file, such as e=deg,u=deg
    ///
    /// Only declared units are printed.
    #[arg(long, value_name = "CHANNEL=UNIT", value_parser = parse_unit, value_delimiter = ',')]
    pub unit: Vec<(String, String)>,
    /// Drop duplicate rows (time included)
    #[arg(long)]
    pub drop_repeated: bool,
    /// Scale a channel by a factor (u=12.5; with its new unit: u=12.5:deg), or convert its unit (e=rad:deg)
    ///
    /// A channel is a column, or e for the input and u for the output. May be repeated.
    #[arg(long, value_name = "CHANNEL=FACTOR", value_parser = parse_scale, allow_hyphen_values = true)]
    pub scale: Vec<(String, Scaling)>,
    /// Advance a channel recorded late, by samples (u=1) or seconds (u=0.0167s); fractions by band-limited
    /// interpolation. May be repeated
    #[arg(long, value_name = "CHANNEL=N|Ss", value_parser = parse_offset, allow_hyphen_values = true)]
    pub offset: Vec<(String, Offset)>,
    #[command(flatten)]
    pub rate: DecimateArgs,
    /// Resample evenly sampled data to this frequency in Hz, after a low-pass filter on all channels
    #[arg(long, value_name = "HZ", conflicts_with = "decimate", value_parser = parse_frequency, allow_hyphen_values = true)]
    pub new_fs: Option<f64>,
    /// Drop the first S seconds of the data read
    #[arg(long, value_name = "S", value_parser = parse_duration, allow_hyphen_values = true)]
    pub run_in: Option<f64>,
}

/// Whether the sampling rate is lowered.
#[derive(Debug, Clone, Copy, Args)]
pub struct DecimateArgs {
    /// Keep every M-th sample after a linear-phase low-pass filter on all channels; auto: reduce rates above 200 Hz to
    /// about 100 Hz, except for polynomial structures and delays in samples
    #[arg(long, value_name = "auto|off|M", default_value_t = Decimation::Auto)]
    pub decimate: Decimation,
}

impl DecimateArgs {
    /// Returns the decimation for an estimator. Estimators whose orders count samples are not decimated automatically.
    pub fn decimation(self, counts_samples: bool) -> Decimation {
        if counts_samples {
            self.decimate.explicit_only()
        } else {
            self.decimate
        }
    }
}

/// Parts that are omitted from a record.
#[derive(Debug, Args)]
pub struct MaskArgs {
    /// Cut these sampling problems out of the record (see `hoid info`); each segment has its own initial states
    #[arg(long, value_name = "KINDS", value_delimiter = ',', value_parser = choice_parser(&QualityIssueKind::MASKABLE_KINDS))]
    pub mask: Vec<QualityIssueKind>,
    /// Shortest segment to use between masked samples, s
    #[arg(long, value_name = "S", default_value_t = 2.0)]
    pub shortest: f64,
}

/// Treatment of faults of a recording.
#[derive(Debug, Clone, Copy, Args)]
pub struct FaultArgs {
    /// Treatment of recording faults (spikes, dropouts, frozen and idle stretches, wraps, steps): bridge (faults up to
    /// 0.1 s; cut the record at longer ones), cut (at every fault), report (change nothing), or keep (do not search)
    #[arg(long, value_name = "WHAT", default_value = "bridge", value_parser = choice_parser(&FaultHandling::ALL))]
    pub faults: FaultHandling,
}

/// Splits `NAME=VALUE` at the last `=`, so the name may contain `=`, but the value may not.
fn parse_pair(text: &str) -> Result<(String, &str), String> {
    let (name, value) = text
        .rsplit_once('=')
        .filter(|(name, _)| !name.trim().is_empty())
        .ok_or_else(|| format!("{text:?} names no channel; write CHANNEL=VALUE"))?;
    Ok((name.trim().to_owned(), value))
}

/// Parses the choice of the time column.
fn parse_time(text: &str) -> Result<TimeChoice, String> {
    text.parse::<TimeChoice>().map_err(|error| error.to_string())
}

/// Parses the choice of trials of a file.
fn parse_trial(text: &str) -> Result<TrialChoice, String> {
    text.parse::<TrialChoice>().map_err(|error| error.to_string())
}

fn parse_sparse(text: &str) -> Result<(String, SparseTreatment), String> {
    let (name, value) = parse_pair(text)?;
    let how = value
        .trim()
        .parse()
        .map_err(|e: hoid::model::UnknownName| e.to_string())?;
    Ok((name, how))
}

fn parse_unit(text: &str) -> Result<(String, String), String> {
    let (name, unit) = parse_pair(text)?;
    match unit.trim() {
        "" => Err(format!("{text:?} names no unit; write CHANNEL=UNIT, such as e=deg")),
        unit => Ok((name, unit.to_owned())),
    }
}

pub fn parse_scale(text: &str) -> Result<(String, Scaling), String> {
    let (name, value) = parse_pair(text)?;
    Ok((name, value.parse().map_err(|e: hoid::io::IoError| e.to_string())?))
}

fn parse_offset(text: &str) -> Result<(String, Offset), String> {
    let (name, value) = parse_pair(text)?;
    Ok((name, value.parse().map_err(|e: hoid::io::IoError| e.to_string())?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channel_options_are_parsed() {
        assert_eq!(parse_scale("x(:,2)=-2").unwrap().1.factor(), -2.0);
        assert_eq!(parse_offset(" u =0.5").unwrap(), ("u".to_owned(), Offset::Samples(0.5)));
        for bad in ["", "u", "=2", "u=", "u=0", "u=x"] {
            assert!(parse_scale(bad).is_err(), "{bad}");
        }
        assert!(parse_offset("u=1 sample").is_err());
        assert_eq!(parse_unit("e = deg").unwrap(), ("e".to_owned(), "deg".to_owned()));
        assert_eq!(
            parse_sparse("r-y=hold").unwrap(),
            ("r-y".to_owned(), SparseTreatment::Hold)
        );
        assert!(parse_sparse("e=held").unwrap_err().contains("hold, linear or drop"));
        assert!(parse_sparse("hold").is_err());
        assert!(parse_unit("e=").is_err() && parse_unit("deg").is_err());
    }
}
