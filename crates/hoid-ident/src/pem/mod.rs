//! The prediction error method.
//!
//! | module | what it holds |
//! |---|---|
//! | `criterion`, `spans` | the criterion of the general model and its gradients; long records span by span |
//! | `initial_states` | what a record does not say about its past, eliminated exactly |
//! | `stationary_noise` | the noise before the record, when it was stationary |
//! | `constraints` | bounds and priors |
//! | `arx` | structures that are linear in theta |
//! | `fit_problem` | the searches from all starts of one fit, and the fit at the lowest minimum |
//! | `batched` | the fits of many records at a time |
//! | `robust`, `simulation_focus` | a loss against outliers, models that are to simulate |

pub mod arx;
pub mod batched;
pub mod constraints;
pub mod criterion;
pub mod fit_problem;
pub mod initial_states;
pub mod linearisation_client;
pub mod robust;
pub mod simulation_focus;
pub mod stationary_noise;
