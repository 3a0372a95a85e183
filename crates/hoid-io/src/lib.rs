//! File formats of hoid: the only crate that knows them.
//!
//! | module | what it holds |
//! |---|---|
//! | `record_file` | [`read_record`], [`write_record`]: the format by extension, what to read and how |
//! | `column_expression` | [`ColumnExpression`]: which columns are input and output |
//! | `csv_table`, `csv_record` | CSV, in and out |
//! | `table`, `assemble` | the columns of any format, and the record made of them |
//! | `sampling`, `repair` | whether t is even; `--resample` and `--fill` |
//! | `scenario_file` | [`read_scenario`]: scenarios in TOML |
//! | `atomic` | [`write_atomically`]: files that are whole or not there |
//! | `error` | [`IoError`] |

mod assemble;
mod atomic;
mod column_expression;
mod csv_record;
mod csv_table;
mod error;
mod record_file;
mod repair;
mod sampling;
mod scenario_file;
mod table;

pub use atomic::{make_directory, write_atomically};
pub use column_expression::ColumnExpression;
pub use error::IoError;
pub use record_file::{ReadOptions, ReadRecord, Repair, read_record, write_record};
pub use scenario_file::{ScenarioFileError, parse_scenario, read_scenario};
