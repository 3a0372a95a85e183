//! Fits by the prediction error method: [`crate::criterion`] is minimised by [`crate::optimize`].
//!
//! | module | contents |
//! |---|---|
//! | `constraints` | bounds and priors |
//! | `fit_settings` | all settings of a fit except the records |
//! | `prediction_focus`, `simulation_focus` | fits for prediction, and fits of models for simulation |
//! | `arx` | structures that are linear in theta |
//! | `fit_problem` | searches from all starts of one fit, and the fit at the lowest minimum |
//! | `lower_minimum` | search for a lower minimum, for short records and larger models |
//! | `batched` | fits of many records at the same time |
//! | `loss`, `robust` | loss that outliers cannot dominate, and its minimisation by reweighting |

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
