//! Monte Carlo studies of estimators, and groups of recorded runs.
//!
//! The bias and spread of an estimate, and the coverage of its standard errors, cannot be determined from a single
//! record. A study therefore simulates many records. A [`Plan`] contains scenarios (operator, task, remnant) and
//! estimators; each list in it is an axis of a grid. [`run`] applies the estimators to every cell of the grid in many
//! replications, each with its own random stream. [`Results`] reads the tables, and a [`Query`] selects rows:
//!
//! ```
//! use hoid_study::{Plan, Query, Results, RunOptions, run};
//!
//! let plan = Plan::parse(
//!     r#"
//! name = "lead"
//! seed = 1
//! replications = 8
//!
//! [[scenarios]]
//! condition = "C1"
//! measurement_s = 20.48
//! remnant = { order = 1, noise_level = [0.0, 0.1] }
//!
//! [[estimators]]
//! name = "ARX"
//! method = "fit"
//! structure = "arx"
//! orders.nk = 29
//! "#,
//!     "lead.toml",
//! )?;
//! let directory = tempfile::tempdir().expect("a temporary directory");
//! let outcome = run(&plan, directory.path(), &RunOptions::default(), &|_| (), &|| true)?;
//! assert!(outcome.finished);
//!
//! let results = Results::read(directory.path())?;
//! let bias = |level| {
//!     let query = Query::of("bias_b0").name("ARX").noise_level(level);
//!     results.find_one(&query).map_or(f64::NAN, |row| row.statistics.median.abs())
//! };
//! // Without remnant ARX is exact; with a remnant that is not white its estimates are biased.
//! assert!(bias(0.0) < 1e-3 && bias(0.1) > 1.0, "{} {}", bias(0.0), bias(0.1));
//! # Ok::<(), hoid_study::StudyError>(())
//! ```
//!
//! Replications are run and stored in blocks. A stopped study can be continued (`resume`), and the shards of a study
//! can run on several machines and are joined by [`merge`]. Neither affects the bytes of the tables.
//!
//! | module | contents |
//! |---|---|
//! | [`plan`] | [`Plan`]: scenarios and estimators as grids, read from TOML and checked |
//! | [`plans`] | plans included with the program |
//! | `run`, `merge`, `join` | [`run`]: distribution of the blocks over threads, parts on disk; [`merge`]: merging of shards; `join`: joining of the parts into tables |
//! | `directory`, `run_record`, `shard` | layout of the directory of a study, `study.json`, [`Shard`] |
//! | `seal` | checksums of the blocks, and detection of damaged blocks |
//! | `block`, `batch_fits`, `prepared_record` | application of the estimators of a cell to its replications |
//! | `estimate_rows`, `error_measures` | table rows of an estimate, and its errors relative to the true values |
//! | `columns`, `truth`, `true_value` | columns of the tables fits, traces and cells; true value of each column |
//! | `summary`, [`statistics`] | statistics over the replications of a cell, with Monte Carlo errors |
//! | `results`, `query`, `tables` | [`Results`]: reading of a finished study; [`Query`]: selection of its rows |
//! | [`group`] | recorded runs by subject and condition |

mod batch_fits;
mod block;
mod columns;
mod directory;
mod error;
mod error_measures;
mod estimate_rows;
pub mod group;
mod join;
mod merge;
pub mod plan;
pub mod plans;
mod prepared_record;
mod query;
mod results;
mod run;
mod run_record;
mod seal;
mod shard;
pub mod statistics;
mod summary;
mod tables;
mod true_value;
mod truth;

pub use columns::OPERATOR_PARAMETERS;
pub use error::StudyError;
pub use merge::merge;
pub use plan::{Plan, plan_schema, plan_schema_of};
pub use plans::{NamedPlan, PLANS};
pub use query::Query;
pub use results::{Results, SummaryRow, TraceStatistics, TraceSummary};
pub use run::{Outcome, Progress, RunOptions, run};
pub use shard::Shard;
pub use statistics::Statistics;
pub use true_value::true_value;
pub use truth::TrueState;
