//! Monte Carlo studies: plan, shards, run, resume, merge, summaries.
//!
//! | module | what it holds |
//! |---|---|
//! | [`plan`] | [`Plan`]: scenarios and estimators as grids, read from TOML and checked |
//! | `block`, `prepared`, `merit` | what is done with the replications of one cell, and the figures of merit of a row |
//! | `columns`, `truth` | the tables of a study: fits, traces, cells |
//! | [`plans`] | plans that come with the program |
//! | `run` | [`run`], [`merge`]: blocks over threads, parts on disk |
//! | `summary`, [`statistics`] | what the replications of a cell say together |
//! | `results`, `query`, `tables` | [`Results`]: a finished study read back, [`Query`]: which rows of it |
//! | [`group`] | recorded runs by subject and condition |
//! | `manifest` | what stands beside the results, [`Shard`] |
//!
//! ```no_run
//! use hoid_study::{Plan, RunOptions, run};
//!
//! let plan = Plan::read("plan.toml".as_ref())?;
//! let outcome = run(&plan, "out".as_ref(), &RunOptions::default(), &|_| (), &|| true)?;
//! assert!(outcome.finished);
//! # Ok::<(), hoid_study::StudyError>(())
//! ```

mod batch_fits;
mod block;
mod columns;
mod error;
mod error_measures;
mod estimate_rows;
pub mod group;
mod manifest;
pub mod plan;
pub mod plans;
mod prepared;
mod query;
mod results;
mod run;
pub mod statistics;
mod summary;
mod tables;
mod true_value;
mod truth;

pub use columns::OPERATOR;
pub use error::StudyError;
pub use manifest::Shard;
pub use plan::{Plan, plan_schema};
pub use plans::{NamedPlan, PLANS};
pub use query::Query;
pub use results::{Bands, Results, SummaryRow, TraceSummary};
pub use run::{Outcome, Progress, RunOptions, merge, run};
pub use statistics::Statistics;
pub use true_value::true_value;
pub use truth::TrueState;
