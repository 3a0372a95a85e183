//! Findings for and against a result.
//!
//! Each rule reports one kind of finding ([`hoid_model::Finding`]); the [`hoid_model::Verdict`] follows from the
//! findings. The limits are defined where they are used.
//!
//! | kind | observation |
//! |---|---|
//! | `not-converged`, `border` | termination of the search |
//! | `delay-at-bound`, `parameter-at-bound` | the delay is at an end of its range; another parameter is at a bound |
//! | `unstable` | the model from e to u is unstable |
//! | `gain`, `undetermined-parameter` | a gain or another parameter is within two standard errors of zero |
//! | `not-convertible` | the coefficients do not correspond to any operator |
//! | `neuromuscular-lag` | the two poles do not describe a neuromuscular system |
//! | `not-constant` | parameters change within a record or from one record to the next |
//! | `residuals-not-white`, `structure`, `leverage` | properties of the residuals |
//! | `no-response` | no response beyond chance |
//! | `other-input`, `inputs-together` | inputs other than the error |
//! | `operator` | the operator of polynomials differs from the operator estimated directly |
//! | `machine-output` | u is the output of the machine instead of the control |
//! | `controlled-element` | the recorded loop does not have the given controlled element |
//! | `exact-fit`, `no-change`, `change-point` | information; the result remains valid |
//!
//! | file | contents |
//! |---|---|
//! | `residuals` | deviation of residuals from white noise; also used for the operator family |
//! | `constancy` | test for parameters that change; also used for the operator family |
//! | `residual_response` | test for a response that the model does not contain |
//! | `loop_response` | test of whether e responds to u, as in a closed loop |
//! | `no_response` | test of whether u responds to e at all |
//! | `operator` | findings about the gains, poles and delay of an operator |
//! | `operator_step` | evidence against an operator in a stretch of data |
//! | `second_opinion` | second fits without outlying samples, without slow components, or with another estimator |
//! | `other_inputs` | test of whether u responds to a recorded target in addition to e |
//! | `machine_output` | test of whether u is the output of the machine |
//! | `recorded_element` | test of whether the recorded loop has the given controlled element |
//! | `whitened` | least squares with autoregressive noise, used by several tests |
//! | `fit`, `grey_box`, `sigmoid` | the verdict on each kind of fit |

pub(crate) mod constancy;
mod fit;
mod grey_box;
mod loop_response;
mod machine_output;
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

pub use constancy::{RUN_TO_RUN_DEVIATION, ResponseBasis, ResponseChange, TimeCourse, response_changes};
pub use loop_response::{LoopResponse, loop_response};
pub use machine_output::machine_output_finding;
pub use no_response::{Response, response_to_error};
pub use operator::{gain_findings, has_negative_lead, is_undetermined, neuromuscular_finding, pole_findings};
pub use operator_step::{OperatorStep, operator_step};
pub use recorded_element::{RecordedElement, recorded_element};
pub use residual_response::{ResidualResponse, residual_response};
