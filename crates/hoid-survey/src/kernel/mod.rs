//! Computations for one sample with fixed capacity, in the same form as in [`hoid_core`]; only the methods of this
//! crate use them.
//!
//! | module | contents |
//! |---|---|
//! | [`physical`] | the prediction-error method in physical parameters |
//! | [`multiple_model`] | a bank of hypotheses about the time of a change in the operator |

pub mod multiple_model;
pub mod physical;
