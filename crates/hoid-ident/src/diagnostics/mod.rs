//! Findings for and against a result.
//!
//! Each rule is one observation with its own kind ([`hoid_model::Finding`]), and the [`hoid_model::Verdict`] follows
//! from them. The limits are defined where they are used.
//!
//! | kind | observation |
//! |---|---|
//! | `not-converged`, `border` | termination of the search |
//! | `delay-at-bound`, `parameter-at-bound` | the delay is at the end of its range, another parameter at a bound |
//! | `unstable` | the model from e to u is unstable |
//! | `gain`, `undetermined-parameter` | standard errors as large as the values |
//! | `not-convertible` | coefficients that do not correspond to any operator |
//! | `neuromuscular-lag` | the two poles do not describe a neuromuscular system |
//! | `not-constant` | parameters that change within the records, or from one to the next |
//! | `residuals-not-white`, `structure`, `leverage` | properties of the residuals |
//! | `no-response` | no response beyond chance |
//! | `other-input`, `inputs-together` | inputs in addition to the error |
//! | `controlled-element` | the given controlled element, and that of the recorded loop |
//! | `exact-fit`, `no-change`, `change-point` | information; the result remains valid |
//!
//! | file | contents |
//! |---|---|
//! | `residuals` | deviation of residuals from white noise; also for the family |
//! | `constancy` | whether parameters change; also for the family |
//! | `residual_response` | test for a response that a model does not have |
//! | `loop_response` | test of whether e responds to u, as it does in a loop |
//! | `no_response` | test of whether u responds to e at all |
//! | `operator` | gains, poles and delay of an operator |
//! | `operator_step` | evidence of a stretch of data against an operator |
//! | `second_opinion` | fits to records in which no single sample can dominate |
//! | `other_inputs` | test of whether u responds to a recorded target in addition to e |
//! | `recorded_element` | test of whether the recorded loop has the given controlled element |
//! | `whitened` | least squares after an autoregression, for the tests that need it |
//! | `fit`, `grey_box`, `sigmoid` | the verdict of each kind of fit |

pub(crate) mod constancy;
mod fit;
mod grey_box;
mod loop_response;
mod no_response;
mod operator;
mod operator_step;
pub mod other_inputs;
mod recorded_element;
mod residual_response;
pub(crate) mod residuals;
pub mod second_opinion;
mod sigmoid;
mod whitened;

pub use constancy::{Course, Unsteady, unsteady};
pub use loop_response::{LoopResponse, answer};
pub use no_response::{Response, response};
pub use operator::{gain_findings, is_open, leads_backwards, neuromuscular_finding, pole_findings};
pub use operator_step::{OperatorStep, operator_step};
pub use recorded_element::{RecordedElement, recorded_element};
pub use residual_response::{ResidualResponse, residual_response};
