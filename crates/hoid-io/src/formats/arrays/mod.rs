//! Files of named arrays: NPZ, MATLAB, XDF. The contents of a file are a list of paths, each with an array, text or
//! unsupported content; this module builds records and tables from the list in the same way for all formats.
//!
//! | module | contents |
//! |---|---|
//! | `numbers` | [`Numbers`]: bytes with a type |
//! | `array` | [`Array`]: numbers with dimensions |
//! | `contents` | [`Contents`]: the contents of a file |
//! | `column_path` | [`ColumnPath`]: arrays as columns; a matrix gives several columns |
//! | `selection` | [`table_of`]: the columns of a record, and the other columns of the same structure |
//! | `clocks` | interpolation of columns to the times of another stream |
//! | `results` | [`output_table_of`]: all columns, as a table of results |

mod array;
mod clocks;
mod column_path;
mod contents;
mod numbers;
mod results;
mod selection;

pub(crate) use array::Array;
pub(crate) use column_path::{ColumnContents, ColumnPath};
pub(crate) use contents::{COMMENTS_ARRAY, Contents, Entry, Indexing, OBJECT_PREFIX, Value};
pub(crate) use numbers::{Kind, Numbers};
pub(crate) use results::output_table_of;
pub(crate) use selection::{CLOCK_TIME_UNIT, TIME_NAMES, table_of};
