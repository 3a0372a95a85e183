//! Decimated records.

use super::decimation::{Decimated, Decimation};
use super::kernel::Kernel;
use crate::{Channel, ModelError, Record};

impl Decimation {
    /// Returns the record at its new rate, with the description of the decimation, which is `None` if the record was
    /// not decimated.
    ///
    /// # Errors
    /// As [`Record::decimated`].
    pub fn apply(self, record: Record) -> Result<(Record, Option<Decimated>), ModelError> {
        match self.factor(record.sample_time()) {
            1 => Ok((record, None)),
            factor => record.decimated(factor).map(|(record, done)| (record, Some(done))),
        }
    }
}

impl Record {
    /// Returns every M-th sample of all channels after the same linear-phase filter, with the input taken in the middle
    /// of the M samples over which it is held. M is `factor`.
    ///
    /// # Errors
    /// [`ModelError::Decimation`] for a factor of 0, and for a record that is shorter than half the filter.
    pub fn decimated(self, factor: usize) -> Result<(Self, Decimated), ModelError> {
        let refuse = |found: String, expected: String| ModelError::Decimation {
            label: self.label().to_owned(),
            found,
            expected,
        };
        if factor == 0 {
            return Err(refuse("a factor of 0".to_owned(), "1 or more".to_owned()));
        }
        let n = self.len();
        // The reflected part must be shorter than the record.
        let Some((done, kernel, new)) = Decimated::from_factor(factor, self.sample_time(), n - 1) else {
            let half = Decimated::from_factor(factor, self.sample_time(), usize::MAX)
                .map(|(_, kernel, _)| kernel.samples_per_side());
            return Err(refuse(
                format!(
                    "{n} samples, but the filter extends {} samples to each side",
                    half.map_or_else(|| "too many".to_owned(), |half| half.to_string())
                ),
                "a longer record, or a smaller factor; use decimate off to keep the rate".to_owned(),
            ));
        };
        // The duration is preserved to within half a new sample, so whole periods remain whole.
        let new_samples = (n + factor / 2) / factor;
        let (label, start_s) = (self.label().to_owned(), self.time_s(0));
        let (input, output, others) = self.into_channels();
        let at = |first: f64, channel: Channel| Channel {
            values: filtered_values(kernel, &channel.values, first, factor, new_samples),
            ..channel
        };
        let output = at(0.0, output);
        let record = match input {
            Some(input) => Self::new(new, at(0.5 * (factor as f64 - 1.0), input), output),
            None => Self::from_output(new, output),
        }?;
        let mut record = record.labelled(label).starting_at(start_s);
        for channel in others {
            record = record.with_channel(at(0.0, channel))?;
        }
        Ok((record, done))
    }
}

/// Returns filtered values at `first + k factor` for k = 0 to n - 1; beyond its ends the signal is reflected in the end
/// points.
fn filtered_values(kernel: Kernel, values: &[f64], first: f64, factor: usize, n: usize) -> Vec<f64> {
    let half = kernel.samples_per_side();
    let last = values.len() - 1;
    let mut long = Vec::with_capacity(values.len() + 2 * half);
    long.extend((1..=half).rev().map(|k| 2.0 * values[0] - values[k]));
    long.extend_from_slice(values);
    long.extend((1..=half).map(|k| 2.0 * values[last] - values[last - k]));
    kernel.values(&long, half as f64 + first, factor as f64, n)
}
