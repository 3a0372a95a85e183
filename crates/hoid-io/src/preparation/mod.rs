//! Treatment of a record between the file and the estimator, and the list of the steps.
//!
//! The steps are applied in a fixed order, independent of the order in which they were requested:
//!
//! | step | module | what it does |
//! |---|---|---|
//! | units | `scaling` | units that the file does not report |
//! | scale | `scaling` | a channel times a factor, or from one unit to another |
//! | offset | `offset` | channels that were recorded late are put next to the others |
//! | rate | `rate` | every M-th sample, or a new sampling frequency, after a low-pass filter |
//! | run-in | `run_in` | the first seconds are dropped |
//! | detrend | [`Record::detrended`](hoid_model::Record::detrended) | mean or straight line out of input and output |
//!
//! [`Preparation`] in `pipeline` applies them to the channels of a record, separated by `record_parts`. The filter of
//! the two steps that need one, and the decimation, are those of [`hoid_model::resampling`]. For an offset and for a
//! new frequency, samples whose filter would reach beyond the record are cut and never extrapolated; decimation keeps
//! all samples. Each applied step is a [`Step`] with its numbers; reading adds its repairs before them.

mod offset;
mod pipeline;
mod rate;
mod record_parts;
mod run_in;
mod scaling;
mod step;

pub use offset::Offset;
pub use pipeline::Preparation;
pub use rate::NewRate;
pub use scaling::Scaling;
pub use step::Step;

#[cfg(test)]
mod tests;
