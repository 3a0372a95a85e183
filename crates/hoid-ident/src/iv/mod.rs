//! Instrumental variable methods.
//!
//! The equation `y = Phi theta + r` of a model that is linear in theta (the poles A or F, and B) gives a biased
//! least-squares estimate if r is correlated with the regressors. Past outputs are always correlated with r; in a
//! closed loop inputs are as well. With instruments Z that follow the regressors but not the noise, the solution of
//!
//! `Z' Phi theta = Z' y` (L. Ljung, *System Identification*, 1999, eq. 7.118)
//!
//! is consistent for any noise. The methods differ in their instruments and in the filter applied to the equation:
//!
//! | method | model | filter |
//! |---|---|---|
//! | [`IvMethod::Iv4`] | `A u = B q^-nk e + v` | AR model of v |
//! | [`IvMethod::Sriv`] | `u = (B/F) q^-nk e + eps` | 1/F, iterated |
//! | [`IvMethod::RivBj`] | `u = (B/F) q^-nk e + (C/D) eps` | D/(C F), iterated |
//!
//! Instruments are computed from a noise-free input: e itself in an open loop, and in a closed loop the part of e that
//! follows an external signal, such as the forcing function f_t ([`Instruments`]).
//!
//! **Pre-history.** Rows of the filtered equation are used from the first sample at which all terms of
//! `D (F u - B q^-nk e)` are inside the record. The remaining unknown, the free response of 1/(C F), is projected out
//! of every column in each record. Signals that are simulated for the instruments get an artificial past, which is the
//! record reflected at its first sample and faded in. This past has no effect on consistency, only on how well the
//! instruments follow the regressors: a jump at the start, amplified by D, would dominate the remaining samples. The
//! rows of several records are stacked, with a common theta.
//!
//! | module | contents |
//! |---|---|
//! | `estimator` | options, and the fit |
//! | `methods` | methods, one file each, and their list |
//! | `instruments`, `external_signal` | choice of instruments, and instruments from an external signal |
//! | `refined` | iteration of the refined methods |
//! | `final_iteration` | final state of an iteration |
//! | `separate_poles` | nonlinear form of the equation, used if the iteration does not converge |
//! | `refined_system` | the iteration of RIV-BJ, as a start for the prediction error method |
//! | `noise_free` | noise-free signals for other estimators |
//! | `simulation_error` | part of the output that a system does not explain |
//! | `algorithm` | interface between a method and the estimator |
//! | `equation` | filtered equation, its instruments and its solution |
//! | `columns` | columns over the rows of all records |
//! | `covariance` | covariance of an estimate, for a residual with any spectrum |

mod algorithm;
mod columns;
mod covariance;
pub(crate) mod equation;
mod estimator;
mod external_signal;
mod final_iteration;
mod instruments;
mod methods;
mod noise_free;
mod refined;
mod refined_system;
mod separate_poles;
mod simulation_error;

pub use estimator::InstrumentalVariable;
pub use instruments::{FORCING_CHANNEL, Instruments};
pub use methods::IvMethod;
pub(crate) use noise_free::{NoiseFreeInput, noise_free_inputs, simulated_output};
pub(crate) use refined_system::refined_system;
