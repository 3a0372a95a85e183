//! An evenly sampled record of a person's control activity.
//!
//! A [`Record`] contains the input of the person (the tracking error e), the output (the control u) and any other
//! channel that was measured or simulated at the same samples. A record is checked when it is created: all channels
//! have the same length and every sample is finite, so later code need not check again.

use crate::{ModelError, SampleTime};

/// One named signal of a record.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Name, as in the header of a file.
    pub name: String,
    /// Unit as text, empty if unknown.
    pub unit: String,
    /// Role of the signal for the person, such as `feedforward:0.5` for a target that is displayed 0.5 s ahead; empty
    /// if the signal has no role or its role is unknown.
    pub role: String,
    /// Values of the signal, one for each sample.
    pub values: Vec<f64>,
}

impl Channel {
    /// Creates a channel with a unit.
    pub fn new(name: impl Into<String>, unit: impl Into<String>, values: Vec<f64>) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            role: String::new(),
            values,
        }
    }

    /// Returns the channel with a role for the person.
    #[must_use]
    pub fn with_role(mut self, role: impl Into<String>) -> Self {
        self.role = role.into();
        self
    }
}

/// Trend that is removed from the input and the output before a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum Detrend {
    /// No trend: the data remain unchanged.
    #[default]
    None,
    /// The mean of each channel is removed.
    Mean,
    /// The least-squares line of each channel is removed.
    Linear,
}

crate::named_choice!(Detrend, "detrending", 3, { None => "none", Mean => "mean", Linear => "linear" });

/// Evenly sampled input e, output u and further channels.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    label: String,
    sample_time: SampleTime,
    start_s: f64,
    input: Option<Channel>,
    output: Channel,
    others: Vec<Channel>,
}

impl Record {
    /// Creates a record of the input (tracking error) and the output (control), both with one value per sample.
    ///
    /// # Errors
    /// [`ModelError::EmptyRecord`], [`ModelError::LengthMismatch`], [`ModelError::NotFinite`],
    /// [`ModelError::DuplicateChannel`].
    pub fn new(sample_time: SampleTime, input: Channel, output: Channel) -> Result<Self, ModelError> {
        // The record is created from the input first, so that the input determines the length.
        let record = Self::from_output(sample_time, input)?;
        record.check(&output)?;
        Ok(Self {
            input: Some(record.output),
            output,
            ..record
        })
    }

    /// Creates a record of an output alone, for the structures without an input (AR, MA, ARMA).
    ///
    /// # Errors
    /// [`ModelError::EmptyRecord`], [`ModelError::NotFinite`].
    pub fn from_output(sample_time: SampleTime, output: Channel) -> Result<Self, ModelError> {
        if output.values.is_empty() {
            return Err(ModelError::EmptyRecord {
                label: String::from("(unnamed)"),
            });
        }
        check_finite(&output)?;
        Ok(Self {
            label: String::new(),
            sample_time,
            start_s: 0.0,
            input: None,
            output,
            others: Vec::new(),
        })
    }

    /// Returns the record with a name for messages and reports.
    pub fn labelled(mut self, label: impl Into<String>) -> Self {
        self.label = label.into();
        self
    }

    /// Returns the record with the given time of its first sample, in s.
    pub fn starting_at(mut self, start_s: f64) -> Self {
        self.start_s = start_s;
        self
    }

    /// Returns the record with an additional channel.
    ///
    /// # Errors
    /// [`ModelError::DuplicateChannel`], [`ModelError::LengthMismatch`], [`ModelError::NotFinite`].
    pub fn with_channel(mut self, channel: Channel) -> Result<Self, ModelError> {
        self.check(&channel)?;
        self.others.push(channel);
        Ok(self)
    }

    fn check(&self, channel: &Channel) -> Result<(), ModelError> {
        if self.channels().any(|known| known.name == channel.name) {
            return Err(ModelError::DuplicateChannel {
                name: channel.name.clone(),
            });
        }
        if channel.values.len() != self.len() {
            return Err(ModelError::LengthMismatch {
                channel: channel.name.clone(),
                found: channel.values.len(),
                expected: self.len(),
                reference: self.input.as_ref().unwrap_or(&self.output).name.clone(),
            });
        }
        check_finite(channel)
    }

    /// Name of the record in messages and reports.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// Time between two samples.
    pub fn sample_time(&self) -> SampleTime {
        self.sample_time
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.output.values.len()
    }

    /// Always false: a record without samples cannot be created.
    pub fn is_empty(&self) -> bool {
        self.output.values.is_empty()
    }

    /// Time of sample `k` in s.
    pub fn time_s(&self, k: usize) -> f64 {
        // The time is computed from the index and not by summation, so rounding errors do not grow along the record.
        self.start_s + k as f64 * self.sample_time.s()
    }

    /// Times of all samples in s.
    pub fn times_s(&self) -> Vec<f64> {
        (0..self.len()).map(|k| self.time_s(k)).collect()
    }

    /// Returns the input e, one value per sample; empty for a record of an output alone.
    pub fn input(&self) -> &[f64] {
        self.input.as_ref().map_or(&[], |c| &c.values)
    }

    /// Returns the output u, one value per sample.
    pub fn output(&self) -> &[f64] {
        &self.output.values
    }

    /// Returns the input with its name and unit; `None` for a record of an output alone.
    pub fn input_channel(&self) -> Option<&Channel> {
        self.input.as_ref()
    }

    /// Returns the output with its name and unit.
    pub fn output_channel(&self) -> &Channel {
        &self.output
    }

    /// Iterates over all channels: input, output, then the others in the order in which they were added.
    pub fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.input.iter().chain([&self.output]).chain(&self.others)
    }

    /// Returns the channels by value, without a copy: input, output, others.
    pub fn into_channels(self) -> (Option<Channel>, Channel, Vec<Channel>) {
        (self.input, self.output, self.others)
    }

    /// Returns the values of the channel with a given name; `None` if there is no such channel.
    pub fn channel(&self, name: &str) -> Option<&[f64]> {
        self.channels().find(|c| c.name == name).map(|c| c.values.as_slice())
    }

    /// Returns the values of a channel other than the input and the output; `None` if there is no such channel.
    pub fn other_channel(&self, name: &str) -> Option<&[f64]> {
        let found = self.others.iter().find(|c| c.name == name);
        found.map(|c| c.values.as_slice())
    }

    /// Returns the part of the record with the samples at `from_s <= t < to_s`.
    ///
    /// # Errors
    /// [`ModelError::EmptySpan`] if the record has no samples in this span.
    pub fn span(&self, from_s: f64, to_s: f64) -> Result<Self, ModelError> {
        let ts = self.sample_time.s();
        // A bound that equals the time of a sample, up to rounding, is treated as that time.
        let index = |time_s: f64| ((time_s - self.start_s) / ts - 1e-6).ceil().max(0.0) as usize;
        let (first, end) = (index(from_s), index(to_s).min(self.len()));
        if from_s.is_nan() || to_s.is_nan() || first >= end {
            return Err(ModelError::EmptySpan {
                from_s,
                to_s,
                start_s: self.start_s,
                end_s: self.time_s(self.len() - 1),
            });
        }
        let cut = |c: &Channel| {
            Channel::new(c.name.clone(), c.unit.clone(), c.values[first..end].to_vec()).with_role(c.role.clone())
        };
        Ok(Self {
            label: self.label.clone(),
            sample_time: self.sample_time,
            start_s: self.time_s(first),
            input: self.input.as_ref().map(cut),
            output: cut(&self.output),
            others: self.others.iter().map(cut).collect(),
        })
    }

    /// Returns this record followed by the samples of another record, the first of which is placed one sample time
    /// after the last sample of this record.
    ///
    /// Channels that only one of the two records has are omitted; the label, the names and the units are those of the
    /// first record.
    ///
    /// # Errors
    /// [`ModelError::Joined`] if the sample times differ by more than one part in a million, or if only one of the two
    /// records has an input.
    pub fn joined(mut self, next: &Self) -> Result<Self, ModelError> {
        let (first, second) = (self.sample_time.s(), next.sample_time.s());
        let refuse = |found: String, expected: &'static str| ModelError::Joined {
            label: next.label.clone(),
            found,
            expected,
        };
        if (first - second).abs() > 1e-6 * first {
            return Err(refuse(
                format!("a sample time of {second} s, but the previous record has {first} s"),
                "the same sample time: read both records at one rate",
            ));
        }
        match (&mut self.input, &next.input) {
            (Some(input), Some(more)) => input.values.extend_from_slice(&more.values),
            (None, None) => {}
            _ => {
                return Err(refuse(
                    "an input in only one of the records".to_owned(),
                    "an input in both records or in neither",
                ));
            }
        }
        self.output.values.extend_from_slice(&next.output.values);
        self.others
            .retain_mut(|channel| match next.others.iter().find(|c| c.name == channel.name) {
                Some(more) => {
                    channel.values.extend_from_slice(&more.values);
                    true
                }
                None => false,
            });
        Ok(self)
    }

    /// Returns the record with the mean or the least-squares line of the input and the output removed; other channels
    /// remain unchanged.
    pub fn detrended(mut self, how: Detrend) -> Self {
        self.signals_mut().for_each(|values| subtract_trend(how, values));
        self
    }

    /// Returns the record with a function, such as a filter, applied to the input and the output; other channels remain
    /// unchanged.
    ///
    /// # Errors
    /// [`ModelError::NotFinite`] if a changed value is not finite.
    pub fn map_signals(mut self, change: impl FnMut(&mut [f64])) -> Result<Self, ModelError> {
        self.signals_mut().for_each(change);
        self.input.iter().chain([&self.output]).try_for_each(check_finite)?;
        Ok(self)
    }

    /// Iterates over the values of the input and the output, in this order.
    fn signals_mut(&mut self) -> impl Iterator<Item = &mut [f64]> {
        let channels = self.input.iter_mut().chain([&mut self.output]);
        channels.map(|channel| channel.values.as_mut_slice())
    }
}

fn check_finite(channel: &Channel) -> Result<(), ModelError> {
    match channel.values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(index) => Err(ModelError::NotFinite {
            channel: channel.name.clone(),
            index,
            value: channel.values[index],
        }),
    }
}

impl Detrend {
    /// Returns the values without the trend.
    #[must_use]
    pub fn detrended_values(self, values: &[f64]) -> Vec<f64> {
        let mut left = values.to_vec();
        subtract_trend(self, &mut left);
        left
    }
}

fn subtract_trend(how: Detrend, values: &mut [f64]) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let centre = (n - 1.0) / 2.0;
    let slope = match how {
        Detrend::None => return,
        Detrend::Mean => 0.0,
        Detrend::Linear if values.len() < 2 => 0.0,
        Detrend::Linear => {
            let moment: f64 = values.iter().enumerate().map(|(k, v)| (k as f64 - centre) * v).sum();
            moment / (n * (n * n - 1.0) / 12.0)
        }
    };
    for (k, value) in values.iter_mut().enumerate() {
        *value -= mean + slope * (k as f64 - centre);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(name: &str, values: &[f64]) -> Channel {
        Channel::new(name, "deg", values.to_vec())
    }

    fn record(e: &[f64], u: &[f64]) -> Result<Record, ModelError> {
        Record::new(SampleTime::new(0.01)?, channel("e", e), channel("u", u))
    }

    #[test]
    fn record_is_validated_on_construction() {
        assert!(matches!(record(&[], &[]), Err(ModelError::EmptyRecord { .. })));
        assert!(matches!(
            record(&[1.0, 2.0], &[1.0]),
            Err(ModelError::LengthMismatch {
                found: 1,
                expected: 2,
                ..
            })
        ));
        assert!(matches!(
            record(&[1.0, f64::NAN], &[1.0, 2.0]),
            Err(ModelError::NotFinite { index: 1, .. })
        ));
        let good = record(&[1.0, 2.0], &[1.0, 2.0]).unwrap();
        assert!(matches!(
            good.clone().with_channel(channel("u", &[0.0, 0.0])),
            Err(ModelError::DuplicateChannel { .. })
        ));
        assert!(good.with_channel(channel("x", &[0.0, f64::INFINITY])).is_err());
    }

    #[test]
    fn joined_records_keep_common_channels() {
        let first = record(&[1.0, 2.0], &[3.0, 4.0])
            .unwrap()
            .starting_at(5.0)
            .with_channel(channel("x", &[7.0, 7.0]))
            .unwrap()
            .with_channel(channel("n", &[0.1, 0.2]))
            .unwrap();
        let second = record(&[5.0], &[6.0])
            .unwrap()
            .with_channel(channel("n", &[0.3]))
            .unwrap();
        let joined = first.clone().joined(&second).unwrap();
        assert_eq!(
            (joined.input(), joined.output()),
            (&[1.0, 2.0, 5.0][..], &[3.0, 4.0, 6.0][..])
        );
        assert_eq!(
            (joined.channel("n"), joined.channel("x")),
            (Some(&[0.1, 0.2, 0.3][..]), None)
        );
        assert!((joined.time_s(2) - 5.02).abs() < 1e-12);
        // A span of the joined record gives the first record again.
        assert_eq!(joined.span(5.0, 5.02).unwrap().output(), first.output());
        let slower = Record::new(
            SampleTime::new(0.02).unwrap(),
            channel("e", &[1.0]),
            channel("u", &[1.0]),
        )
        .unwrap();
        assert!(matches!(first.clone().joined(&slower), Err(ModelError::Joined { .. })));
        let alone = Record::from_output(first.sample_time(), channel("u", &[1.0])).unwrap();
        assert!(matches!(first.joined(&alone), Err(ModelError::Joined { .. })));
    }

    #[test]
    fn output_only_record_is_valid() {
        let ts = SampleTime::new(0.01).unwrap();
        let alone = Record::from_output(ts, channel("u", &[1.0, 2.0, 3.0])).unwrap();
        assert!(alone.input().is_empty() && alone.input_channel().is_none());
        assert_eq!((alone.len(), alone.channels().count()), (3, 1));
        let part = alone.clone().detrended(Detrend::Mean).span(0.01, 1.0).unwrap();
        assert_eq!(part.output(), [0.0, 1.0]);
        assert!(alone.with_channel(channel("x", &[1.0])).is_err());
        assert!(Record::from_output(ts, channel("u", &[])).is_err());
    }

    #[test]
    fn span_is_half_open() {
        let values: Vec<f64> = (0..100).map(f64::from).collect();
        let record = record(&values, &vec![0.0; 100]).unwrap().starting_at(-0.2);
        let part = record.span(0.0, 0.3).unwrap();
        assert_eq!(part.len(), 30);
        assert_eq!(part.input()[0], 20.0);
        assert!(part.time_s(0).abs() < 1e-12);
        // 0.29 s is the time of a sample, although 0.29 / 0.01 is not an integer in floating point.
        assert_eq!(record.span(0.09, 10.0).unwrap().input()[0], 29.0);
        assert!(matches!(record.span(0.5, 0.5), Err(ModelError::EmptySpan { .. })));
        assert!(record.span(9.0, 10.0).is_err());
        assert!(record.span(f64::NAN, 1.0).is_err());
    }

    #[test]
    fn detrending_removes_mean_or_line() {
        let line: Vec<f64> = (0..50).map(|k| 3.0 + 0.5 * f64::from(k)).collect();
        let flat = vec![2.0; 50];
        let record = record(&line, &flat).unwrap();
        let linear = record.clone().detrended(Detrend::Linear);
        assert!(linear.input().iter().all(|v| v.abs() < 1e-12));
        let mean = record.clone().detrended(Detrend::Mean);
        assert!((mean.input().iter().sum::<f64>()).abs() < 1e-10);
        assert!((mean.input()[0] + 12.25).abs() < 1e-12);
        assert_eq!(record.clone().detrended(Detrend::None), record);
    }

    #[test]
    fn map_signals_changes_only_input_and_output() {
        let whole = record(&[1.0, 2.0], &[3.0, 4.0])
            .unwrap()
            .labelled("run")
            .starting_at(5.0)
            .with_channel(channel("x", &[7.0, 8.0]))
            .unwrap();
        let twice = |values: &mut [f64]| values.iter_mut().for_each(|v| *v *= 2.0);
        let found = whole.clone().map_signals(twice).unwrap();
        assert_eq!((found.input(), found.output()), (&[2.0, 4.0][..], &[6.0, 8.0][..]));
        // Everything else is unchanged: the inverse function restores the record.
        let back = found.map_signals(|values| values.iter_mut().for_each(|v| *v /= 2.0));
        assert_eq!(back.unwrap(), whole);
        let mut order = Vec::new();
        whole.clone().map_signals(|values| order.push(values[0])).unwrap();
        assert_eq!(order, [1.0, 3.0]);
        let alone = Record::from_output(whole.sample_time(), channel("u", &[1.0])).unwrap();
        assert_eq!(alone.map_signals(twice).unwrap().output(), [2.0]);
        assert!(matches!(
            whole.map_signals(|values| values[1] /= 0.0),
            Err(ModelError::NotFinite { index: 1, .. })
        ));
    }
}
