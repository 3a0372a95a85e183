//! Records from the columns of a file, and into files.
//!
//! A trial is selected, its rows are placed on an even grid, and each value in use is checked; data are repaired only
//! on request.
//!
//! | module | contents |
//! |---|---|
//! | `file` | [`read_record`], [`read_prepared`], [`write_record`] |
//! | `read_options` | [`ReadOptions`], [`TrialChoice`]: selection of the data, and options for reading them |
//! | `trials` | the trials of a file |
//! | `from_table` | [`ReadRecord`]: from the columns of a file to a record |
//! | `table_reader` | the columns on this way, one by one |
//! | `time_grid` | the rows of a record, and its even grid |
//! | `sparse` | columns that were logged at instants of their own: `--sparse` |
//! | `repair` | rows that are duplicated, missing values, an uneven time: `--fill` and `--resample` |
//! | `alignment` | [`read_aligned`]: channels that were recorded late, within a span that keeps its length |
//! | `segments` | [`read_segments`]: the records between faults of the recording |
//! | `channels` | the channels of a record as the columns of a file |

mod alignment;
mod channels;
mod file;
mod from_table;
mod read_options;
mod repair;
mod segments;
mod sparse;
mod table_reader;
mod time_grid;
pub(crate) mod trials;

pub use alignment::read_aligned;
pub(crate) use channels::{channels, comments};
pub use file::{read, read_prepared, read_record, write_record, write_record_csv};
pub use from_table::ReadRecord;
pub use read_options::{ReadOptions, Repair, Sparse, TrialChoice};
pub use segments::read_segments;
