//! What is done to a record between the file and the estimator, and the account of it.
//!
//! The steps are taken in one order, whatever the order in which they were asked for:
//!
//! | step | module | what it does |
//! |---|---|---|
//! | scale | `scaling` | a channel times a factor, or from one unit to another |
//! | offset | `offset` | channels that were recorded late are put beside the others |
//! | rate | `rate` | every M-th sample, or a new sampling frequency, behind a low-pass filter |
//! | run-in | here | the first seconds are dropped |
//! | detrend | [`Record::detrended`] | mean or straight line out of input and output |
//!
//! `kernel` is the filter of the two steps that need one. Samples whose filter would reach beyond the record are cut, never
//! invented. Each step that was taken is a [`Step`], with its numbers; reading adds those of its repairs before.

mod kernel;
mod offset;
mod rate;
mod scaling;
mod step;

use std::collections::BTreeMap;

use hoid_model::{Channel, Detrend, ModelError, Record, SampleTime};

pub use offset::Offset;
pub use rate::NewRate;
pub use scaling::Scaling;
pub use step::Step;

use crate::IoError;

/// What is to be done to a record. By default nothing is.
///
/// A channel is meant by its name; `e` and `u` are the input and the output, whatever their columns are called.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Preparation {
    /// Factors and units by channel.
    pub scale: BTreeMap<String, Scaling>,
    /// By how much channels were recorded later than they happened.
    pub offset: BTreeMap<String, Offset>,
    /// Another sampling rate.
    pub rate: NewRate,
    /// Time from the first sample that is dropped, s. What the filters cut lies within it.
    pub run_in_s: f64,
    /// What is taken out of input and output, last.
    pub detrend: Detrend,
    /// Whether rows that are there twice, time included, are dropped before anything is read.
    pub drop_repeated: bool,
}

impl Preparation {
    /// The record as it goes to the estimator, and what was done. [`Preparation::drop_repeated`] belongs to reading and is not
    /// looked at.
    ///
    /// # Errors
    /// [`IoError::Preparation`] naming the step, what was found, and what was expected; [`IoError::Model`] where the numbers
    /// leave the range of floating point.
    pub fn apply(&self, record: Record) -> Result<(Record, Vec<Step>), IoError> {
        let begin_s = record.time_s(0);
        let mut bench = Bench::new(record);
        bench.scale(&self.scale)?;
        bench.offset(&self.offset)?;
        bench.rate(self.rate)?;
        bench.run_in(begin_s, self.run_in_s)?;
        bench.detrended(self.detrend)
    }
}

/// A record taken apart, and what was done to it.
struct Bench {
    label: String,
    start_s: f64,
    sample_time: SampleTime,
    channels: Vec<Channel>,
    /// Whether the first channel is an input; then the second is the output, else the first.
    has_input: bool,
    steps: Vec<Step>,
}

impl Bench {
    fn new(record: Record) -> Self {
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

    /// Samples of each channel.
    fn len(&self) -> usize {
        self.channels[0].values.len()
    }

    fn error(&self, step: &'static str, found: impl Into<String>, expected: impl Into<String>) -> IoError {
        IoError::Preparation {
            record: self.label.clone(),
            step,
            found: found.into(),
            expected: expected.into(),
        }
    }

    /// The channels that are meant by the names of a step.
    fn find<T: Copy>(
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
                    format!(
                        "one of {}, or e and u for input and output",
                        crate::column_expression::list(&names)
                    ),
                ));
            };
            if found.iter().any(|(known, _)| *known == channel) {
                let name = &self.channels[channel].name;
                return Err(self.error(step, format!("\"{name}\" is named twice"), "each channel once"));
            }
            found.push((channel, value));
        }
        Ok(found)
    }

    /// Drops what lies before the end of the run-in.
    fn run_in(&mut self, begin_s: f64, run_in_s: f64) -> Result<(), IoError> {
        const STEP: &str = "run-in";
        if run_in_s == 0.0 {
            return Ok(());
        }
        if !(run_in_s > 0.0 && run_in_s.is_finite()) {
            return Err(self.error(STEP, format!("{run_in_s} s"), "a positive time in s"));
        }
        let ts = self.sample_time.s();
        // A bound that falls on a sample, up to rounding, takes that sample.
        let first = ((begin_s + run_in_s - self.start_s) / ts - 1e-6).ceil().max(0.0);
        if first >= self.len() as f64 {
            return Err(self.error(
                STEP,
                format!(
                    "{run_in_s} s leave nothing of {} s",
                    decimal(self.start_s + self.len() as f64 * ts - begin_s)
                ),
                "a run-in shorter than the record",
            ));
        }
        let first = first as usize;
        self.steps.push(Step::RunIn {
            seconds: run_in_s,
            samples: first,
        });
        self.keep(first..self.len());
        Ok(())
    }

    /// Keeps some samples of all channels.
    fn keep(&mut self, samples: std::ops::Range<usize>) {
        self.start_s += samples.start as f64 * self.sample_time.s();
        for channel in &mut self.channels {
            channel.values.truncate(samples.end);
            channel.values.drain(..samples.start);
        }
    }

    /// Puts the record together, mean or line taken out.
    fn detrended(self, how: Detrend) -> Result<(Record, Vec<Step>), IoError> {
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
            Record::of_output(sample_time, next()?)
        }
        .map_err(model)?
        .starting_at(start_s);
        for channel in channels {
            record = record.with_channel(channel).map_err(model)?;
        }
        if let Some(how) = Step::of_detrend(how) {
            steps.push(how);
        }
        let record = record.labelled(label.clone()).detrended(how);
        Ok((record, steps))
    }
}

/// A number for a message: up to nine significant digits, without zeros at the end.
pub(crate) fn decimal(value: f64) -> String {
    let rounded = format!("{value:.8e}").parse::<f64>().unwrap_or(value);
    format!("{rounded}")
}

#[cfg(test)]
mod tests;
