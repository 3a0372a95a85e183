//! Instrumental variables.
//!
//! The equation `y = Phi theta + r` of a model that is linear in theta (A or F of the denominator, and B) gives a
//! biased least squares estimate if r is correlated with the regressors, as past outputs always are and, in a closed
//! loop, inputs too. With instruments Z that follow the regressors but not the noise,
//!
//! `Z' Phi theta = Z' y` (L. Ljung, *System Identification*, 1999, eq. 7.118)
//!
//! is consistent for any noise. The methods differ in their instruments and in the filter of the equation:
//!
//! | method | model | filter |
//! |---|---|---|
//! | [`IvMethod::Iv4`] | `A u = B q^-nk e + v` | AR model of v |
//! | [`IvMethod::Sriv`] | `u = (B/F) q^-nk e + eps` | 1/F, repeated |
//! | [`IvMethod::RivBj`] | `u = (B/F) q^-nk e + (C/D) eps` | D/(C F), repeated |
//!
//! and instruments are computed from an input without noise: e itself in an open loop, and the part of e that follows
//! an external signal such as the forcing function f_t in a closed loop ([`Instruments`]).
//!
//! **Pre-history.** Rows of the filtered equation are used from the first sample at which all of `D (F u - B q^-nk e)`
//! is inside the record. The remaining unknown, the free response of 1/(C F), is projected out of every column, record
//! by record. Signals that are simulated for the instruments get an artificial past (the record reflected at its first
//! sample, faded in); it has no effect on consistency, only on how well the instruments follow the regressors: a jump
//! at the start, amplified by D, would outweigh the rest. The rows of several records are stacked, with a common theta.
//!
//! | module | contents |
//! |---|---|
//! | `estimator` | options, and the fit |
//! | `methods` | the methods, one file each, and their list |
//! | `instruments`, `external_signal` | the instruments |
//! | `refined` | the iteration of the refined methods |
//! | `last_iterate` | the last iterate |
//! | `own_poles` | its nonlinear form, used if it does not converge |
//! | `refined_system` | that iteration as a start of the prediction error method |
//! | `noise_free` | noise-free signals for other estimators |
//! | `simulation_error` | the part of the output that a system does not explain |
//! | `algorithm` | the interface between a method and the estimator |
//! | `equation` | the filtered equation, its instruments and its solution |
//! | `columns` | columns over the rows of all records |
//! | `covariance` | the covariance of an estimate, for a residual of any colour |

mod algorithm;
mod columns;
mod covariance;
pub(crate) mod equation;
mod estimator;
mod external_signal;
mod instruments;
mod last_iterate;
mod methods;
mod noise_free;
mod own_poles;
mod refined;
mod refined_system;
mod simulation_error;

pub use estimator::InstrumentalVariable;
pub use instruments::{FORCING_CHANNEL, Instruments};
pub use methods::IvMethod;
pub(crate) use noise_free::{NoiseFreeInput, noise_free_inputs, simulated_output};
pub(crate) use refined_system::refined_system;
