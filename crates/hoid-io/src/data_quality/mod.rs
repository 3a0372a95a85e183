//! Quality of recorded data: problems of the sampling and the values, their locations and sizes; data are changed only
//! on request.
//!
//! | module | contents |
//! |---|---|
//! | `issue` | [`QualityIssue`]: a finding |
//! | `signals` | the columns that are examined |
//! | `grid` | the even grid after a time |
//! | `timing` | jitter, missing rows, a time that is constant or decreases, a clock that is off or drifts |
//! | `holds` | rows that are duplicated, and channels that all hold their values |
//! | `values` | saturation, quantisation, constants, missing values |
//! | `search` | all of these, for columns that belong together, and for the channels of a record |
//! | `in_table` | the same for the columns that a record is made of |
//!
//! An operator's channel may legitimately be smooth, quiet or constant: the rules are designed so that simulated
//! operators without faults give no finding (tested), and a finding describes the problem without interpreting it.

mod grid;
mod holds;
mod in_table;
mod issue;
mod search;
mod signals;
mod timing;
mod values;

pub(crate) use grid::Grid;
pub(crate) use in_table::{issues_of_record, issues_of_signals};
pub use issue::{QualityIssue, QualityIssueKind, RowSpan};
pub use search::quality_of_record;
pub(crate) use search::{issues_of, names_a_clock};
pub(crate) use signals::{Signal, Signals};
pub(crate) use values::{Levels, rails};

#[cfg(test)]
mod tests;
