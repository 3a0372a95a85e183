//! Treatment of a record between the file and the estimator, and the account of it.
//!
//! The steps are taken in one order, whatever the order in which they were requested:
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
//! [`Preparation`] in `pipeline` takes them, on the channels of a record that `record_parts` has taken apart. The
//! filter of the two steps that need one, and decimation itself, are those of [`hoid_model::resampling`]. For an offset
//! and of a new frequency, samples whose filter would reach beyond the record are cut, never invented; decimation keeps
//! them all. Each step that was taken is a [`Step`], with its numbers; reading adds those of its repairs before.

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
