//! Fits of one model to each of many records, side by side.
//!
//! A search is a chain of passes over its record, each a chain of filters that wait for their own
//! last value ([`crate::criterion`]). Searches of different records wait for nothing of each other:
//! each has a lane of the registers, and when it has ended the next record takes its place; the
//! search on the averaged records ([`crate::initial_guess::continuation`]) goes first in the same
//! way. What needs more than the criterion (the border of stability, starts where the averages do
//! not suffice, dependent responses to the initial states) is done alone.
//!
//! | module | contents |
//! |---|---|
//! | `fits` | the fit of each record |
//! | `lanes` | which record is in which lane, and where it is to be linearised |
//! | `pass` | the criterion and its derivatives for the records in all lanes |
//! | `initial_state_responses` | the responses to the initial states, and the states of least squares |
//! | `columns` | products of eps and the columns of psi |
//! | `filters` | the filters of the signals |
//! | `signal_buffers`, `normal_equations`, `rows` | the numbers of all lanes |
//! | `lane_products` | products and sums of two signals |

mod columns;
mod filters;
mod fits;
mod initial_state_responses;
mod lane_products;
mod lanes;
mod normal_equations;
mod pass;
mod rows;
mod signal_buffers;

pub(crate) use fits::fit_each;

#[cfg(test)]
mod tests;
