//! Decimation factor of a record, chosen by the user or derived from the sampling rate.

use std::fmt;
use std::str::FromStr;

use super::kernel::{Kernel, PASS_BAND_EDGE, STOP_BAND_ATTENUATION_DB};
use crate::{ModelError, SampleTime};

/// Rate above which records are decimated automatically, Hz.
const MAX_RATE_HZ: f64 = 200.0;
/// Target rate of the automatic decimation, Hz.
const TARGET_RATE_HZ: f64 = 100.0;
/// Relative difference between two rates above which it is not attributed to rounding.
const RATE_TOLERANCE: f64 = 1e-6;

/// Choice of the decimation factor for a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum Decimation {
    /// Rates above 200 Hz are decimated by the factor that gives the rate nearest to 100 Hz.
    #[default]
    Auto,
    /// No decimation.
    Off,
    /// Decimation by the given factor.
    By(usize),
}

impl Decimation {
    /// Returns the choice for estimators of polynomials, whose orders and delays are in samples: these estimators use
    /// the original samples unless a factor is given.
    pub fn explicit_only(self) -> Self {
        match self {
            Self::Auto => Self::Off,
            other => other,
        }
    }

    /// Returns the factor for a sample time; 1 means no decimation.
    pub fn factor(self, sample_time: SampleTime) -> usize {
        let hz = 1.0 / sample_time.s();
        match self {
            Self::By(factor) => factor,
            Self::Auto if hz > MAX_RATE_HZ * (1.0 + RATE_TOLERANCE) => {
                let below = (hz / TARGET_RATE_HZ).floor();
                let distance = |factor: f64| (hz / factor - TARGET_RATE_HZ).abs();
                let nearest = if distance(below + 1.0) < distance(below) {
                    below + 1.0
                } else {
                    below
                };
                nearest as usize
            }
            Self::Auto | Self::Off => 1,
        }
    }
}

/// Parses `auto`, `off`, or an integer of 1 or more.
impl FromStr for Decimation {
    type Err = ModelError;

    /// # Errors
    /// [`ModelError::Decimation`].
    fn from_str(text: &str) -> Result<Self, ModelError> {
        match text.trim().to_ascii_lowercase().as_str() {
            "auto" => Ok(Self::Auto),
            "off" => Ok(Self::Off),
            number => match number.parse() {
                Ok(factor) if factor > 0 => Ok(Self::By(factor)),
                _ => Err(ModelError::Decimation {
                    label: "decimate".to_owned(),
                    found: format!("{text:?}"),
                    expected: "auto, off, or an integer factor, such as 10".to_owned(),
                }),
            },
        }
    }
}

impl fmt::Display for Decimation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Off => f.write_str("off"),
            Self::By(factor) => factor.fmt(f),
        }
    }
}

/// Description of an applied decimation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decimated {
    /// Ratio of the new sample time to the old sample time.
    pub factor: usize,
    /// Old sampling frequency, Hz.
    pub from_hz: f64,
    /// New sampling frequency, Hz.
    pub to_hz: f64,
    /// End of the pass band, Hz.
    pub pass_hz: f64,
    /// Start of the stop band, Hz. Frequencies between the pass band and the stop band fold to frequencies above the
    /// pass band.
    pub stop_hz: f64,
    /// Attenuation in the stop band, dB.
    pub stop_db: f64,
    /// Length of the filter in samples at the old rate.
    pub taps: usize,
    /// Time in s by which each sample of the input was taken later than the sample of the output with the same index.
    pub lead_s: f64,
    /// Delay of the decimated values of a stream, s.
    pub lag_s: f64,
}

impl Decimated {
    /// Returns the description of a decimation by a factor, with its filter and the new sample time; `None` if the
    /// filter would be longer than `longest` samples on each side.
    pub(super) fn from_factor(factor: usize, old: SampleTime, longest: usize) -> Option<(Self, Kernel, SampleTime)> {
        let kernel = Kernel::for_decimation(1.0 / factor as f64, longest)?;
        let new = SampleTime::new(factor as f64 * old.s()).ok()?;
        let to_hz = 1.0 / new.s();
        let done = Self {
            factor,
            from_hz: 1.0 / old.s(),
            to_hz,
            pass_hz: PASS_BAND_EDGE * 0.5 * to_hz,
            stop_hz: (2.0 - PASS_BAND_EDGE) * 0.5 * to_hz,
            stop_db: STOP_BAND_ATTENUATION_DB,
            taps: 2 * kernel.samples_per_side() + 1,
            lead_s: 0.5 * (new.s() - old.s()),
            lag_s: (kernel.samples_per_side() + factor / 2) as f64 * old.s(),
        };
        Some((done, kernel, new))
    }
}

/// Formats the description of a decimation as a phrase without a full stop.
impl fmt::Display for Decimated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hz = |hz: f64| (hz * 1e4).round() / 1e4;
        write!(
            f,
            "{} Hz, filtered and decimated by {} to {} Hz",
            hz(self.from_hz),
            self.factor,
            hz(self.to_hz)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_above_200_hz_are_reduced_to_about_100() {
        for (hz, factor) in [
            (60.0, 1),
            (100.0, 1),
            (200.0, 1),
            (200.000_01, 1),
            (201.0, 2),
            (250.0, 3),
            (256.0, 3),
            (1000.0 / 3.0, 3),
            (500.0, 5),
            (512.0, 5),
            (1000.0, 10),
            (1024.0, 10),
            (2000.0, 20),
            (48_000.0, 480),
        ] {
            let ts = SampleTime::new(1.0 / hz).unwrap();
            assert_eq!(Decimation::Auto.factor(ts), factor, "{hz}");
            assert_eq!(Decimation::Auto.explicit_only().factor(ts), 1);
            assert_eq!(Decimation::By(7).explicit_only().factor(ts), 7);
        }
    }

    #[test]
    fn text_round_trip() {
        for (text, found) in [
            ("auto", Decimation::Auto),
            (" Off", Decimation::Off),
            ("10", Decimation::By(10)),
        ] {
            assert_eq!(text.parse::<Decimation>().unwrap(), found);
            assert_eq!(found.to_string().parse::<Decimation>().unwrap(), found);
        }
        for bad in ["", "0", "-1", "1.5", "on", "nan"] {
            let message = bad.parse::<Decimation>().unwrap_err().to_string();
            assert!(message.contains("expected auto, off"), "{message}");
        }
    }
}
