//! Reading and writing of all file formats of hoid.
//!
//! Recordings are in CSV, Parquet, NPZ, MATLAB or XDF format, with columns of any name, clocks with jitter, and missing
//! rows. Reading selects the requested columns, determines the sampling, checks every value in use, and returns an
//! evenly sampled [`Record`](hoid_model::Record), or an error with its place in the file. Data are repaired only on
//! request; problems with the data are reported with the record.
//!
//! ```
//! use hoid_io::{ReadOptions, read_record};
//!
//! let path = std::env::temp_dir().join("hoid-io-lib-example.csv");
//! std::fs::write(&path, "t,r,y,u\n0.00,1,0,0\n0.01,1,0.5,0.2\n0.02,1,0.75,0.3\n")?;
//!
//! let options = ReadOptions { input: Some("r-y".parse()?), ..ReadOptions::default() };
//! let read = read_record(&path, &options)?;
//! assert_eq!(read.record.input(), [1.0, 0.5, 0.25]);
//! assert_eq!(read.record.sample_time().s(), 0.01);
//! for issue in &read.quality_issues {
//!     println!("{issue}; {}", issue.kind.remedy());
//! }
//! # std::fs::remove_file(&path)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | contents |
//! |---|---|
//! | `formats` | the file formats, one module per format, and their common parts; [`readable_extensions`] |
//! | `table` | the columns of a file of any format; [`ColumnExpression`], [`find_error_column`]: selection of columns |
//! | `time` | [`TimeChoice`]: choice of the time column; [`even_times`]: check that the times are evenly spaced |
//! | `record` | [`read_record`], [`read_aligned`], [`read_segments`] with [`ReadOptions`]; [`write_record`] |
//! | `preparation` | [`Preparation`]: scale, offset, rate, run-in and trend of channels, and the list of applied steps |
//! | `data_quality` | [`QualityIssue`]: problems with the sampling and the values, with their location and size |
//! | `survey` | [`survey()`]: overview of the contents of a file |
//! | `scenario` | [`read_scenario`]: scenarios in TOML |
//! | [`fmu`] | functional mock-up units |
//! | `results` | [`OutputTable`], [`write_table`], [`TableWriter`]: tables of results; [`read_fit`]: a fit printed by hoid |
//! | `output` | [`write_atomically`], [`check_output`], [`DirectoryLock`]: writing without loss of data |
//! | `input_file` | [`read_text`], [`read_settings`]: files other than recordings |
//! | `wording` | formatting of numbers and names in messages |
//! | `error` | [`IoError`] |

// Numbers from a file are checked before they are used as an index, a length or a summand.
#![cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]

mod data_quality;
mod error;
pub mod fmu;
mod formats;
mod input_file;
mod output;
mod preparation;
mod record;
mod results;
mod scenario;
mod survey;
mod table;
mod time;
mod wording;

pub use data_quality::{QualityIssue, QualityIssueKind, RowSpan, issues_of_channels};
pub use error::IoError;
pub use formats::{readable_extensions, writable_extensions};
pub use input_file::{file_names, read_bytes, read_settings, read_text};
pub use output::{
    DirectoryLock, check_output, check_output_directory, is_same_file, make_directory, remove_unfinished_files,
    write_atomically,
};
pub use preparation::{NewRate, Offset, Preparation, Scaling, Step};
pub use record::{
    ReadOptions, ReadRecord, Repair, SparseTreatment, TrialChoice, read, read_aligned, read_prepared, read_record,
    read_segments, write_record, write_record_csv,
};
pub use results::{
    ColumnKind, ColumnSchema, ColumnValues, FitFile, FitParameter, OutputColumn, OutputTable, TableSchema, TableWriter,
    check_table_path, is_fit_file, parse_fit, read_fit, read_table, write_table,
};
pub use scenario::{
    AnyScenario, LIST_VALUED_KEYS, ScenarioChangeError, ScenarioChanges, ScenarioFileError, family_scenario_schema,
    parse_any_scenario, parse_scenario, read_any_scenario, read_scenario, scenario_schema,
};
pub use survey::{ColumnSurvey, FileSurvey, SamplingSurvey, ValueSurvey, survey};
pub use table::{ColumnExpression, ColumnOption, find_control_column, find_error_column};
pub use time::{TimeChoice, even_times};
pub use wording::escape_control_characters;
