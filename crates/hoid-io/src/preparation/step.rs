//! The steps applied to a record, as text and as JSON with their numbers.

use std::fmt;

use hoid_model::{Decimated, Detrend, numbers::count_with_noun};
use serde::Serialize;

use crate::wording::{format_decimal, format_short};

/// A preparation step that was applied to a record, or a repair made in reading.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "step", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Step {
    /// Rows that equal an earlier row, including the time, were dropped.
    DropRepeated {
        /// Number of dropped rows.
        rows: usize,
        /// First dropped row, counted from 1.
        first_row: usize,
    },
    /// Only a segment of the record between faults was used.
    Mask {
        /// Kinds of excluded faults.
        what: Vec<&'static str>,
        /// Time of the first sample of the segment, s.
        from_s: f64,
        /// Time of the first sample after the segment, s.
        to_s: f64,
    },
    /// A column logged at its own times was filled in for all rows, or rows in which it has no value were dropped.
    Sparse {
        /// Name of the column.
        channel: String,
        /// "hold", "linear" or "drop".
        how: &'static str,
        /// Number of values logged in the column.
        own: usize,
        /// Number of rows without a value between the logged ones; with "drop" these rows are omitted.
        rows: usize,
        /// Longest time between two successive logged values that have rows between them, s.
        longest_s: f64,
        /// Mean age of the values over all rows, s; `None` unless values are held.
        mean_age_s: Option<f64>,
    },
    /// Missing values were interpolated linearly.
    Fill {
        /// Name of the column.
        channel: String,
        /// Number of interpolated values.
        values: usize,
        /// Number of values in the longest run of missing values.
        longest: usize,
    },
    /// Unevenly spaced samples were interpolated linearly onto an evenly spaced grid.
    Interpolate {
        /// Number of samples before the interpolation.
        from_samples: usize,
        /// Number of samples after the interpolation.
        to_samples: usize,
        /// Sampling frequency of the grid, Hz.
        to_hz: f64,
        /// Longest time between two successive samples before the interpolation, s.
        longest_step_s: f64,
    },
    /// A channel was multiplied by a factor.
    Scale {
        /// Name of the channel.
        channel: String,
        /// The factor.
        factor: f64,
        /// New unit of the channel, if known.
        unit: Option<String>,
    },
    /// A channel that was recorded late was aligned with the others.
    Offset {
        /// Name of the channel.
        channel: String,
        /// Delay of the channel in samples.
        samples: f64,
        /// Delay of the channel in s.
        seconds: f64,
        /// True if values between samples were obtained by band-limited interpolation.
        interpolated: bool,
        /// End of the band in which the interpolation is exact to 1e-4, Hz.
        pass_hz: Option<f64>,
        /// Numbers of samples cut at the start and at the end of the record.
        cut_samples: (usize, usize),
    },
    /// The sampling rate was changed.
    Rate {
        /// Ratio of the new sample time to the old one.
        factor: f64,
        /// Old sampling frequency, Hz.
        from_hz: f64,
        /// New sampling frequency, Hz.
        to_hz: f64,
        /// End of the pass band of the filter, Hz.
        pass_hz: f64,
        /// Start of the stop band of the filter, Hz; `None` if the frequency increases.
        stop_hz: Option<f64>,
        /// Attenuation of the filter in the stop band, dB.
        stop_db: f64,
        /// Length of the filter, in samples at the old rate.
        taps: usize,
        /// Times cut at the start and at the end of the record, s.
        cut_s: (f64, f64),
        /// Time by which the input of a row is sampled later than its output, s; negative if it is sampled earlier. As
        /// a result, the delay of a model is the same at both rates.
        input_lead_s: f64,
    },
    /// The run-in at the start was dropped.
    RunIn {
        /// Length of the run-in, s.
        seconds: f64,
        /// Number of dropped samples, without those cut by a filter.
        samples: usize,
    },
    /// The mean or the linear trend of the input and the output was removed.
    Detrend {
        /// "mean" or "linear".
        how: &'static str,
    },
}

impl Step {
    /// Returns the step for a removed trend; `None` if no trend was removed.
    pub(super) fn from_detrend(how: Detrend) -> Option<Self> {
        match how {
            Detrend::None => None,
            Detrend::Mean | Detrend::Linear => Some(Self::Detrend { how: how.name() }),
        }
    }

    /// Returns the name of the step, as in JSON.
    pub fn name(&self) -> &'static str {
        match self {
            Self::DropRepeated { .. } => "drop-repeated",
            Self::Mask { .. } => "mask",
            Self::Sparse { .. } => "sparse",
            Self::Fill { .. } => "fill",
            Self::Interpolate { .. } => "interpolate",
            Self::Scale { .. } => "scale",
            Self::Offset { .. } => "offset",
            Self::Rate { .. } => "rate",
            Self::RunIn { .. } => "run-in",
            Self::Detrend { .. } => "detrend",
        }
    }
}

impl From<Decimated> for Step {
    fn from(done: Decimated) -> Self {
        Self::Rate {
            factor: done.factor as f64,
            from_hz: done.from_hz,
            to_hz: done.to_hz,
            pass_hz: done.pass_hz,
            stop_hz: Some(done.stop_hz),
            stop_db: done.stop_db,
            taps: done.taps,
            cut_s: (0.0, 0.0),
            input_lead_s: done.lead_s,
        }
    }
}

/// Describes the step in a phrase without a full stop.
impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::DropRepeated { rows, first_row } => {
                let rows = count_with_noun(*rows, "repeated row");
                write!(f, "{rows} dropped; the first is row {first_row}")
            }
            Self::Mask { what, from_s, to_s } => write!(
                f,
                "only {} to {} s used, between rows masked as {}",
                format_decimal(*from_s),
                format_decimal(*to_s),
                what.join(" or ")
            ),
            Self::Sparse {
                channel,
                how,
                own,
                rows,
                longest_s,
                mean_age_s,
            } => {
                write!(
                    f,
                    "column {channel}: {} recorded, {} between them ",
                    count_with_noun(*own, "value"),
                    count_with_noun(*rows, "row")
                )?;
                match *how {
                    "drop" => write!(f, "dropped"),
                    "hold" => write!(f, "filled with the last value"),
                    _ => write!(f, "interpolated linearly"),
                }?;
                write!(f, "; at most {} s between values", format_decimal(*longest_s))?;
                mean_age_s.iter().try_for_each(|age| {
                    write!(
                        f,
                        "; a value is {} s old on average, which delays the signal by as much",
                        format_short(*age)
                    )
                })
            }
            Self::Fill {
                channel,
                values,
                longest,
            } => write!(
                f,
                "column {channel}: {} bridged linearly, at most {longest} in a row",
                count_with_noun(*values, "missing value")
            ),
            Self::Interpolate {
                from_samples,
                to_samples,
                to_hz,
                longest_step_s,
            } => write!(
                f,
                "resampled linearly from {from_samples} samples to {to_samples} at {} Hz; the longest step between two samples is \
                 {longest_step_s:.6} s",
                format_decimal(*to_hz)
            ),
            Self::Scale { channel, factor, unit } => {
                write!(f, "{channel} multiplied by {}", format_decimal(*factor))?;
                unit.iter().try_for_each(|unit| write!(f, " (now in {unit})"))
            }
            Self::Offset {
                channel,
                samples,
                seconds,
                interpolated,
                pass_hz,
                cut_samples: (start, end),
            } => {
                let way = if *samples > 0.0 { "earlier" } else { "later" };
                let unit = if samples.abs() == 1.0 { "sample" } else { "samples" };
                write!(
                    f,
                    "{channel} moved {way} by {} {unit} ({} s)",
                    format_decimal(samples.abs()),
                    format_decimal(seconds.abs())
                )?;
                if let (true, Some(pass)) = (interpolated, pass_hz) {
                    write!(
                        f,
                        ", interpolated by a sinc function (error below 1e-4 up to {} Hz)",
                        format_decimal(*pass)
                    )?;
                }
                let start = count_with_noun(*start, "sample");
                write!(f, "; {start} cut at the start, {end} at the end")
            }
            Self::Rate {
                factor,
                from_hz,
                to_hz,
                pass_hz,
                stop_hz,
                stop_db,
                taps,
                cut_s,
                input_lead_s,
            } => {
                write!(f, "{} Hz", format_decimal(*from_hz))?;
                let to = format_decimal(*to_hz);
                // Decimation cuts nothing at the ends.
                match *cut_s == (0.0, 0.0) {
                    true => write!(f, ", filtered and decimated by {} to {to} Hz:", format_decimal(*factor))?,
                    false => write!(f, " to {to} Hz by")?,
                }
                write!(
                    f,
                    " a linear-phase filter of {taps} samples on all channels, pass band to {} Hz",
                    format_decimal(*pass_hz)
                )?;
                if let Some(stop) = stop_hz {
                    write!(f, ", {stop_db} dB from {} Hz", format_decimal(*stop))?;
                }
                if *input_lead_s != 0.0 {
                    write!(
                        f,
                        "; each input sample is taken in the middle of its hold, {} s {}, to keep the delay of the old rate",
                        format_decimal(input_lead_s.abs()),
                        if *input_lead_s > 0.0 { "later" } else { "earlier" }
                    )?;
                }
                if *cut_s != (0.0, 0.0) {
                    let (start, end) = (format_decimal(cut_s.0), format_decimal(cut_s.1));
                    write!(f, "; {start} s cut at the start, {end} s at the end")?;
                }
                Ok(())
            }
            Self::RunIn { seconds, samples } => {
                write!(
                    f,
                    "run-in of {} s dropped ({samples} samples)",
                    format_decimal(*seconds)
                )
            }
            Self::Detrend { how: "mean" } => write!(f, "mean of input and output removed"),
            Self::Detrend { .. } => write!(f, "linear trend of input and output removed"),
        }
    }
}
