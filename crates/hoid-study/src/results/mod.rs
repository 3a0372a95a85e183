//! Reading of a finished study: rows of its summary, values of its replications, and traces.
//!
//! The properties of a cell and an estimator come from the plan in the directory, the numbers from the tables. Rows are
//! selected by these properties:
//!
//! ```no_run
//! use hoid_study::{Query, Results};
//!
//! let results = Results::read("out".as_ref())?;
//! let query = Query::of("bias_b0").condition("C1").remnant_order(2).noise_level(0.1).name("BJ").nd(1).nk(29);
//! let median = results.find_one(&query).map(|row| row.statistics.median);
//! let each = results.values(&query);
//! # Ok::<(), hoid_study::StudyError>(())
//! ```

mod read;
mod rows;
mod study_results;
#[cfg(any(test, feature = "synthetic"))]
mod synthetic;
#[cfg(test)]
mod tests;

pub use rows::{SummaryRow, TraceStatistics, TraceSummary};
pub use study_results::Results;
