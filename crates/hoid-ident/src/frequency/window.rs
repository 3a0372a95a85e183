//! Spans of whole periods, and the Fourier coefficients of two channels with an offset between their recordings.
//!
//! If `e[k]` corresponds to `u[k + s]`, where s need not be an integer, `U(omega) e^{j omega s Ts}` is the coefficient
//! of u at the time of e; this is exact for periodic components. The integer part of s is realised by a shift of the
//! samples if the record is long enough; a shift is exact for components that are not periodic as well.

use std::f64::consts::TAU;

use hoid_model::{Complex64, Record};

use super::spectrum::coefficients;
use crate::IdentError;

/// A span of a record that contains whole periods.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Window {
    pub first: usize,
    pub samples: usize,
    /// Number of periods of the excitation, which is also the bin of its first harmonic.
    pub periods: usize,
}

/// Returns the number of periods in `samples` samples of a record. The length may differ from whole periods by half a
/// sample.
pub(super) fn whole_periods(record: &Record, samples: usize, period_s: f64) -> Result<usize, IdentError> {
    let ts = record.sample_time().s();
    let of_period = period_s / ts;
    let nearest = (samples as f64 / of_period).round();
    // If a period is not an integer number of samples, a span can only match whole periods within half a sample.
    if nearest >= 1.0 && (samples as f64 - nearest * of_period).abs() <= 0.5 + 1e-6 {
        return Ok(nearest as usize);
    }
    let fitting = (samples as f64 / of_period + 1e-9).floor();
    let remedy = if fitting >= 1.0 {
        let start_s = record.time_s(0);
        let end_s = start_s + fitting * period_s;
        let periods = if fitting == 1.0 { "period" } else { "periods" };
        format!(
            "use {} s, the longest span of whole periods: {fitting} {periods} from {start_s} s to {end_s} s \
             (--from {start_s} --to {end_s})",
            fitting * period_s,
        )
    } else {
        format!("use a record of at least {period_s} s")
    };
    Err(IdentError::NotWholePeriods {
        label: record.label().to_owned(),
        samples,
        span_s: samples as f64 * ts,
        period_s,
        remedy,
    })
}

impl Window {
    /// Returns the window of the samples with `from_s <= t < to_s`, which must cover whole periods.
    pub fn from_span(
        record: &Record,
        from_s: Option<f64>,
        to_s: Option<f64>,
        period_s: f64,
    ) -> Result<Self, IdentError> {
        let ts = record.sample_time().s();
        let start_s = record.time_s(0);
        let part = record.span(from_s.unwrap_or(start_s), to_s.unwrap_or(f64::INFINITY))?;
        let periods = whole_periods(&part, part.len(), period_s)?;
        Ok(Self {
            first: ((part.time_s(0) - start_s) / ts).round() as usize,
            samples: part.len(),
            periods,
        })
    }

    /// Splits the window into single periods.
    pub fn single_periods(self) -> Vec<Self> {
        let edge = |i: usize| (i * self.samples + self.periods / 2) / self.periods;
        let one = |i: usize| Self {
            first: self.first + edge(i),
            samples: edge(i + 1) - edge(i),
            periods: 1,
        };
        (0..self.periods).map(one).collect()
    }

    /// Returns the samples of a channel that is `offset` samples late, shifted to the window, and the part of the
    /// offset that remains after the shift.
    pub fn shifted_samples(self, values: &[f64], offset: f64) -> (&[f64], f64) {
        let whole = offset.floor();
        let start = self.first as f64 + whole;
        if start >= 0.0 && start + self.samples as f64 <= values.len() as f64 {
            let start = start as usize;
            return (&values[start..start + self.samples], offset - whole);
        }
        (&values[self.first..self.first + self.samples], offset)
    }

    /// Returns the Fourier coefficients of a channel that is `offset` samples late.
    pub fn coefficients(self, values: &[f64], offset: f64) -> Vec<Complex64> {
        let (samples, rest) = self.shifted_samples(values, offset);
        shifted_coefficients(samples, rest)
    }
}

/// Returns the Fourier coefficients of samples that are `offset` samples late.
pub(super) fn shifted_coefficients(samples: &[f64], offset: f64) -> Vec<Complex64> {
    let mut x = coefficients(samples);
    if offset != 0.0 {
        let turn = TAU * offset / samples.len() as f64;
        for (k, c) in x.iter_mut().enumerate() {
            *c *= Complex64::from_polar(1.0, turn * k as f64);
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use hoid_model::{Channel, SampleTime};

    use super::*;

    fn record(n: usize, ts: f64) -> Record {
        let x = Channel::new("u", "deg", (0..n).map(|k| k as f64).collect());
        Record::from_output(SampleTime::new(ts).unwrap(), x)
            .unwrap()
            .starting_at(-1.0)
    }

    #[test]
    fn only_spans_of_whole_periods_are_accepted() {
        let r = record(1000, 0.01);
        let w = Window::from_span(&r, Some(0.0), Some(6.0), 2.0).unwrap();
        assert_eq!((w.first, w.samples, w.periods), (100, 600, 3));
        let parts = w.single_periods();
        assert_eq!(parts.iter().map(|p| p.first).collect::<Vec<_>>(), [100, 300, 500]);
        assert!(parts.iter().all(|p| p.samples == 200 && p.periods == 1));
        assert_eq!(Window::from_span(&r, None, None, 2.5).unwrap().periods, 4);
        // 10/3 s are 333.3 samples; three periods fill the whole record.
        assert_eq!(Window::from_span(&r, None, None, 10.0 / 3.0).unwrap().periods, 3);
        let message = Window::from_span(&r, None, None, 3.0).unwrap_err().to_string();
        assert!(
            message.contains("use 9 s, the longest span of whole periods: 3 periods from -1 s to 8 s"),
            "{message}"
        );
        let message = Window::from_span(&r, None, None, 20.0).unwrap_err().to_string();
        assert!(message.contains("at least 20 s"), "{message}");
        assert!(Window::from_span(&r, Some(50.0), None, 2.0).is_err());
    }

    #[test]
    fn sampling_offset_is_compensated() {
        let (n, period) = (400_usize, 200.0);
        let wave = |t: f64| (TAU * 3.0 * t / period + 0.3).sin() + 0.2 * (TAU * 11.0 * t / period).cos();
        let at = |shift: f64| -> Vec<f64> { (0..n).map(|k| wave(k as f64 - shift)).collect() };
        let w = Window {
            first: 100,
            samples: 200,
            periods: 1,
        };
        let reference = w.coefficients(&at(0.0), 0.0);
        // The last shift exceeds the record and is applied as a phase alone.
        for shift in [1.0, 0.37, -0.6, 12.25, -3.0, 150.0] {
            for (a, b) in w.coefficients(&at(shift), shift).iter().zip(&reference) {
                assert!((a - b).norm() < 1e-12, "{shift}");
            }
        }
    }
}
