//! The arithmetic of a sample, in fixed room: what serves these methods alone, in the form of
//! [`hoid_core`].
//!
//! | module | contents |
//! |---|---|
//! | [`physical`] | the prediction-error method in physical parameters |
//! | [`multiple_model`] | a bank of hypotheses about when the operator changed |

pub mod multiple_model;
pub mod physical;
