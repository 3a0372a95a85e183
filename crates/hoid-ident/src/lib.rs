//! Batch estimators: from a [`Record`](hoid_model::Record) to a [`Fit`].
//!
//! | module | what it holds |
//! |---|---|
//! | [`Estimator`] | structure, orders and options; `fit` |
//! | `prediction_error` | the criterion of the general model and its gradients |
//! | `initial_states` | what a record does not say about its past, eliminated exactly |
//! | `search` | damped Gauss-Newton |
//! | `starts` | where the search begins when nobody says |
//! | `arx`, `least_squares` | linear regression by QR with column pivoting |
//! | [`order_search`] | ranges of orders and delay, criteria, the chosen model |
//! | [`validation`] | VAF, NRMSE, residual tests |
//! | [`Fit`] | model, covariance, how it ended; prediction, simulation, frequency response |

mod arx;
mod error;
mod estimator;
mod fit;
mod initial_states;
mod least_squares;
pub mod order_search;
mod prediction_error;
mod search;
mod starts;
pub mod validation;

pub use error::IdentError;
pub use estimator::Estimator;
pub use fit::{Fit, ResponsePoint, Series};
pub use order_search::{Candidate, Choice, OrderRanges, choose_orders};
pub use prediction_error::InitialState;
pub use search::{Reason, SearchMethod, SearchOptions, Termination};
