//! Change in the sampling rate, with the same anti-aliasing filter for all channels.
//!
//! **Every M-th sample** is the decimation of [`hoid_model::resampling`]: nothing is cut at the ends, and the input is
//! taken from the middle of its longer hold, so the delay of a model is unchanged.
//!
//! **A new sampling frequency** is obtained by interpolating the record with the windowed sinc of [`Kernel`]. Its pass
//! band ends at 0.8 of the lower of the old and the new Nyquist frequencies; the ripple in the pass band is below 1e-4
//! (0.001 dB). If the frequency decreases, the stop band starts at the new Nyquist frequency, and aliases are
//! attenuated by 80 dB. The filter has linear phase, its delay is compensated, and it is the same for all channels, so
//! the relation between e and u is preserved. The new samples lie on a grid that starts at the first sample of the
//! record; samples whose filter would reach beyond the record are cut.
//!
//! In a model with a hold (all models of hoid) the input is held over the new sample time T, whereas the input of the
//! operator was held over the old sample time Ts. A hold over T delays by T/2. The input is therefore taken
//! `(T - Ts)/2` later than the output, as in decimation (earlier if the frequency increases), and the delay of a model
//! is the same at both rates.

use hoid_model::{
    Detrend, SampleTime,
    resampling::{Kernel, PASS_BAND_EDGE, STOP_BAND_ATTENUATION_DB},
};

use super::record_parts::RecordParts;
use super::step::Step;
use crate::IoError;
use crate::wording::format_decimal;

/// Maximum ratio of the new sampling frequency to the old one.
const MAX_RATE_RATIO: f64 = 100.0;

/// New sampling rate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum NewRate {
    /// The rate of the record is kept.
    #[default]
    Kept,
    /// Only every M-th sample is kept.
    Decimated(usize),
    /// New sampling frequency, Hz.
    Hz(f64),
}

impl RecordParts {
    pub(super) fn change_rate(mut self, rate: NewRate) -> Result<Self, IoError> {
        match rate {
            NewRate::Kept | NewRate::Decimated(1) => {}
            NewRate::Decimated(factor) => return self.decimated(factor),
            NewRate::Hz(hz) => self.resample(hz)?,
        }
        Ok(self)
    }

    fn decimated(self, factor: usize) -> Result<Self, IoError> {
        let (record, mut steps) = self.detrended(Detrend::None)?;
        let file = record.label().to_owned();
        let (record, done) = record
            .decimated(factor)
            .map_err(|source| IoError::Model { file, source })?;
        steps.push(done.into());
        let mut parts = Self::new(record);
        parts.steps = steps;
        Ok(parts)
    }

    fn resample(&mut self, hz: f64) -> Result<(), IoError> {
        let (step, old) = ("new-fs", self.sample_time);
        let new = SampleTime::new(1.0 / hz).map_err(|_| {
            self.error(
                step,
                format!("{hz} Hz"),
                "a positive finite number of samples per second",
            )
        })?;
        if new.matches(old) {
            return Ok(());
        }
        let factor = new.s() / old.s();
        let (length, last) = (self.len(), self.len() as f64 - 1.0);
        if factor < 1.0 / MAX_RATE_RATIO {
            return Err(self.error(
                step,
                format!("{} samples from one sample", format_decimal(1.0 / factor)),
                format!("at most {MAX_RATE_RATIO}"),
            ));
        }
        let too_long = |parts: &Self| {
            parts.error(
                step,
                format!(
                    "{length} samples, but the filter extends {} samples to each side",
                    Kernel::for_resampling((1.0 / factor).min(1.0), usize::MAX)
                        .map_or_else(|| "too many".to_owned(), |kernel| kernel.samples_per_side().to_string())
                ),
                "a longer record, or a smaller change in the rate",
            )
        };
        let kernel = if factor > 1.0 {
            Kernel::for_resampling(1.0 / factor, length).ok_or_else(|| too_long(self))?
        } else {
            Kernel::for_interpolation()
        };
        let half = kernel.samples_per_side() as f64;
        // Position of an input sample relative to the output sample of its row, in old samples.
        let lead = if self.has_input { 0.5 * (factor - 1.0) } else { 0.0 };
        // The new grid starts at the first sample of the record; only rows whose filters lie within the record, up to
        // rounding, are used.
        let first = ((half - lead.min(0.0) - 1e-10) / factor).ceil();
        let end = ((last - half - lead.max(0.0) + 1e-10) / factor).floor();
        if first > end {
            return Err(too_long(self));
        }
        let n = ((end - first) as usize).saturating_add(1);
        for (index, channel) in self.channels.iter_mut().enumerate() {
            let shift = if index == 0 { lead } else { 0.0 };
            channel.values = kernel.values(&channel.values, first * factor + shift, factor, n);
        }
        let cut_s = (first * new.s(), last * old.s() - end * new.s());
        self.start_s += cut_s.0;
        self.sample_time = new;
        let nyquist_hz = 0.5 / old.s().max(new.s());
        self.steps.push(Step::Rate {
            factor,
            from_hz: 1.0 / old.s(),
            to_hz: 1.0 / new.s(),
            pass_hz: PASS_BAND_EDGE * nyquist_hz,
            stop_hz: (factor > 1.0).then_some(nyquist_hz),
            stop_db: STOP_BAND_ATTENUATION_DB,
            taps: kernel.samples_per_side().saturating_mul(2).saturating_add(1),
            cut_s,
            input_lead_s: lead * old.s(),
        });
        Ok(())
    }
}
