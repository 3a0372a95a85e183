//! The options by which `hoid identify` and `hoid track` read records and prepare them.

use clap::Args;
use hoid::io::{Offset, QualityIssueKind, Scaling, Sparse, TimeChoice, TrialChoice};
use hoid::model::{Decimation, Detrend, FaultHandling};

use super::choices::choice_of;

/// How record files are read.
#[derive(Debug, Clone, Args)]
pub struct ReadArgs {
    /// Column of the input (tracking error): a name, -name, or a difference such as r-y; repeat it for more inputs
    #[arg(
        id = "input",
        long = "input",
        value_name = "COLUMN",
        default_value = "e",
        allow_hyphen_values = true
    )]
    pub inputs: Vec<String>,
    /// Column of the output (control): a name, -name, or a difference
    #[arg(long, value_name = "COLUMN", default_value = "u", allow_hyphen_values = true)]
    pub output: String,
    /// Column of the time, and its unit after a colon where it is not found automatically: s, ms, us, ns, min, h, iso
    /// (dates and times), sec+nanosec [default: t, or a default name of a time]
    #[arg(long, value_name = "COLUMN[:UNIT]", value_parser = parse_time)]
    pub time: Option<TimeChoice>,
    /// Column that counts the trials of a file, each a record of its own (t: where the time starts again),
    /// or one of them, as trial=3 [default: where t starts again]
    #[arg(long, value_name = "COLUMN[=VALUE]", value_parser = parse_trial)]
    pub trial: Option<TrialChoice>,
    /// Sampling frequency in Hz; without it column t (in s) gives the sampling
    #[arg(long, value_name = "HZ")]
    pub fs: Option<f64>,
    /// Start of the span to use, s
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub from: Option<f64>,
    /// End of the span to use (not included), s
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub to: Option<f64>,
    /// Bring unevenly sampled data onto an even grid by linear interpolation
    #[arg(long)]
    pub resample: bool,
    /// Bridge missing values (empty, NaN) by linear interpolation
    #[arg(long)]
    pub fill: bool,
    /// A column logged at instants of its own, so that some rows lack it: hold the last value, draw straight lines
    /// (linear), or drop those rows. May be repeated
    #[arg(long, value_name = "COLUMN=hold|linear|drop", value_parser = parse_sparse, value_delimiter = ',', allow_hyphen_values = true)]
    pub sparse: Vec<(String, Sparse)>,
    /// Columns to keep beyond input, output and time, as f_t,r or none: of a long CSV file the others take neither time
    /// nor memory [default: all]
    #[arg(long, value_name = "COLUMN,...", value_delimiter = ',')]
    pub columns: Option<Vec<String>>,
    #[command(flatten)]
    pub prepare: PrepareArgs,
    /// Take out the mean or the straight line of input and output, last
    #[arg(long, value_name = "HOW", default_value = "none", value_parser = choice_of(&Detrend::ALL))]
    pub detrend: Detrend,
}

impl ReadArgs {
    /// The same with the first input alone: further ones are channels of the record, and are kept.
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

    /// The columns to keep in addition to input, output and time; `None` for all.
    pub fn kept_columns(&self) -> Option<Vec<String>> {
        let kept = self.columns.as_ref()?;
        Some(kept.iter().filter(|column| *column != "none").cloned().collect())
    }
}

/// Treatment of a record before it is used, in this order.
#[derive(Debug, Clone, Args)]
pub struct PrepareArgs {
    /// Units that the file does not report, as e=deg,u=deg: units are printed only where they are
    /// declared
    #[arg(long, value_name = "CHANNEL=UNIT", value_parser = parse_unit, value_delimiter = ',')]
    pub unit: Vec<(String, String)>,
    /// Drop rows that are duplicated, time included
    #[arg(long)]
    pub drop_repeated: bool,
    /// Multiply a channel: by a factor (u=12.5), into a unit (u=12.5:deg), or from unit to unit
    /// (e=rad:deg). A channel is a column, or e and u for input and output. May be repeated
    #[arg(long, value_name = "CHANNEL=FACTOR", value_parser = parse_scale, allow_hyphen_values = true)]
    pub scale: Vec<(String, Scaling)>,
    /// A channel that was recorded late, by samples (u=1) or seconds (u=0.0167s); parts of a sample
    /// by band-limited interpolation. May be repeated
    #[arg(long, value_name = "CHANNEL=N|Ss", value_parser = parse_offset, allow_hyphen_values = true)]
    pub offset: Vec<(String, Offset)>,
    #[command(flatten)]
    pub rate: DecimateArgs,
    /// Bring evenly sampled data to another sampling frequency in Hz, after a low-pass filter on
    /// all channels alike
    #[arg(long, value_name = "HZ", conflicts_with = "decimate")]
    pub new_fs: Option<f64>,
    /// Drop the first seconds of the data read
    #[arg(long, value_name = "S")]
    pub run_in: Option<f64>,
}

/// Whether the sampling rate is lowered.
#[derive(Debug, Clone, Copy, Args)]
pub struct DecimateArgs {
    /// Keep every M-th sample after a linear-phase low-pass filter on all channels alike; auto: above 200 Hz by the M
    /// that comes nearest to 100 Hz, where an operator is fitted or tracked. A polynomial structure, and a delay in
    /// samples, take the samples as they are unless M is named
    #[arg(long, value_name = "auto|off|M", default_value_t = Decimation::Auto)]
    pub decimate: Decimation,
}

impl DecimateArgs {
    /// Processing for an estimator; what counts samples is not decimated automatically.
    pub fn of(self, counts_samples: bool) -> Decimation {
        if counts_samples {
            self.decimate.when_named()
        } else {
            self.decimate
        }
    }
}

/// Parts that are left out of a record.
#[derive(Debug, Args)]
pub struct MaskArgs {
    /// Leave out the problems of the sampling (see `hoid info`): the record is cut there, and each
    /// segment has initial states of its own
    #[arg(long, value_name = "KINDS", value_delimiter = ',', value_parser = choice_of(&QualityIssueKind::MASKABLE))]
    pub mask: Vec<QualityIssueKind>,
    /// Shortest segment between masked samples that is used, s
    #[arg(long, value_name = "S", default_value_t = 2.0)]
    pub shortest: f64,
}

/// Treatment of faults of a recording.
#[derive(Debug, Clone, Copy, Args)]
pub struct FaultArgs {
    /// Faults of the recording (spikes, dropouts, frozen and idle stretches, wraps, steps): bridge faults of up to 0.1
    /// s and cut the record at longer ones, cut all, report and leave the data as they are, or keep: look for none
    #[arg(long, value_name = "WHAT", default_value = "bridge", value_parser = choice_of(&FaultHandling::ALL))]
    pub faults: FaultHandling,
}

/// `NAME=VALUE`; the name may hold `=` no more than a column may.
fn pair(text: &str) -> Result<(String, &str), String> {
    let (name, value) = text
        .rsplit_once('=')
        .filter(|(name, _)| !name.trim().is_empty())
        .ok_or_else(|| format!("{text:?} names no channel; write CHANNEL=VALUE"))?;
    Ok((name.trim().to_owned(), value))
}

/// The column of the time.
pub(super) fn parse_time(text: &str) -> Result<TimeChoice, String> {
    text.parse::<TimeChoice>().map_err(|error| error.to_string())
}

/// The trials of a file.
pub(super) fn parse_trial(text: &str) -> Result<TrialChoice, String> {
    text.parse::<TrialChoice>().map_err(|error| error.to_string())
}

fn parse_sparse(text: &str) -> Result<(String, Sparse), String> {
    let (name, value) = pair(text)?;
    let how = value
        .trim()
        .parse()
        .map_err(|e: hoid::model::UnknownName| e.to_string())?;
    Ok((name, how))
}

fn parse_unit(text: &str) -> Result<(String, String), String> {
    let (name, unit) = pair(text)?;
    match unit.trim() {
        "" => Err(format!("{text:?} names no unit; write CHANNEL=UNIT, as e=deg")),
        unit => Ok((name, unit.to_owned())),
    }
}

pub fn parse_scale(text: &str) -> Result<(String, Scaling), String> {
    let (name, value) = pair(text)?;
    Ok((name, value.parse().map_err(|e: hoid::io::IoError| e.to_string())?))
}

fn parse_offset(text: &str) -> Result<(String, Offset), String> {
    let (name, value) = pair(text)?;
    Ok((name, value.parse().map_err(|e: hoid::io::IoError| e.to_string())?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_as_typed() {
        assert_eq!(parse_scale("x(:,2)=-2").unwrap().1.factor(), -2.0);
        assert_eq!(parse_offset(" u =0.5").unwrap(), ("u".to_owned(), Offset::Samples(0.5)));
        for bad in ["", "u", "=2", "u=", "u=0", "u=x"] {
            assert!(parse_scale(bad).is_err(), "{bad}");
        }
        assert!(parse_offset("u=1 sample").is_err());
        assert_eq!(parse_unit("e = deg").unwrap(), ("e".to_owned(), "deg".to_owned()));
        assert_eq!(parse_sparse("r-y=hold").unwrap(), ("r-y".to_owned(), Sparse::Hold));
        assert!(parse_sparse("e=held").unwrap_err().contains("hold, linear or drop"));
        assert!(parse_sparse("hold").is_err());
        assert!(parse_unit("e=").is_err() && parse_unit("deg").is_err());
    }
}
