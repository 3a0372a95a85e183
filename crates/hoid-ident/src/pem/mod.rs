//! The fit by the prediction error method: what it minimises is [`crate::criterion`], how is
//! [`crate::optimize`].
//!
//! | module | contents |
//! |---|---|
//! | `constraints` | bounds and priors |
//! | `fit_settings` | what a fit needs to know next to the records |
//! | `prediction_focus`, `simulation_focus` | the fit by the prediction error, and of models that are to simulate |
//! | `arx` | structures that are linear in theta |
//! | `fit_problem` | the searches from all starts of one fit, and the fit at the lowest minimum |
//! | `lower_minimum` | a lower minimum than theirs, on short records and for larger models |
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
