//! Batch estimators: from a [`Record`](hoid_model::Record) to a [`Fit`].
//!
//! | module | what it holds |
//! |---|---|
//! | [`Estimator`] | structure, orders and options; `fit` |
//! | `prediction_error` | the criterion of the general model and its gradients |
//! | `initial_states` | what a record does not say about its past, eliminated exactly |
//! | `stationary_past` | the noise before the record, when it was stationary |
//! | `search`, `stable_coordinates` | damped Gauss-Newton, also along the border of stability |
//! | `searches`, `quest`, `side_by_side` | the searches from all starts, the fit at the lowest minimum; those of many records at a time |
//! | `objective`, `robust`, `simulation_focus` | bounds and priors, a loss against outliers, models that are to simulate |
//! | `starts`, `continuation`, `shared_poles` | where the search begins when nobody says |
//! | `arx`, `least_squares` | linear regression by QR with column pivoting |
//! | [`grey_box`] | the fit in physical parameters: operator with a real delay, remnant filter |
//! | [`instrumental`] | instrumental variables, in open and closed loop |
//! | [`SigmoidChange`] | gains that follow a sigmoid, with the time and the rate of the change |
//! | [`describing`] | describing function, coherence, remnant spectrum and margins by Fourier coefficients |
//! | [`order_search`] | ranges of orders and delay, criteria, the chosen model |
//! | [`validation`] | VAF, NRMSE, residual tests |
//! | `derived` | poles, zeros, crossover and margins with standard errors |
//! | [`Fit`] | model, covariance, how it ended; prediction, simulation, frequency response |

mod assembled_fit;
mod constraint;
mod criterion;
mod derived;
mod error;
mod estimator;
mod fit;
pub mod frequency;
pub mod grey_box;
mod informative_data;
mod initial_guess;
pub mod iv;
pub mod linalg;
mod multistart;
mod noise_model;
mod optimize;
pub mod order_selection;
mod pem;
pub mod settings;
mod sigmoid;
pub mod validation;

pub use constraint::{Constraint, Prior};
pub use criterion::{InitialState, first_residual};
pub use derived::{MarginEstimates, Root};
pub use error::IdentError;
pub use estimator::{Estimator, Focus};
pub use fit::{Fit, ResponsePoint, Series};
pub use grey_box::{GreyBox, GreyBoxFit};
pub use iv::{InstrumentalVariable, Instruments, IvMethod};
pub use optimize::{Reason, SearchMethod, SearchOptions, Termination};
pub use order_selection::{Candidate, Choice, OrderRanges, choose_orders};
pub use pem::loss::Loss;
pub use sigmoid::{ChangeParameter, Comparison, GainsAt, NoiseLevel, Remark, SIGMOID_NAMES, SigmoidChange, SigmoidFit};
