//! Sample-by-sample decimation, for streams.
//!
//! The output for old sample `k M` is available when the filter has received all later old samples that it needs. The
//! delay of the stream is half the length of the filter plus M/2 samples, about 15 samples at the new rate
//! ([`Decimated::lag_s`]). Up to the last available sample, the values of the stream are identical to those of the
//! decimated record.
//!
//! **Values that are not finite** (missing, faulty) are replaced by the last valid value at the input of the filter. A
//! new sample is NaN, and is not used for identification, if one of the M old samples that it replaces is not finite.

use std::collections::VecDeque;

use hoid_core::state::State;

use super::decimation::Decimated;
use super::kernel::Kernel;
use crate::{ModelError, SampleTime};

/// Maximum number of samples on each side of the filter in a stream.
const MAX_HALF_LENGTH: usize = 1_000_000;

/// Decimator of C channels together.
#[derive(Debug, Clone)]
pub struct Decimator<const C: usize> {
    decimation: Decimated,
    kernel: Kernel,
    sample_time: SampleTime,
    lanes: [DecimatedChannel; C],
    /// Number of input samples so far.
    input_count: u64,
    /// Number of output samples so far.
    output_count: u64,
}

/// Past samples of one channel.
#[derive(Debug, Clone)]
struct DecimatedChannel {
    /// Number of old samples, rounded down, from old sample `k M` to the instant of the new value: for a held input
    /// the instant is the middle of the M samples, otherwise sample `k M` itself.
    lead: i64,
    /// Position of the first weight relative to old sample `k M + lead` (in old samples).
    offset: i64,
    /// Weights of the filter.
    weights: Vec<f64>,
    /// Past samples that the filter needs.
    past: VecDeque<f64>,
    /// Index of the first of the past samples; negative within the reflection of the start.
    first: i64,
    /// Last valid value of the channel.
    last: f64,
    /// True if a valid value has been received.
    has_valid_sample: bool,
    /// Indices of samples that are not finite, from the sample of the last output on.
    invalid_samples: VecDeque<u64>,
}

impl<const C: usize> Decimator<C> {
    /// Creates a decimator by a factor of 2 or more; `held` marks the channels that are held inputs of a model.
    ///
    /// # Errors
    /// [`ModelError::Decimation`] for an invalid factor.
    pub fn new(factor: usize, sample_time: SampleTime, held: [bool; C]) -> Result<Self, ModelError> {
        let found = (factor > 1)
            .then(|| Decimated::from_factor(factor, sample_time, MAX_HALF_LENGTH))
            .flatten();
        let Some((done, kernel, new)) = found else {
            return Err(ModelError::Decimation {
                label: "stream".to_owned(),
                found: format!("a factor of {factor}"),
                expected: "2 to a few thousand; use decimate off to keep the rate".to_owned(),
            });
        };
        let lane = |held: bool| {
            let lead = if held { 0.5 * (factor as f64 - 1.0) } else { 0.0 };
            let (offset, weights) = kernel.weights(lead.fract());
            DecimatedChannel {
                lead: lead.floor() as i64,
                offset: offset as i64,
                weights,
                past: VecDeque::new(),
                first: 0,
                last: 0.0,
                has_valid_sample: false,
                invalid_samples: VecDeque::new(),
            }
        };
        Ok(Self {
            decimation: done,
            kernel,
            sample_time: new,
            lanes: held.map(lane),
            input_count: 0,
            output_count: 0,
        })
    }

    /// Returns the description of the decimation.
    pub fn applied_decimation(&self) -> Decimated {
        self.decimation
    }

    /// Returns the new sample time.
    pub fn sample_time(&self) -> SampleTime {
        self.sample_time
    }

    /// Returns the number of old samples between the sample to which the last output belongs and the last input.
    pub fn lag_samples(&self) -> u64 {
        let at = self.output_count.saturating_sub(1) * self.decimation.factor as u64;
        self.input_count.saturating_sub(1).saturating_sub(at)
    }

    /// Returns the state as numbers, for [`Decimator::restore`].
    pub fn saved_state(&mut self) -> Vec<f64> {
        let mut numbers = Vec::new();
        self.visit(&mut |number| numbers.push(*number));
        numbers
    }

    /// Restores the state saved by [`Decimator::saved_state`]; returns false if the numbers belong to another
    /// decimator.
    #[must_use]
    pub fn restore(&mut self, numbers: &[f64]) -> bool {
        let (mut left, mut lacking) = (numbers.iter(), false);
        self.visit(&mut |number| match left.next() {
            Some(saved) => *number = *saved,
            None => lacking = true,
        });
        !lacking && left.next().is_none()
    }

    /// Takes one sample of each channel; returns a new sample of each channel if one is available, otherwise `None`.
    pub fn push(&mut self, values: [f64; C]) -> Option<[f64; C]> {
        let (number, factor, half) = (
            self.input_count,
            self.decimation.factor as u64,
            self.kernel.samples_per_side(),
        );
        self.input_count += 1;
        for (lane, value) in self.lanes.iter_mut().zip(values) {
            lane.push(value, number);
        }
        // The last sample that the next output needs has not yet arrived.
        if self.input_count <= self.output_count * factor + factor / 2 + half as u64 {
            return None;
        }
        if self.output_count == 0 {
            self.lanes.iter_mut().for_each(|lane| lane.reflect(half));
        }
        let at = self.output_count * factor;
        let found = self.lanes.each_mut().map(|lane| {
            let value = lane.value(at, factor);
            lane.discard_before(at + factor, half);
            value
        });
        self.output_count += 1;
        Some(found)
    }
}

impl DecimatedChannel {
    fn push(&mut self, value: f64, number: u64) {
        if value.is_finite() {
            self.last = value;
            if !self.has_valid_sample {
                // The samples before the first value are not known: they are set to this value.
                self.past.iter_mut().for_each(|past| *past = value);
                self.has_valid_sample = true;
            }
        } else {
            self.invalid_samples.push_back(number);
        }
        self.past.push_back(self.last);
    }

    /// Extends the past by the reflection of the start in the first sample.
    fn reflect(&mut self, half: usize) {
        let first = self.past.front().copied().unwrap_or(self.last);
        for k in 1..=half {
            // The k - 1 values inserted so far have shifted sample k to position 2 k - 1. It is missing only after
            // altered numbers have been restored.
            let value = 2.0 * first - self.past.get(2 * k - 1).unwrap_or(&first);
            self.past.push_front(value);
        }
        self.first = -(half as i64);
    }

    /// Returns the new value for the `factor` old samples from `at` on; NaN if one of them is not finite.
    fn value(&mut self, at: u64, factor: u64) -> f64 {
        if self.invalid_samples.iter().any(|bad| (at..at + factor).contains(bad)) {
            return f64::NAN;
        }
        let from = (at as i64 + self.lead + self.offset - self.first).max(0) as usize;
        let past: &[f64] = self.past.make_contiguous();
        self.weights
            .iter()
            .zip(&past[from.min(past.len())..])
            .map(|(w, x)| w * x)
            .sum()
    }

    /// Discards the samples that the value at `next` and later values do not need.
    fn discard_before(&mut self, next: u64, half: usize) {
        while self.first < next as i64 - half as i64 && self.past.pop_front().is_some() {
            self.first += 1;
        }
        while self.invalid_samples.front().is_some_and(|bad| *bad < next) {
            self.invalid_samples.pop_front();
        }
    }
}

impl<const C: usize> State for Decimator<C> {
    /// The restored numbers may come from any source: counts and indices are limited to values that a stream can reach.
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        let (half, factor) = (self.kernel.samples_per_side(), self.decimation.factor);
        let most = 2 * half + 4 * factor + 4;
        self.input_count.visit(each);
        self.output_count.visit(each);
        self.output_count = self.output_count.min(self.input_count / factor as u64 + 1);
        for lane in &mut self.lanes {
            let mut numbers = [lane.first as f64, lane.last, f64::from(u8::from(lane.has_valid_sample))];
            numbers.iter_mut().for_each(&mut *each);
            lane.first = (numbers[0] as i64).clamp(-(half as i64), self.input_count as i64);
            lane.last = numbers[1];
            lane.has_valid_sample = numbers[2] != 0.0;
            let mut length = lane.past.len() as f64;
            each(&mut length);
            lane.past.resize((length.max(0.0) as usize).min(most), 0.0);
            lane.past.iter_mut().for_each(&mut *each);
            let mut bad = lane.invalid_samples.len() as f64;
            each(&mut bad);
            lane.invalid_samples.resize((bad.max(0.0) as usize).min(most), 0);
            for number in &mut lane.invalid_samples {
                let mut value = *number as f64;
                each(&mut value);
                *number = value.max(0.0) as u64;
            }
        }
    }
}
