//! File formats of hoid: the only crate that knows them.
//!
//! | module | what it holds |
//! |---|---|
//! | `record_file` | [`read_record`], [`read_prepared`], [`write_record`]: the format by extension, what to read and how |
//! | `column_expression` | [`ColumnExpression`]: which columns are input and output |
//! | `output_table` | [`OutputTable`], [`write_table`], [`read_table`]: columns of results |
//! | `table_writer` | [`TableWriter`]: the same in bounded memory |
//! | `format` | the formats and their extensions |
//! | `csv_table`, `csv_record`, `csv_columns` | CSV: in, out, and for columns of results |
//! | `parquet`, `parquet_record` | Parquet, and records in it |
//! | `arrays` | files of named arrays: paths, and the columns among them |
//! | `mat` | variables of MATLAB |
//! | `npz` | NPZ and NPY of numpy |
//! | `column_record` | a record into any format of columns but CSV |
//! | `xdf` | streams of the Lab Streaming Layer |
//! | `table`, `assemble` | the columns of any format, and the record made of them |
//! | `preparation` | [`Preparation`]: scale, offset, rate, run-in and trend of channels, and the account of it |
//! | `sampling`, `repair` | whether t is even; `--resample` and `--fill` |
//! | `trouble` | [`Trouble`]: what is wrong with the sampling, where and how much |
//! | `stretches` | [`read_stretches`]: the records between troubles |
//! | `survey` | [`survey()`]: what is inside of a file |
//! | `scenario_file` | [`read_scenario`]: scenarios in TOML |
//! | `guarded` | panics of foreign readers as errors |
//! | `atomic` | [`write_atomically`]: files that are whole or not there |
//! | `error` | [`IoError`] |

mod arrays;
mod assemble;
mod atomic;
mod column_expression;
mod column_record;
mod csv_columns;
mod csv_record;
mod csv_table;
mod error;
mod format;
mod guarded;
mod mat;
mod npz;
mod output_table;
mod parquet;
mod parquet_record;
mod preparation;
mod record_file;
mod repair;
mod sampling;
mod scenario_file;
mod stretches;
mod survey;
mod table;
mod table_writer;
mod trouble;
mod xdf;

pub use atomic::{file_names, make_directory, read_bytes, read_text, write_atomically};
pub use column_expression::ColumnExpression;
pub use error::IoError;
pub use output_table::{ColumnKind, ColumnSchema, ColumnValues, OutputColumn, OutputTable, TableSchema};
pub use output_table::{check_table_path, read_table, write_table};
pub use preparation::{NewRate, Offset, Preparation, Scaling, Step};
pub use record_file::{ReadOptions, ReadRecord, Repair, read_prepared, read_record, write_record, write_record_csv};
pub use scenario_file::{ScenarioFileError, parse_scenario, read_scenario, scenario_schema};
pub use stretches::read_stretches;
pub use survey::{ColumnSurvey, FileSurvey, SamplingSurvey, ValueSurvey, survey};
pub use table_writer::TableWriter;
pub use trouble::{Place, Trouble, TroubleKind};
