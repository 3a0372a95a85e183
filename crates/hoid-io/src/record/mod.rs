//! Conversion of the columns of a file to records, and writing of records to files.
//!
//! A trial is selected, its rows are placed on an evenly spaced grid, and each value in use is checked; data are
//! repaired only on request.
//!
//! | module | contents |
//! |---|---|
//! | `file` | [`read_record`], [`read_prepared`], [`write_record`] |
//! | `read_options` | [`ReadOptions`], [`TrialChoice`]: selection of the data, and options for reading them |
//! | `topics` | topics that follow one another in a table |
//! | `trials` | division of a file into trials |
//! | `from_table` | [`ReadRecord`]: conversion of the columns of a file to a record |
//! | `table_reader` | checks and repairs of the columns, one by one |
//! | `time_grid` | the rows of a record, and the evenly spaced grid of its samples |
//! | `sparse` | columns that were logged at their own times: `--sparse` |
//! | `repair` | duplicated rows, missing values and an unevenly spaced time: `--fill` and `--resample` |
//! | `alignment` | [`read_aligned`]: alignment of channels recorded late, without shortening the span |
//! | `segments` | [`read_segments`]: records between faults of the recording |
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
pub(crate) mod topics;
pub(crate) mod trials;

pub use alignment::read_aligned;
pub(crate) use channels::{comments, ordered_channels};
pub use file::{read, read_prepared, read_record, write_record, write_record_csv};
pub use from_table::ReadRecord;
pub use read_options::{ReadOptions, Repair, SparseTreatment, TrialChoice};
pub use segments::read_segments;
