//! The lines of a periodic excitation.
//!
//! A sum of sinusoids at harmonics `omega_k = n_k 2 pi/T` of one period T has all its power at these lines. Over a
//! whole number of periods each line is a single bin of the discrete Fourier transform. Sources: D. T. McRuer and H. R.
//! Jex, *A Review of Quasi-Linear Pilot Models*, IEEE Trans. Human Factors in Electronics 8 (1967) 231-249; H. J.
//! Damveld et al., *Design of Forcing Functions for the Identification of Human Control Behavior*, J. Guidance,
//! Control, and Dynamics 33 (2010) 1064-1081.

use std::f64::consts::TAU;

use hoid_model::{Record, forcing::ForcingFunction};
use hoid_numerics::statistics::mean_square;

use super::{
    spectrum::{coefficients, power},
    window::whole_periods,
};
use crate::IdentError;

/// Largest distance of a line from a harmonic that counts as rounding, in units of the fundamental frequency.
const HARMONIC_TOLERANCE: f64 = 1e-4;
/// Minimum share of the power of a channel at its lines.
const MIN_LINE_POWER_SHARE: f64 = 0.99;

/// Names of channels that commonly contain the excitation, in search order.
pub const COMMON_EXCITATIONS: [&str; 8] = ["f_t", "d", "r", "f_d", "target", "disturbance", "reference", "forcing"];

/// An excitation with lines at harmonics of one period.
#[derive(Debug, Clone, PartialEq)]
pub struct Excitation {
    harmonics: Vec<usize>,
    period_s: f64,
}

/// Criteria for finding the lines of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineDetectionOptions {
    /// Period T in s; if `None`, the shortest period that has all found lines as harmonics.
    pub period_s: Option<f64>,
    /// Minimum amplitude of a line relative to the largest line. Default 0.01.
    pub min_amplitude: f64,
}

impl Default for LineDetectionOptions {
    fn default() -> Self {
        Self {
            period_s: None,
            min_amplitude: 0.01,
        }
    }
}

impl Excitation {
    /// Creates an excitation from the harmonics n_k of the period T in s.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] if there are no harmonics, if a harmonic is 0 or occurs twice, or if the period is not
    /// positive.
    pub fn from_harmonics(harmonics: &[usize], period_s: f64) -> Result<Self, IdentError> {
        if !(period_s.is_finite() && period_s > 0.0) {
            return refuse(
                "the period of the excitation in s",
                period_s,
                "a positive finite number",
            );
        }
        let mut sorted = harmonics.to_vec();
        sorted.sort_unstable();
        if sorted.is_empty() {
            return refuse("the lines of the excitation", "none", "at least one");
        }
        if sorted[0] == 0 {
            return refuse("a harmonic of the excitation", 0, "1 or more");
        }
        if let Some(twice) = sorted.windows(2).find(|w| w[0] == w[1]) {
            return refuse(
                "the lines of the excitation",
                format!("{} twice", twice[0]),
                "each once",
            );
        }
        Ok(Self {
            harmonics: sorted,
            period_s,
        })
    }

    /// Creates an excitation from the lines omega_k in rad/s, each within 1e-4 of a harmonic of the period T in s.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for an invalid line, and the errors of [`Excitation::from_harmonics`].
    pub fn new(omega_rad_s: &[f64], period_s: f64) -> Result<Self, IdentError> {
        let mut harmonics = Vec::with_capacity(omega_rad_s.len());
        for &omega in omega_rad_s {
            let n = omega * period_s / TAU;
            // This also rejects `NaN`.
            if !((n - n.round()).abs() <= HARMONIC_TOLERANCE && (0.5..1e9).contains(&n)) {
                let nearest = n.round().max(1.0) * TAU / period_s;
                return refuse(
                    "a line of the excitation in rad/s",
                    omega,
                    format!("a harmonic of the period {period_s} s, such as {nearest}"),
                );
            }
            harmonics.push(n.round() as usize);
        }
        Self::from_harmonics(&harmonics, period_s)
    }

    /// Returns the lines of a forcing function with the period T in s.
    ///
    /// # Errors
    /// The errors of [`Excitation::new`].
    pub fn from_forcing_function(forcing: &ForcingFunction, period_s: f64) -> Result<Self, IdentError> {
        let omega: Vec<f64> = forcing
            .sinusoids()
            .iter()
            .filter(|s| s.amplitude_deg != 0.0)
            .map(|s| s.omega_rad_s)
            .collect();
        Self::new(&omega, period_s)
    }

    /// Finds the lines of a channel in a record of whole periods: all bins with at least the relative amplitude in
    /// `search`. If the period is given, a span that differs from whole periods by a sample is rejected; without the
    /// period, the leakage of such a span is too small to be detected.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] if the channel does not exist or its power is not concentrated at lines, as for noise
    /// or for a span that is not a whole number of periods; [`IdentError::NoExcitation`] for a constant channel;
    /// [`IdentError::NotWholePeriods`] if the span is not a whole number of the given periods.
    pub fn detect(record: &Record, channel: &str, search: &LineDetectionOptions) -> Result<Self, IdentError> {
        let values = channel_values(record, channel, EXCITATION_OPTION)?;
        if !(search.min_amplitude > 0.0 && search.min_amplitude <= 1.0) {
            return refuse(
                "the smallest amplitude of a line",
                search.min_amplitude,
                "above 0 and at most 1",
            );
        }
        let n = values.len();
        let span_s = n as f64 * record.sample_time().s();
        let periods = match search.period_s {
            None => None,
            Some(period_s) => Some(whole_periods(record, n, period_s)?),
        };
        let x = coefficients(values);
        let powers: Vec<f64> = (1..x.len()).map(|k| power(&x, k, n)).collect();
        let (total, largest) = (powers.iter().sum::<f64>(), powers.iter().copied().fold(0.0, f64::max));
        // Rounding errors of the transform leave about 1e-32 of the power in each bin.
        if total <= 1e-24 * mean_square(values) || largest == 0.0 {
            return Err(IdentError::NoExcitation {
                channel: channel.to_owned(),
                label: record.label().to_owned(),
            });
        }
        let threshold = largest * search.min_amplitude * search.min_amplitude;
        let bins: Vec<usize> = (1..=powers.len()).filter(|k| powers[k - 1] >= threshold).collect();
        let held = bins.iter().map(|k| powers[k - 1]).sum::<f64>() / total;
        let dense = bins.windows(2).filter(|w| w[1] == w[0] + 1).count();
        if held < MIN_LINE_POWER_SHARE || 2 * dense > bins.len() {
            if let Some(samples) = repetition(values) {
                whole_periods(record, n, samples as f64 * record.sample_time().s())?;
            }
            return refuse(
                &format!("the lines of channel {channel} of record {}", record.label()),
                format!(
                    "{} bins, many of them adjacent, with {:.1} % of the power",
                    bins.len(),
                    100.0 * held
                ),
                "single lines with nearly all of the power; choose a span of whole periods, or give the lines",
            );
        }
        let common = match periods {
            Some(m) => m,
            None => bins.iter().copied().fold(0, greatest_common_divisor),
        };
        if let Some(between) = bins.iter().find(|k| *k % common != 0) {
            return refuse(
                &format!("a line of channel {channel} of record {} in rad/s", record.label()),
                TAU * *between as f64 / span_s,
                format!("a harmonic of the period {} s", span_s / common as f64),
            );
        }
        let harmonics: Vec<usize> = bins.iter().map(|k| k / common).collect();
        let period_s = search.period_s.unwrap_or(span_s / common as f64);
        Self::from_harmonics(&harmonics, period_s)
    }

    /// Returns the harmonics n_k in ascending order.
    pub fn harmonics(&self) -> &[usize] {
        &self.harmonics
    }

    /// Returns the period T in s.
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Returns the lines omega_k in rad/s, in ascending order.
    pub fn omega_rad_s(&self) -> Vec<f64> {
        self.harmonics.iter().map(|n| TAU * *n as f64 / self.period_s).collect()
    }
}

/// Returns the smallest number of samples after which the values repeat, over at least a tenth of all samples.
fn repetition(values: &[f64]) -> Option<usize> {
    let rms = mean_square(values).sqrt();
    // Almost every other shift is excluded by its first samples; a signal at rest is no repetition.
    (2..=9 * values.len() / 10).find(|&shift| {
        let later = &values[shift..];
        let mut pairs = values.iter().zip(later);
        pairs.all(|(a, b)| (a - b).abs() <= MAX_REPETITION_DEVIATION * rms)
            && mean_square(later).sqrt() > MIN_REPEATED_RMS * rms
    })
}

pub(crate) fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

/// Largest difference between two periods of a recorded signal, relative to its rms.
const MAX_REPETITION_DEVIATION: f64 = 1e-3;
/// Smallest rms of the repeated part of a signal, relative to the rms of the signal.
const MIN_REPEATED_RMS: f64 = 0.1;

/// Name of the excitation in messages.
const EXCITATION_OPTION: &str = "the excitation (--excitation)";

/// Checks that one of the records has the channel of the excitation. If only some records lack it, the fit at the lines
/// is omitted.
///
/// # Errors
/// [`IdentError::BadOption`] with the channels of the first record.
pub fn check_excitation(records: &[Record], channel: &str) -> Result<(), IdentError> {
    if records.iter().any(|record| record.channel(channel).is_some()) {
        return Ok(());
    }
    let first = records
        .first()
        .map(|record| channel_values(record, channel, EXCITATION_OPTION));
    first.map_or(Ok(()), |found| found.map(|_| ()))
}

/// Returns the values of a channel by its name. The error names the available channels; `what` describes the channel in
/// the error.
pub(super) fn channel_values<'r>(record: &'r Record, channel: &str, what: &str) -> Result<&'r [f64], IdentError> {
    match record.channel(channel) {
        Some(values) => Ok(values),
        None => {
            let names: Vec<&str> = record.channels().map(|c| c.name.as_str()).collect();
            refuse(
                &format!("{what} of record {}", record.label()),
                channel,
                format!("one of {}", names.join(", ")),
            )
        }
    }
}

pub(super) fn refuse<T>(option: &str, found: impl ToString, expected: impl ToString) -> Result<T, IdentError> {
    Err(IdentError::BadOption {
        option: option.to_owned(),
        found: found.to_string(),
        expected: expected.to_string(),
    })
}

#[cfg(test)]
mod tests {
    use hoid_model::{Channel, SampleTime};

    use super::*;

    fn record(values: Vec<f64>) -> Record {
        let ts = SampleTime::AT_100_HZ;
        let zero = vec![0.0; values.len()];
        Record::new(ts, Channel::new("e", "deg", values), Channel::new("u", "deg", zero)).unwrap()
    }

    fn reference(samples: usize, noise: f64) -> Record {
        let f = ForcingFunction::reference().samples(0.0, SampleTime::AT_100_HZ, samples);
        // A fixed sequence that looks like noise.
        let rough = |k: usize| noise * (k as f64 * k as f64 * 0.7).sin();
        record(f.iter().enumerate().map(|(k, v)| v + rough(k)).collect())
    }

    #[test]
    fn lines_of_the_forcing_function_are_found() {
        let given = Excitation::from_forcing_function(&ForcingFunction::reference(), 81.92).unwrap();
        assert_eq!(given.harmonics(), [3, 5, 8, 13, 22, 34, 53, 86, 139, 229]);
        for (samples, noise) in [(8192, 0.0), (16384, 0.0), (8192, 0.02)] {
            let found = Excitation::detect(&reference(samples, noise), "e", &LineDetectionOptions::default()).unwrap();
            assert_eq!(found.harmonics(), given.harmonics());
            assert!((found.period_s() - 81.92).abs() < 1e-9);
        }
        let same = Excitation::new(&given.omega_rad_s(), 81.92).unwrap();
        assert_eq!(same, given);
    }

    #[test]
    fn span_with_leakage_is_refused() {
        for samples in [4096, 8000, 8150] {
            let refused = Excitation::detect(&reference(samples, 0.0), "e", &LineDetectionOptions::default());
            assert!(
                matches!(refused, Err(IdentError::BadOption { .. })),
                "{samples}: {refused:?}"
            );
        }
        let search = LineDetectionOptions {
            period_s: Some(81.92),
            ..LineDetectionOptions::default()
        };
        for samples in [4096, 8191] {
            let refused = Excitation::detect(&reference(samples, 0.0), "e", &search);
            assert!(matches!(refused, Err(IdentError::NotWholePeriods { .. })));
        }
        // With twice the period, the lines would also be harmonics; this is rejected.
        let wrong = LineDetectionOptions {
            period_s: Some(40.96),
            ..LineDetectionOptions::default()
        };
        assert!(Excitation::detect(&reference(8192, 0.0), "e", &wrong).is_err());
    }

    #[test]
    fn refused_span_names_the_longest_span_of_whole_periods() {
        for (samples, end_s) in [(20_000, "163.84"), (10_000, "81.92")] {
            let refused = Excitation::detect(&reference(samples, 0.0), "e", &LineDetectionOptions::default());
            let error = refused.unwrap_err();
            assert!(matches!(&error, IdentError::NotWholePeriods { period_s, .. } if (period_s - 81.92).abs() < 1e-9));
            assert!(
                error.to_string().contains(&format!("(--from 0 --to {end_s})")),
                "{error}"
            );
        }
        // Rest at both ends is no repetition.
        let burst = (0..1000).map(|k| {
            if (300..500).contains(&k) {
                (k as f64 * 0.3).sin()
            } else {
                0.0
            }
        });
        assert_eq!(repetition(&burst.collect::<Vec<_>>()), None);
    }

    #[test]
    fn signals_and_lists_without_lines_are_refused() {
        let search = LineDetectionOptions::default();
        assert!(matches!(
            Excitation::detect(&record(vec![2.5; 100]), "e", &search),
            Err(IdentError::NoExcitation { .. })
        ));
        assert!(Excitation::detect(&record(vec![1.0, 2.0, 4.0]), "f_t", &search).is_err());
        assert!(Excitation::from_harmonics(&[], 1.0).is_err());
        assert!(Excitation::from_harmonics(&[0, 1], 1.0).is_err());
        assert!(Excitation::from_harmonics(&[3, 1, 3], 1.0).is_err());
        for period in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Excitation::from_harmonics(&[1], period).is_err());
            assert!(Excitation::new(&[1.0], period).is_err());
        }
        assert!(Excitation::new(&[1.0, f64::NAN], TAU).is_err());
        assert!(Excitation::new(&[1.5], TAU).is_err());
    }
}
