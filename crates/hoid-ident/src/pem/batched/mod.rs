//! Fits of one model to each of many records in parallel lanes.
//!
//! A search is a chain of passes over its record, and each pass is a chain of recursive filters ([`crate::criterion`]).
//! Searches for different records are independent: each search occupies one lane of the registers, and when it has
//! ended the next record takes over the lane. The search on the averaged records
//! ([`crate::initial_guess::continuation`]) is done first in the same way. Cases that need more than the criterion are
//! computed one by one: the border of stability, further starts if the averaged records are not sufficient, and
//! linearly dependent responses to the initial states.
//!
//! | module | contents |
//! |---|---|
//! | `fits` | fit of each record |
//! | `lanes` | assignment of records to lanes, and the points of linearisation |
//! | `pass` | criterion and its derivatives for the records in all lanes |
//! | `initial_state_responses` | responses to the initial states, and least-squares estimates of the states |
//! | `columns` | products of eps and the columns of psi |
//! | `filters` | filters for the signals |
//! | `signal_buffers`, `normal_equations`, `rows` | memory for the values of all lanes |
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
