//! The quality of recorded data: the problems of the sampling and the values, where and how much; nothing is repaired
//! unasked.
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
//! An operator's channel may be smooth, quiet or constant for good reasons: the rules are made so that simulated
//! operators without faults give no finding (tested), and report about what they find what it is and not what it means.

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
