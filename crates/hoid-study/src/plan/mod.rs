//! The plan of a study, in TOML: scenarios, estimators, replications.
//!
//! ```toml
//! name = "first-order-remnant"
//! title = "ARX and Box-Jenkins with a remnant of first order"
//! seed = 1
//! replications = 100
//!
//! [keep]
//! trace_every = 32              # samples; leave it out to keep no traces
//!
//! [[scenarios]]                 # the keys of a scenario file
//! name = "constant"
//! condition = ["C1", "C2"]      # a list is an axis of the grid
//! remnant = { order = 1, noise_level = [0.1, 0.2] }
//!
//! [[estimators]]                # see the module `estimator`
//! name = "ARX"
//! method = "fit"
//! structure = "arx"
//! ```
//!
//! A *cell* is one scenario of the grid. Cells are numbered in the order of the file; the first axis varies slowest.
//! The remnant of replication r in cell c is the random stream (seed, c, r), which is the same for all estimators. A
//! cell without remnant is run only once, since all its replications would be the same.

pub(crate) mod analysis;
mod document;
mod estimator;
mod estimator_table;
mod grid;
mod problem;
mod schema;
mod top_level_keys;

pub use document::{Cell, Plan};
pub use estimator::{EstimatorCell, Task};
pub use grid::Axis;
pub(crate) use grid::line_at;
pub use schema::{plan_schema, plan_schema_of};
