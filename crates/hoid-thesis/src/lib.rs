//! Reproduction of the thesis: its studies, tables, figures and claims (A. Ortiz Moya,
//! *Time-Varying Human-Operator Identification with Box-Jenkins Models*, MSc thesis, Delft
//! University of Technology, 2023).
//!
//! The text compares ARX and Box-Jenkins models of the human operator by simulation, in batch fits and recursive
//! estimates. [`reproduce`] runs the studies of the thesis, draws its tables and figures, tests its claims, and writes
//! a page with the results:
//!
//! ```no_run
//! use hoid_thesis::{Reproduction, ReproductionEvent, reproduce};
//!
//! let quick = Reproduction {
//!     only: vec!["fig-5".to_owned(), "claims".to_owned()],
//!     replications: 10,
//!     ..Reproduction::default()
//! };
//! let notify = |event: ReproductionEvent<'_>| {
//!     if let ReproductionEvent::Study(study) = event {
//!         println!("{}: {} estimates", study.name, study.estimates);
//!     }
//! };
//! if let Some(summary) = reproduce(&quick, "reproduction".as_ref(), &notify, &|| true)? {
//!     println!("{}", summary.index.display());
//! }
//! # Ok::<(), hoid_thesis::ThesisError>(())
//! ```
//!
//! | module | contents |
//! |---|---|
//! | [`plans`] | the studies of the thesis as named plans |
//! | [`reproduction`] | tables, figures and claims in a directory, from the results of the studies |
//! | [`comparators`] | the other methods of the survey, for comparison |
//! | [`survey`] | all methods of the survey on the same runs |
//! | [`experiment`] | the experiment of the thesis with virtual or recorded people |
//! | [`claims`] | statements of the thesis, tested with the results of the named plans |
//!
//! The crates for studies and reports do not depend on this crate.

pub mod claims;
pub mod comparators;
mod error;
pub mod experiment;
pub mod plans;
pub mod reproduction;
pub mod survey;

pub use error::ThesisError;
pub use reproduction::{CLAIMS_NAME, Reproduction, ReproductionEvent, ReproductionSummary, reproduce};
