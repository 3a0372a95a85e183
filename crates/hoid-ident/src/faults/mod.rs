//! Faults of recorded data: found by stated statistics, and bridged or cut out before a fit.
//!
//! An estimator by prediction error trusts each sample: one sample of e that is off by 20 of its deviations enters the
//! criterion through the operator with a weight that no thousand good ones have. What is searched for, in this order:
//!
//! | file | fault | statistic |
//! |---|---|---|
//! | `levels` | wraps, stretches in other units, steps | changes and deviations against their quantiles |
//! | `rest` | | the value at which a stick with a dead zone rests, which is not a fault |
//! | `holds` | frozen channels, dropouts, idle stretches | lengths of runs of equal values, ranges |
//! | `spikes` | spikes | two explanations of a large innovation: fault or push |
//! | `interpolation` | | the samples that those around them make most likely, and what they explain |
//! | `direction` | input and output exchanged, the wrong sign | lags at which each answers the other |
//! | `resistant` | | a record that no single sample can carry, for a second opinion |
//! | `slow` | | a record without drifts and steps of a sensor, for a second opinion |
//! | `search`, `repairing`, `limits` | | their order, and the treatment of the record |
//! | `autoregression`, `robust` | | fits and scales that faults cannot carry |
//!
//! Each channel is judged by itself, since its own neighbours know a sample better than any other channel does; only
//! what *nothing* happens in is reported by e and u together. No model of the person is needed. What people do is not a
//! fault: their remnant comes in pulses and bursts, but through their muscles, and the statistics of the spikes
//! distinguish pushes from faults.
//!
//! [`repair`] looks at a record and does what [`FaultHandling`](hoid_model::FaultHandling) states: by default it
//! bridges faults of up to [`BRIDGED_S`], cuts the record at longer ones, and leaves segments of [`SHORTEST_S`] or
//! more, each a record. Faults of more than [`MOST_SPIKES`] of the samples of a channel are reported and not bridged:
//! then the channel is not what is assumed of it.

mod autoregression;
mod direction;
mod holds;
mod interpolation;
mod levels;
mod limits;
mod repairing;
mod resistant;
mod rest;
mod robust;
mod search;
mod slow;
mod spikes;
#[cfg(test)]
mod test_signals;
#[cfg(test)]
mod tests;

pub use limits::{BRIDGED_S, MOST_SPIKES, SHORTEST_S};
pub use repairing::{RepairedRecord, SLOWEST_S, repair};
pub use resistant::{held, resistant};
pub use rest::Rest;
pub use slow::{PERIOD_S, without_slow};
