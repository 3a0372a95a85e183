//! A record separated into its channels, for the steps of a preparation.

use hoid_model::{Channel, Detrend, ModelError, Record, SampleTime};

use super::step::Step;
use crate::IoError;
use crate::wording::list_names;

/// A record separated into its channels, and the steps applied to it.
pub(super) struct RecordParts {
    label: String,
    pub(super) start_s: f64,
    pub(super) sample_time: SampleTime,
    pub(super) channels: Vec<Channel>,
    /// True if the first channel is the input; the output is then the second channel, otherwise the first.
    pub(super) has_input: bool,
    pub(super) steps: Vec<Step>,
}

impl RecordParts {
    pub(super) fn new(record: Record) -> Self {
        let (label, start_s, sample_time) = (record.label().to_owned(), record.time_s(0), record.sample_time());
        let (input, output, others) = record.into_channels();
        Self {
            label,
            start_s,
            sample_time,
            has_input: input.is_some(),
            channels: input.into_iter().chain([output]).chain(others).collect(),
            steps: Vec::new(),
        }
    }

    /// Returns the number of samples of each channel.
    pub(super) fn len(&self) -> usize {
        self.channels.first().map_or(0, |channel| channel.values.len())
    }

    pub(super) fn error(&self, step: &'static str, found: impl Into<String>, expected: impl Into<String>) -> IoError {
        IoError::Preparation {
            record: self.label.clone(),
            step,
            found: found.into(),
            expected: expected.into(),
        }
    }

    /// Returns the index of each channel that a step names, with the value that the step gives for it.
    pub(super) fn find_channels<T: Copy>(
        &self,
        step: &'static str,
        named: impl Iterator<Item = (String, T)>,
    ) -> Result<Vec<(usize, T)>, IoError> {
        let mut found: Vec<(usize, T)> = Vec::new();
        for (name, value) in named {
            let by_name = self.channels.iter().position(|channel| channel.name == name);
            let role = match name.as_str() {
                "e" if self.has_input => Some(0),
                "u" => Some(usize::from(self.has_input)),
                _ => None,
            };
            let Some(channel) = by_name.or(role) else {
                let names: Vec<&str> = self.channels.iter().map(|channel| channel.name.as_str()).collect();
                return Err(self.error(
                    step,
                    format!("there is no channel \"{name}\""),
                    format!("one of {}, or e for the input and u for the output", list_names(&names)),
                ));
            };
            if found.iter().any(|(known, _)| *known == channel) {
                let name = self.channels.get(channel).map_or(&name, |channel| &channel.name);
                return Err(self.error(step, format!("\"{name}\" is named twice"), "each channel once"));
            }
            found.push((channel, value));
        }
        Ok(found)
    }

    /// Keeps a range of samples of all channels.
    pub(super) fn keep(&mut self, samples: std::ops::Range<usize>) {
        self.start_s += samples.start as f64 * self.sample_time.s();
        for channel in &mut self.channels {
            channel.values.truncate(samples.end);
            channel.values.drain(..samples.start);
        }
    }

    /// Removes the mean or the linear trend as `how` requires, and assembles the record; returns it with the applied
    /// steps.
    pub(super) fn detrended(self, how: Detrend) -> Result<(Record, Vec<Step>), IoError> {
        let Self {
            label,
            start_s,
            sample_time,
            channels,
            has_input,
            mut steps,
        } = self;
        let model = |source: ModelError| IoError::Model {
            file: label.clone(),
            source,
        };
        let mut channels = channels.into_iter();
        let mut next = || {
            channels
                .next()
                .ok_or_else(|| model(ModelError::EmptyRecord { label: label.clone() }))
        };
        let mut record = if has_input {
            Record::new(sample_time, next()?, next()?)
        } else {
            Record::from_output(sample_time, next()?)
        }
        .map_err(model)?
        .starting_at(start_s);
        for channel in channels {
            record = record.with_channel(channel).map_err(model)?;
        }
        if let Some(how) = Step::from_detrend(how) {
            steps.push(how);
        }
        let record = record.labelled(label.clone()).detrended(how);
        Ok((record, steps))
    }
}
