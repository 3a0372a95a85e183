//! Faults of recorded data, which are detected by documented statistics and bridged or cut out before a fit.
//!
//! A prediction error estimator uses every sample: one sample of e that is off by 20 standard deviations enters the
//! criterion through the operator with more weight than a thousand good samples. The files of this folder detect and
//! repair faults:
//!
//! | file | fault | statistic |
//! |---|---|---|
//! | `levels` | wraps, stretches in other units, steps | changes and deviations, relative to their quantiles |
//! | `stick_rest` | | value at which a stick with a dead zone rests, which is not a fault |
//! | `constant_spans` | frozen channels, dropouts, idle stretches | lengths of runs of equal values, ranges |
//! | `spikes` | spikes | comparison of two explanations of a large innovation: fault or push |
//! | `interpolation` | | most likely values of samples given their neighbours, and the gain in likelihood |
//! | `direction` | input and output exchanged, wrong sign | lags at which one channel responds to the other |
//! | `limited_record` | | record in which no single sample can dominate a fit, for a second opinion |
//! | `slow_components` | | record without drifts and steps of a sensor, for a second opinion |
//! | `search`, `repairing`, `limits` | | order of the searches, and repair of the record |
//! | `autoregression`, `robust` | | prediction and scales that are robust to faults |
//!
//! Each channel is examined separately, since its own neighbours predict a sample better than any other channel. Only
//! *idle* stretches, holds of quantised channels and the direction are assessed from e and u together. No model of the
//! person is needed. Normal control activity is not a fault: the remnant of people has pulses and bursts, but these are
//! filtered by the muscles, and the statistics for spikes distinguish such pushes from faults.
//!
//! [`repair`] inspects a record and follows [`FaultHandling`](hoid_model::FaultHandling). By default it bridges faults
//! of up to [`MAX_BRIDGED_S`], cuts the record at longer faults, and returns each segment of [`MIN_SEGMENT_S`] or more
//! as a record. If more than [`MAX_SPIKE_SHARE`] of the samples of a channel are spikes, they are reported and not
//! bridged, because so many spikes contradict the assumptions about the channel.

mod autoregression;
mod constant_spans;
mod direction;
mod interpolation;
mod levels;
mod limited_record;
mod limits;
mod repairing;
mod robust;
mod search;
mod slow_components;
mod spikes;
mod stick_rest;
#[cfg(test)]
mod test_signals;
#[cfg(test)]
mod tests;

pub use limited_record::{limited_record, limited_records};
pub use limits::{MAX_BRIDGED_S, MAX_SPIKE_SHARE, MIN_SEGMENT_S};
pub use repairing::{MAX_SAMPLE_TIME_S, RepairedRecord, repair};
pub use slow_components::{SLOW_PERIOD_S, without_slow_components};
pub use stick_rest::StickRest;
