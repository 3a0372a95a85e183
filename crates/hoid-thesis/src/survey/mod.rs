//! All methods of the survey, applied to the same runs.
//!
//! Part II of the thesis describes published methods for the identification of time-varying operators (section 2.4). A
//! survey applies all of these methods to the same simulated runs. The recursive methods are estimators of a study; the
//! [`comparators`](crate::comparators) are tables in a separate file:
//!
//! ```toml
//! [[comparators]]
//! name = "wavelets"         # in the table
//! method = "wavelet"
//! radians = 6
//! ```
//!
//! All methods give the response `H(j omega, t)`, which is used to compare them ([`measure`]); parameters are compared
//! only for methods that estimate them.
//!
//! | module | contents |
//! |---|---|
//! | `plan` | [`SurveyPlan`]: the plan of a study and a file of comparators |
//! | [`measure`] | errors of a method in one run |
//! | `run` | [`survey()`]: applies all methods to all runs |
//! | `table` | the tables of `research/notes/survey-methods.md` |

pub mod measure;
mod plan;
mod run;
mod table;

pub use plan::SurveyPlan;
pub use run::{MethodErrors, survey};
pub use table::survey_tables;

/// File of the comparators of `research/notes/survey-methods.md`; the study of the same survey is the named plan
/// [`SURVEY`](crate::plans::SURVEY).
pub const COMPARATOR_PLAN: &str = include_str!("../../plans/survey-comparators.toml");
