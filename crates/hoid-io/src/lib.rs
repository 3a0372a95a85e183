//! File formats of hoid: the only crate that knows them.
//!
//! | module | what it holds |
//! |---|---|
//! | `record_file` | [`read_record`], [`write_record`]: the format by extension, what to read and how |
//! | `column_expression` | [`ColumnExpression`]: which columns are input and output |
//! | `output_table` | [`OutputTable`], [`write_table`], [`read_table`]: columns of results |
//! | `table_writer` | [`TableWriter`]: the same in bounded memory |
//! | `format` | the formats and their extensions |
//! | `csv_table`, `csv_record`, `csv_columns` | CSV: in, out, and for columns of results |
//! | `parquet`, `parquet_record` | Parquet, and records in it |
//! | `table`, `assemble` | the columns of any format, and the record made of them |
//! | `sampling`, `repair` | whether t is even; `--resample` and `--fill` |
//! | `scenario_file` | [`read_scenario`]: scenarios in TOML |
//! | `atomic` | [`write_atomically`]: files that are whole or not there |
//! | `error` | [`IoError`] |

mod assemble;
mod atomic;
mod column_expression;
mod csv_columns;
mod csv_record;
mod csv_table;
mod error;
mod format;
mod output_table;
mod parquet;
mod parquet_record;
mod record_file;
mod repair;
mod sampling;
mod scenario_file;
mod table;
mod table_writer;

pub use atomic::{make_directory, write_atomically};
pub use column_expression::ColumnExpression;
pub use error::IoError;
pub use output_table::{ColumnKind, ColumnSchema, ColumnValues, OutputColumn, OutputTable, TableSchema};
pub use output_table::{check_table_path, read_table, write_table};
pub use record_file::{ReadOptions, ReadRecord, Repair, read_record, write_record, write_record_csv};
pub use scenario_file::{ScenarioFileError, parse_scenario, read_scenario};
pub use table_writer::TableWriter;
