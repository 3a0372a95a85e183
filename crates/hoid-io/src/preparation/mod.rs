//! Preparation of a record between its file and the estimator, and the list of applied steps.
//!
//! The steps are applied in a fixed order, independent of the order in which they were requested:
//!
//! | step | module | effect |
//! |---|---|---|
//! | units | `scaling` | sets units that the file does not give |
//! | scale | `scaling` | multiplies a channel by a factor, or converts its unit |
//! | offset | `offset` | aligns channels that were recorded late |
//! | rate | `rate` | low-pass filters, then keeps every M-th sample or resamples to a new frequency |
//! | run-in | `run_in` | drops the run-in at the start |
//! | detrend | [`Record::detrended`](hoid_model::Record::detrended) | removes the mean or a straight line from the input and the output |
//!
//! [`Preparation`] in `pipeline` applies the steps to the channels of a record, which `record_parts` separates. The
//! interpolation filter of the steps offset and rate, and the decimation, are in [`hoid_model::resampling`]. For an
//! offset or a new frequency, samples whose filter would reach beyond the record are cut, and nothing is extrapolated;
//! decimation cuts nothing at the ends. Each applied step is a [`Step`] with its numbers; the repairs made in reading
//! precede these steps in the list.

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
