//! The arithmetic of a sample, with fixed capacity: parts that only these methods use, in the form of
//! [`hoid_core`].
//!
//! | module | contents |
//! |---|---|
//! | [`physical`] | the prediction-error method in physical parameters |
//! | [`multiple_model`] | a bank of hypotheses about when the operator changed |

pub mod multiple_model;
pub mod physical;
