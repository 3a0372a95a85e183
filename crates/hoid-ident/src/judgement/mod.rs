//! What speaks for and against a result.
//!
//! Each rule is one observation with its own kind ([`hoid_model::Finding`]), and the
//! [`hoid_model::Verdict`] follows from them. The limits stand where they are used.
//!
//! | kind | what was observed |
//! |---|---|
//! | `not-converged`, `border` | how the search ended |
//! | `delay-at-bound`, `parameter-at-bound` | the delay lies at the end of its range, another at a bound |
//! | `unstable` | the model from e to u is unstable |
//! | `gain`, `undetermined-parameter` | standard errors as large as the values |
//! | `not-convertible` | coefficients that stand for no operator |
//! | `neuromuscular-lag` | the two poles describe no neuromuscular system |
//! | `residuals-not-white`, `structure`, `leverage` | sizes in the residuals |
//! | `exact-fit`, `no-change`, `change-point` | worth knowing; the result stands |
//!
//! | file | what it holds |
//! |---|---|
//! | `residuals` | how far residuals are from white; also for the family |
//! | `operator` | gains, poles and delay of an operator |
//! | `fit`, `grey_box`, `sigmoid` | the verdict of each kind of fit |

mod fit;
mod grey_box;
mod operator;
pub(crate) mod residuals;
mod sigmoid;

pub use operator::{gain_findings, is_open, neuromuscular_finding, pole_findings};
