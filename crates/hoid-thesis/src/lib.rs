//! The reference text, reproduced: its studies, tables, figures and claims (A. Ortiz Moya, *Time-Varying Human-Operator Identification
//! with Box-Jenkins Models*, MSc thesis, Delft University of Technology, 2023).
//!
//! | module | what it holds |
//! |---|---|
//! | [`plans`] | the studies of the text as named plans |
//! | [`reproduction`] | tables, figures and claims in a directory, from the results of the studies |
//! | [`claims`] | statements of the text, tested by the results of the named plans |
//!
//! Studies and reports know nothing of this crate.

pub mod claims;
mod error;
pub mod plans;
pub mod reproduction;

pub use error::ThesisError;
pub use reproduction::{CLAIMS, Reproduction, ReproductionEvent, ReproductionSummary, reproduce};
