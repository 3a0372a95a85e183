//! Fits of one model to each of many records, in parallel lanes.
//!
//! A search is a chain of passes over its record, each a chain of recursive filters ([`crate::criterion`]). Searches of
//! different records are independent: each has a lane of the registers, and when it has ended the next record uses the
//! lane; the search on the averaged records ([`crate::initial_guess::continuation`]) is done first in the same way.
//! Cases that need more than the criterion (the border of stability, starts if the averages do not suffice, dependent
//! responses to the initial states) are computed one by one.
//!
//! | module | contents |
//! |---|---|
//! | `fits` | the fit of each record |
//! | `lanes` | assignment of records to lanes, and the points of linearisation |
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
