//! Quality of recorded data: problems with sampling and values, their locations and sizes. Data are changed only on
//! request.
//!
//! | module | contents |
//! |---|---|
//! | `issue` | [`QualityIssue`]: a problem |
//! | `signals` | the columns that are examined |
//! | `grid` | the evenly spaced grid fitted to a time |
//! | `timing` | jitter, missing rows, a clock with a wrong or drifting rate |
//! | `stalls` | duplicated rows, a time that is constant or decreases, and rows in which all channels hold their values |
//! | `values` | saturation, quantisation, constants, missing values |
//! | `search` | search for all these problems in columns that share a time and in the channels of a record |
//! | `table_issues` | search in the table columns from which a record is made |
//!
//! Signals of an operator may legitimately be smooth, quiet or constant. The rules find no problem in simulated
//! operators without faults, which is tested. A problem is described without interpretation.

mod grid;
mod issue;
mod search;
mod signals;
mod stalls;
mod table_issues;
mod timing;
mod values;

pub(crate) use grid::Grid;
pub use issue::{QualityIssue, QualityIssueKind, RowSpan};
pub use search::issues_of_channels;
pub(crate) use search::{find_issues, is_clock_name};
pub(crate) use signals::{Signal, Signals};
pub(crate) use table_issues::{issues_of_record, issues_of_signals};
pub(crate) use values::{Levels, saturation_limits};

#[cfg(test)]
mod tests;
