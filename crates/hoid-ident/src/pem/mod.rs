//! The prediction error method.
//!
//! | module | what it holds |
//! |---|---|
//! | `criterion` | the criterion of the general model and its gradients |
//! | `initial_states` | what a record does not say about its past, eliminated exactly |
//! | `stationary_noise` | the noise before the record, when it was stationary |
//! | `constraints` | bounds and priors |
//! | `fit_settings` | what a fit needs to know beside the records |
//! | `prediction_focus`, `simulation_focus` | the fit by the prediction error, and of models that are to simulate |
//! | `arx` | structures that are linear in theta |
//! | `multistart`, `fit_problem` | the searches from all starts, and the fit at the lowest minimum |
//! | `linearisation_client` | what one search and the searches of many records have in common |
//! | `batched` | the fits of many records at a time |
//! | `loss`, `robust` | a loss that outliers cannot dominate, and its reweighted searches |

pub mod arx;
pub mod batched;
pub mod constraints;
pub mod criterion;
pub mod fit_problem;
pub mod fit_settings;
pub mod initial_states;
pub mod linearisation_client;
pub mod loss;
pub mod multistart;
pub mod prediction_focus;
pub mod robust;
pub mod simulation_focus;
pub mod stationary_noise;
