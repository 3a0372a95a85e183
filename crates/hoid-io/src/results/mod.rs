//! Writing and reading of the result files of hoid.
//!
//! | module | contents |
//! |---|---|
//! | `output_table` | [`OutputTable`]: columns of results, and their representation in each format |
//! | `table_file` | [`write_table`], [`read_table`]: tables of results |
//! | `table_writer` | [`TableWriter`]: writing of tables in bounded memory |
//! | `fit_file` | [`read_fit`]: a fit printed by `hoid identify --json` |

mod fit_file;
mod output_table;
mod table_file;
mod table_writer;

pub use fit_file::{FitFile, FitParameter, is_fit_file, parse_fit, read_fit};
pub(crate) use output_table::Values;
pub use output_table::{ColumnKind, ColumnSchema, ColumnValues, OutputColumn, OutputTable, TableSchema};
pub use table_file::{check_table_path, read_table, write_table};
pub use table_writer::TableWriter;
pub(crate) use table_writer::write_values;
