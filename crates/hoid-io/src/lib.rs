//! The file formats of hoid: the only crate that knows them.
//!
//! Recordings come as CSV, Parquet, NPZ, MATLAB or XDF, with columns of any name, clocks that
//! jitter and rows that are missing. Reading takes the columns that are asked for, finds the
//! sampling, checks every value in use, and gives an evenly sampled [`Record`](hoid_model::Record)
//! or an error that names the place in the file. Nothing is repaired unasked; what is wrong with
//! the data is said beside the record.
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
//! | module | what it holds |
//! |---|---|
//! | `record_file` | [`read_record`], [`read_prepared`], [`write_record`] |
//! | `alignment` | [`read_aligned`]: channels that were recorded late, beside the others within a span that keeps its length |
//! | `table_file` | [`write_table`], [`read_table`]: tables of results; [`TableWriter`]: the same in bounded memory |
//! | `survey` | [`survey()`]: what is inside of a file |
//! | `segments` | [`read_segments`]: the records between faults of the recording |
//! | `scenario_file` | [`read_scenario`]: scenarios in TOML |
//! | `fit_file` | [`read_fit`]: what `hoid identify --json` has printed |
//! | [`fmu`] | functional mock-up units |
//! | `formats`, `format` | the formats, and what each says of itself |
//! | `arrays` | files of named arrays: paths, and the columns among them |
//! | `time_column`, `moment` | [`TimeChoice`]: the time under another name, in another unit; dates and times of a clock |
//! | `trial_choice`, `trials` | [`TrialChoice`]: the trials of a file |
//! | `usual_names` | [`error_among`], [`control_among`]: columns by the names that people give them |
//! | `table`, `table_reader`, `time_grid`, `record_from_table` | the columns of any format, and the record made of them |
//! | `column_expression`, `read_options` | [`ColumnExpression`], [`ReadOptions`]: what is read and how |
//! | `preparation` | [`Preparation`]: scale, offset, rate, run-in and trend of channels, and the account of it |
//! | `sampling`, `repair` | whether t is even; `--resample` and `--fill` |
//! | `data_quality` | [`QualityIssue`]: what is wrong with the sampling and the values, where and how much |
//! | `output_table` | [`OutputTable`]: columns of results |
//! | `wording` | numbers and names in messages |
//! | `budget` | how much memory a file may take |
//! | `guarded` | panics of foreign readers as errors |
//! | `atomic`, `part_file` | [`write_atomically`]: files that are whole or not there; what dead processes left |
//! | `output_place`, `directory_lock` | [`check_output`]: no result in the place of an input; [`DirectoryLock`] |
//! | `error` | [`IoError`] |

mod alignment;
mod arrays;
mod atomic;
mod budget;
mod column_expression;
mod data_quality;
mod directory_lock;
mod error;
mod fit_file;
pub mod fmu;
mod format;
mod formats;
mod guarded;
mod moment;
mod output_place;
mod output_table;
mod part_file;
mod preparation;
mod read_options;
mod record_columns;
mod record_file;
mod record_from_table;
mod repair;
mod sampling;
mod scenario_file;
mod segments;
mod survey;
mod table;
mod table_file;
mod table_reader;
mod table_writer;
mod time_column;
mod time_grid;
mod trial_choice;
mod trials;
mod usual_names;
mod wording;

pub use alignment::read_aligned;
pub use atomic::{file_names, make_directory, read_bytes, read_settings, read_text, write_atomically};
pub use column_expression::ColumnExpression;
pub use data_quality::{Place, QualityIssue, QualityIssueKind, quality_of_record};
pub use directory_lock::DirectoryLock;
pub use error::IoError;
pub use fit_file::{FitFile, FitParameter, is_fit_file, parse_fit, read_fit};
pub use formats::{readable_endings, writable_endings};
pub use output_place::{check_output, check_output_directory, is_same_file};
pub use output_table::{ColumnKind, ColumnSchema, ColumnValues, OutputColumn, OutputTable, TableSchema};
pub use part_file::remove_unfinished_files;
pub use preparation::{NewRate, Offset, Preparation, Scaling, Step};
pub use read_options::{ReadOptions, Repair};
pub use record_file::{read, read_prepared, read_record, write_record, write_record_csv};
pub use record_from_table::ReadRecord;
pub use sampling::even_times;
pub use scenario_file::{
    AnyScenario, ScenarioFileError, family_scenario_schema, parse_any_scenario, parse_scenario, read_any_scenario,
    read_scenario, scenario_schema,
};
pub use segments::read_segments;
pub use survey::{ColumnSurvey, FileSurvey, SamplingSurvey, ValueSurvey, survey};
pub use table_file::{check_table_path, read_table, write_table};
pub use table_writer::TableWriter;
pub use time_column::TimeChoice;
pub use trial_choice::TrialChoice;
pub use usual_names::{control_among, error_among};
pub use wording::printable;
