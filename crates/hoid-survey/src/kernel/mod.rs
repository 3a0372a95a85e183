//! The computations for one sample, with fixed capacity, that only the methods of this crate use; their form is the
//! same as in [`hoid_core`].
//!
//! | module | contents |
//! |---|---|
//! | [`physical`] | the prediction-error method in physical parameters |
//! | [`multiple_model`] | a bank of hypotheses about when the operator changed |

pub mod multiple_model;
pub mod physical;
