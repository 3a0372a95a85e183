//! Alignment of channels that were recorded late.
//!
//! A channel with offset d was recorded d samples late: its sample k + d belongs to sample k of the other channels,
//! `x'(k) = x(k + d)`. An offset of whole samples shifts rows and changes no value. For other offsets the band-limited
//! signal is interpolated by the windowed sinc of [`Kernel`]: up to 0.8 of the Nyquist frequency its error is below
//! 1e-4 of the amplitude (80 dB); components above are distorted. Rows in which a channel has no sample, or lacks
//! samples that the filter needs, are cut.

use std::str::FromStr;

use hoid_model::resampling::{Kernel, PASS_BAND_EDGE};

use super::record_parts::RecordParts;
use super::step::Step;
use crate::IoError;
use crate::wording::format_decimal;

/// Largest distance from a whole number of samples at which an offset counts as a whole number.
const INTEGER_TOLERANCE: f64 = 1e-6;

/// Recording delay of a channel; negative if it was recorded early.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Offset {
    /// Delay in samples of the record as read.
    Samples(f64),
    /// Delay in s.
    Seconds(f64),
}

/// Parses a delay in samples (`1`, `-0.5`) or in s (`0.0167s`).
impl FromStr for Offset {
    type Err = IoError;

    /// # Errors
    /// [`IoError::Offset`].
    fn from_str(text: &str) -> Result<Self, IoError> {
        let trimmed = text.trim();
        let number = |part: &str| part.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        let offset = match trimmed.strip_suffix('s') {
            Some(seconds) => number(seconds).map(Self::Seconds),
            None => number(trimmed).map(Self::Samples),
        };
        offset.ok_or_else(|| IoError::Offset { found: text.to_owned() })
    }
}

/// An offset in samples, and whether it requires interpolation.
#[derive(Clone, Copy)]
struct Shift {
    samples: f64,
    interpolated: bool,
}

impl RecordParts {
    #[expect(clippy::indexing_slicing, reason = "`find` returns indices of channels")]
    pub(super) fn apply_offsets(&mut self, offset: &std::collections::BTreeMap<String, Offset>) -> Result<(), IoError> {
        const STEP_NAME: &str = "offset";
        let ts = self.sample_time.s();
        let named = offset.iter().map(|(name, offset)| (name.clone(), *offset));
        let shifts: Vec<(usize, Shift)> = self
            .find_channels(STEP_NAME, named)?
            .into_iter()
            .map(|(channel, offset)| {
                let samples = match offset {
                    Offset::Samples(samples) => samples,
                    Offset::Seconds(seconds) => seconds / ts,
                };
                let interpolated = (samples - samples.round()).abs() > INTEGER_TOLERANCE;
                let samples = if interpolated { samples } else { samples.round() };
                (channel, Shift { samples, interpolated })
            })
            .filter(|(_, shift)| shift.samples != 0.0)
            .collect();
        if shifts.is_empty() {
            return Ok(());
        }
        if let Some((channel, shift)) = shifts.iter().find(|(_, shift)| !shift.samples.is_finite()) {
            let found = format!("{}={}", self.channels[*channel].name, shift.samples);
            return Err(self.error(STEP_NAME, found, "a finite number of samples or seconds"));
        }
        let kernel = Kernel::for_interpolation();
        let half = |shift: Shift| {
            if shift.interpolated {
                kernel.samples_per_side() as f64
            } else {
                0.0
            }
        };
        let last = self.len() as f64 - 1.0;
        // First and last row for which every channel has the samples it needs. They are floating-point numbers, since
        // an offset may be arbitrarily large.
        let (mut from, mut to) = (0.0_f64, last);
        for (_, shift) in &shifts {
            from = from.max((half(*shift) - shift.samples).ceil());
            to = to.min((last - half(*shift) - shift.samples).floor());
        }
        if from > to {
            let each: Vec<String> = shifts
                .iter()
                .map(|(channel, shift)| format!("{}={}", self.channels[*channel].name, format_decimal(shift.samples)))
                .collect();
            let more = if shifts.iter().any(|(_, shift)| shift.interpolated) {
                format!(" (and {} to each side for interpolation)", kernel.samples_per_side())
            } else {
                String::new()
            };
            return Err(self.error(
                STEP_NAME,
                format!(
                    "{} samples{more} in a record of {} samples",
                    each.join(", "),
                    self.len()
                ),
                "offsets that leave samples in which all channels overlap",
            ));
        }
        let (from, to) = (from as usize, to as usize);
        let rows = from..to.saturating_add(1);
        let cut = (rows.start, self.len().saturating_sub(rows.end));
        let moved: Vec<(usize, Vec<f64>)> = shifts
            .iter()
            .map(|(channel, shift)| {
                let values = &self.channels[*channel].values;
                let first = rows.start as f64 + shift.samples;
                let values = if shift.interpolated {
                    kernel.values(values, first, 1.0, rows.len())
                } else {
                    values.iter().skip(first as usize).take(rows.len()).copied().collect()
                };
                (*channel, values)
            })
            .collect();
        self.keep(rows);
        for ((channel, values), (_, shift)) in moved.into_iter().zip(&shifts) {
            let channel = &mut self.channels[channel];
            channel.values = values;
            self.steps.push(Step::Offset {
                channel: channel.name.clone(),
                samples: shift.samples,
                seconds: shift.samples * ts,
                interpolated: shift.interpolated,
                pass_hz: shift.interpolated.then_some(PASS_BAND_EDGE * 0.5 / ts),
                cut_samples: cut,
            });
        }
        Ok(())
    }
}
