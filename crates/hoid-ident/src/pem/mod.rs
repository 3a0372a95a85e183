//! The fit by the prediction error method: it minimises [`crate::criterion`] by [`crate::optimize`].
//!
//! | module | contents |
//! |---|---|
//! | `constraints` | bounds and priors |
//! | `fit_settings` | the settings of a fit in addition to the records |
//! | `prediction_focus`, `simulation_focus` | the fit by the prediction error, and of models for simulation |
//! | `arx` | structures that are linear in theta |
//! | `fit_problem` | the searches from all starts of one fit, and the fit at the lowest minimum |
//! | `lower_minimum` | a lower minimum, for short records and larger models |
//! | `batched` | the fits of many records at a time |
//! | `loss`, `robust` | a loss that outliers cannot dominate, and its reweighted searches |

pub mod arx;
pub mod batched;
pub mod constraints;
pub mod fit_problem;
pub mod fit_settings;
pub mod loss;
pub mod lower_minimum;
pub mod prediction_focus;
pub mod robust;
pub mod simulation_focus;
