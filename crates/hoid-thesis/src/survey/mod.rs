//! All methods of the survey on the same runs.
//!
//! Part II of the thesis describes the methods by which others have identified operators who change (section 2.4). A
//! survey follows the same simulated runs with all of them: the recursive methods, as estimators of a study that
//! anything can run, and the [`comparators`](crate::comparators), tables in a file of their own:
//!
//! ```toml
//! [[comparators]]
//! name = "wavelets"         # in the table
//! method = "wavelet"
//! radians = 6
//! ```
//!
//! All methods give the response `H(j omega, t)`, so that they are compared by it ([`measure`]); parameters are
//! compared only for methods that have them.
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
