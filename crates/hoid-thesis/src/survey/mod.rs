//! All methods of the survey on the same runs.
//!
//! Part II of the thesis describes the methods by which others have identified time-varying operators (section 2.4). A
//! survey applies all of them to the same simulated runs: the recursive methods, as estimators of a study, and the
//! [`comparators`](crate::comparators), tables in a separate file:
//!
//! ```toml
//! [[comparators]]
//! name = "wavelets"         # in the table
//! method = "wavelet"
//! radians = 6
//! ```
//!
//! All methods give the response `H(j omega, t)`, by which they are compared ([`measure`]); parameters are compared
//! only for methods that have them.
//!
//! | module | contents |
//! |---|---|
//! | `plan` | [`SurveyPlan`] |
//! | [`measure`] | errors of a method in one run |
//! | `run` | [`survey()`]: runs and methods |
//! | `table` | the tables of `research/notes/survey-methods.md` |

pub mod measure;
mod plan;
mod run;
mod table;

pub use plan::SurveyPlan;
pub use run::{MethodErrors, survey};
pub use table::survey_tables;

/// The comparators of `research/notes/survey-methods.md`; its study is the named plan
/// [`SURVEY`](crate::plans::SURVEY).
pub const COMPARATORS: &str = include_str!("../../plans/survey-comparators.toml");
