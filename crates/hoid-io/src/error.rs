//! All errors of files, described for the user who has to correct the file.

use hoid_model::{ModelError, numbers::count_with_noun};
use thiserror::Error;

use crate::table::ColumnOption;
use crate::wording::{list_names, sparse_option};

/// Reason why a file could not be read or written. Each message gives the file, the place in it, the contents found,
/// the expected contents and the remedy. A `place` is "line 12" if the format has lines, otherwise "row 12".
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum IoError {
    /// A file that cannot be read from the file system.
    #[error("{file} cannot be read: {source}; check the name and the permissions")]
    Unreadable {
        /// Name of the file.
        file: String,
        /// Error reported by the operating system.
        source: std::io::Error,
    },
    /// A file that cannot be written to the file system.
    #[error("{file} cannot be written: {source}; {}", write_error_remedy(source))]
    Unwritable {
        /// Name of the file.
        file: String,
        /// Error reported by the operating system.
        source: std::io::Error,
    },
    /// A result that would overwrite its own input.
    #[error("{file} is the input {input} of this command and would be overwritten; choose another file for the result")]
    OutputIsInput {
        /// Path of the result.
        file: String,
        /// Path of the input.
        input: String,
    },
    /// A directory of results that contains an input, which might be overwritten.
    #[error(
        "{directory} contains the input {input} of this command, which may be overwritten; choose another directory \
         for the results"
    )]
    OutputAmongInputs {
        /// Path of the directory of results.
        directory: String,
        /// Path of the input.
        input: String,
    },
    /// A file that does not contain a fit.
    #[error("{file}: {reason}; give the output of `hoid identify --json`")]
    NoFit {
        /// Name of the file.
        file: String,
        /// Reason for the error.
        reason: String,
    },
    /// A file that is not a shared library for a platform supported by FMUs.
    #[error(
        "{file} is not a 64-bit shared library for Linux, Windows or macOS; give the library that `cargo xtask ffi` \
         built"
    )]
    NoLibrary {
        /// Name of the file.
        file: String,
    },
    /// A shared library without the functions required by an FMU.
    #[error(
        "{file} is not the shared library of hoid: the function {missing} is missing; give the library that `cargo \
         xtask ffi` built"
    )]
    OtherLibrary {
        /// Name of the file.
        file: String,
        /// Name of the missing function.
        missing: &'static str,
    },
    /// A directory in use by another process.
    #[error("another process is using {directory}; wait for that process to end, or choose another directory")]
    InUse {
        /// Name of the directory.
        directory: String,
    },
    /// A directory where a file is expected.
    #[error("{file} is a directory, expected a file; give the path of a file in it")]
    Directory {
        /// Name of the directory.
        file: String,
    },
    /// An extension that belongs to no known format.
    #[error("{file}: {found}; expected {expected}{remedy}")]
    UnknownFormat {
        /// Name of the file.
        file: String,
        /// The extension, or a statement that there is none.
        found: String,
        /// The known extensions.
        expected: String,
        /// Remedy, such as "; unpack it first"; empty if none is known.
        remedy: String,
    },
    /// Contents that are not text.
    #[error("{file}, {location}: {found}, expected text in UTF-8; save the table as CSV in UTF-8")]
    NotText {
        /// Name of the file.
        file: String,
        /// Location in the file.
        location: String,
        /// The first invalid byte.
        found: String,
    },
    /// A file with only blank lines and comments.
    #[error("{file} is empty, expected a header with the names of the columns and one line per sample")]
    Empty {
        /// Name of the file.
        file: String,
    },
    /// A header without rows.
    #[error("{file} has a header but no samples; check that the recording was saved completely")]
    NoRows {
        /// Name of the file.
        file: String,
    },
    /// Numbers in the line where the column names are expected.
    #[error(
        "{file}, {location}: the first line holds numbers ({found}), expected the names of the columns; insert a header such as t,e,u above this line, without a leading #"
    )]
    NoHeader {
        /// Name of the file.
        file: String,
        /// Location in the file.
        location: String,
        /// The first cells of the line.
        found: String,
    },
    /// JSON text in place of a table.
    #[error(
        "{file} holds JSON, expected a table with a header such as t,e,u; save the samples as CSV (hoid stream reads \
         lines of JSON, but no other command does)"
    )]
    Json {
        /// Name of the file.
        file: String,
    },
    /// A text in which a line has no end.
    #[error(
        "{file}: no line ends within {max_mb} MB after byte {byte}, expected one line per sample; copy or record the \
         file again, or remove everything after this byte"
    )]
    LongLine {
        /// Name of the file.
        file: String,
        /// Start of the line, counted from 0.
        byte: usize,
        /// Maximum length of a line in MB.
        max_mb: usize,
    },
    /// A header whose words cannot be assigned to the cells below it.
    #[error(
        "{file}, {location}: the header has {}, expected {} as in the rows below it; write one name for each column in \
         this line, and put names of several words in quotation marks or join them (Roll_error)",
        count_with_noun(*words, "word"),
        count_with_noun(*cells, "name")
    )]
    Words {
        /// Name of the file.
        file: String,
        /// Location of the header in the file.
        location: String,
        /// Number of words in the header.
        words: usize,
        /// Number of cells in the rows below the header.
        cells: usize,
    },
    /// A table with too many columns.
    #[error(
        "{file} has {found} columns, expected at most {max_columns}; save only the columns that are needed, or look for \
         missing line endings"
    )]
    TooManyColumns {
        /// Name of the file.
        file: String,
        /// Number of columns in the file.
        found: usize,
        /// Maximum number of columns.
        max_columns: usize,
    },
    /// Two columns with the same name.
    #[error("{file}: columns {first} and {second} are both named \"{name}\"; give each column its own name")]
    DuplicateColumn {
        /// Name of the file.
        file: String,
        /// The duplicated name.
        name: String,
        /// Number of the first column, counted from 1.
        first: usize,
        /// Number of the second column, counted from 1.
        second: usize,
    },
    /// A row that is shorter or longer than the header.
    #[error(
        "{file}, {location}: {found} values, expected {expected} as in the header; {}",
        row_length_remedy(*found, *expected)
    )]
    RowLength {
        /// Name of the file.
        file: String,
        /// Location in the file.
        location: String,
        /// Number of values in the row.
        found: usize,
        /// Number of names in the header.
        expected: usize,
    },
    /// A quotation mark without its closing mark, which would merge many lines into one cell.
    #[error(
        "{file}, {location}: a quotation mark opens a cell in this line and {end}, expected a closing mark at the end of \
         the cell; remove the mark, or close the cell with a second one"
    )]
    OpenQuote {
        /// Name of the file.
        file: String,
        /// Location of the cell in the file.
        location: String,
        /// The end of the cell: "is never closed", or the line in which it is closed.
        end: String,
    },
    /// A second table below the first one.
    #[error(
        "{file}, {location}: a second table starts here, expected one table; save this line and all lines below it as \
         another file, and read the table that holds the samples"
    )]
    SecondTable {
        /// Name of the file.
        file: String,
        /// Location of the first line of the second table.
        location: String,
    },
    /// A truncated last line.
    #[error(
        "{file} is truncated in {location}, the last line: {found} of {expected} values; copy or record the file again, or \
         remove that line"
    )]
    CutRow {
        /// Name of the file.
        file: String,
        /// Location in the file.
        location: String,
        /// Number of values in the row.
        found: usize,
        /// Number of names in the header.
        expected: usize,
    },
    /// A column that does not exist in the file.
    #[error("{file} has no column {missing} (requested: {requested}{suggestion}); it has {available}; {}", option.remedy())]
    NoSuchColumn {
        /// Name of the file.
        file: String,
        /// The names that were not found.
        missing: String,
        /// The complete requested expression.
        requested: String,
        /// Suggestion such as "; did you mean "u"?"; empty if no name is similar.
        suggestion: Box<str>,
        /// Names that exist in the file.
        available: String,
        /// The option with which the column was requested.
        option: ColumnOption,
    },
    /// Text that does not select a column.
    #[error("the column \"{found}\": {expected}")]
    Expression {
        /// Text given by the user.
        found: String,
        /// Description of the problem and the remedy.
        expected: String,
    },
    /// The same column requested as input and output.
    #[error("{file}: input and output are both {requested}; choose two columns with --input and --output")]
    SameColumn {
        /// Name of the file.
        file: String,
        /// The requested expression.
        requested: String,
    },
    /// Text where a number is expected.
    #[error("{file}, {location}, column {column}: found \"{found}\", expected a number; {remedy}")]
    NotANumber {
        /// Name of the file.
        file: String,
        /// Location in the file.
        location: String,
        /// Name of the column.
        column: String,
        /// The text found, shortened to a readable length.
        found: String,
        /// Remedy for the error.
        remedy: &'static str,
    },
    /// An infinite value.
    #[error(
        "{file}, {location}, column {column}: found {found}, expected a finite number; correct the value, or empty the cell and bridge it with --fill"
    )]
    Infinite {
        /// Name of the file.
        file: String,
        /// Location in the file.
        location: String,
        /// Name of the column.
        column: String,
        /// Text of the cell.
        found: String,
    },
    /// Missing values in a column.
    #[error(
        "{file}, {location}, column {column}: the value is missing ({found}; {count} of {rows} missing in this column); {}", missing_remedy(.column)
    )]
    Missing {
        /// Name of the file.
        file: String,
        /// Location of the first missing value.
        location: String,
        /// Name of the column.
        column: String,
        /// Text of the cell.
        found: String,
        /// Number of missing values.
        count: usize,
        /// Number of rows examined.
        rows: usize,
    },
    /// Values missing in many places, as in a topic that was logged at another rate.
    #[error(
        "{file}, {location}, column {column}: the value is missing ({found}; {count} of {rows} missing in this column); \
         if the column was logged at its own times, read it with {} (or linear or drop); otherwise bridge missing \
         values linearly with --fill, or exclude the rows with --from and --to",
        sparse_option(column)
    )]
    Sparse {
        /// Name of the file.
        file: String,
        /// Location of the first missing value.
        location: String,
        /// Name of the column.
        column: String,
        /// Text of the cell.
        found: String,
        /// Number of missing values.
        count: usize,
        /// Number of rows examined.
        rows: usize,
    },
    /// Missing values at the start or the end of the record.
    #[error(
        "{file}, {location}, column {column}: the values at the {end} of the record are missing, so --fill has no value to bridge to; {}", open_end_remedy(.column)
    )]
    NothingToBridgeTo {
        /// Name of the file.
        file: String,
        /// Location of the first or the last missing value.
        location: String,
        /// Name of the column.
        column: String,
        /// End of the record: "start" or "end".
        end: &'static str,
    },
    /// Neither a time column nor a given sampling frequency.
    #[error(
        "{file} has no column t (time in s), and no sampling frequency was given; select the time column with \
         --time COLUMN, or give --fs HZ; the file has {available}"
    )]
    NoSampling {
        /// Name of the file.
        file: String,
        /// Names that exist in the file.
        available: String,
    },
    /// A time column without values.
    #[error(
        "{file}: the time column is empty; give --fs HZ if the samples are evenly spaced, or select another time \
         column with --time COLUMN"
    )]
    EmptyTime {
        /// Name of the file.
        file: String,
    },
    /// An invalid sampling frequency.
    #[error("the sampling frequency is {found} Hz, expected a positive finite number of samples per second")]
    SamplingFrequency {
        /// The given value.
        found: f64,
    },
    /// Too few samples to determine the sampling.
    #[error(
        "{file}: {}, expected at least 2 to determine the sampling rate from t; check the file and the span, or give \
         --fs HZ",
        count_with_noun(*found, "sample")
    )]
    TooFewSamples {
        /// Name of the file.
        file: String,
        /// Number of samples.
        found: usize,
    },
    /// Several trials where a single trial is expected.
    #[error("{file} holds {} trials according to {trial_column}: {}; read one of them with --trial {trial_column}={}", .trials.len(), list_of_names(.trials), .trials.first().map_or("", |name| name.as_str()))]
    SeveralTrials {
        /// Name of the file.
        file: String,
        /// Column that numbers the trials, or t.
        trial_column: String,
        /// Names of the trials, at least two.
        trials: Vec<String>,
    },
    /// A trial that does not exist.
    #[error("{file}: there is no trial {requested}; it has {available}")]
    NoSuchTrial {
        /// Name of the file.
        file: String,
        /// The requested trial.
        requested: String,
        /// Names that exist in the file.
        available: String,
    },
    /// A time that is constant or runs backwards.
    #[error("{file}, {location}: t = {found} s follows t = {previous} s, expected increasing time; {remedy}")]
    NotIncreasing {
        /// Name of the file.
        file: String,
        /// Location of the later row.
        location: String,
        /// Time in the later row, s.
        found: f64,
        /// Time in the row before, s.
        previous: f64,
        /// Remedy for the error.
        remedy: &'static str,
    },
    /// A single wrong time in a grid that is otherwise even.
    #[error(
        "{file}, {location}: t = {found} s, expected {expected_s} s as the times of all other rows are evenly spaced; \
         correct this time, or give --fs {hz} in place of t"
    )]
    WrongTime {
        /// Name of the file.
        file: String,
        /// Location of the row.
        location: String,
        /// Time in the row, s.
        found: f64,
        /// Time on the grid, s.
        expected_s: String,
        /// Sampling frequency of the grid, Hz.
        hz: f64,
    },
    /// Missing samples.
    #[error(
        "{file}: gap after {location}, t = {after_s} s (missing samples: {missing}; next sample at {next_s} s; sample time \
         {sample_time_s:.6} s; total number of gaps: {gaps}); interpolate with --resample, or use the part before or \
         after the gap with --from and --to"
    )]
    Gap {
        /// Name of the file.
        file: String,
        /// Location of the row before the first gap.
        location: String,
        /// Time in the row before the first gap, s.
        after_s: f64,
        /// Time in the row after the first gap, s.
        next_s: f64,
        /// Number of samples missing in the first gap.
        missing: u64,
        /// Number of gaps.
        gaps: usize,
        /// Sample time, s.
        sample_time_s: f64,
    },
    /// Samples that deviate from the evenly spaced grid.
    #[error(
        "{file}: t is unevenly spaced: t = {found} s at {location} is {deviation_s:.3e} s off the even grid with sample time {sample_time_s:.6} s, expected at most {tolerance_s:.3e} s; interpolate onto the grid with --resample, or give --fs HZ if the samples were taken evenly and only t is wrong"
    )]
    Jitter {
        /// Name of the file.
        file: String,
        /// Location of the row with the largest deviation.
        location: String,
        /// Time in the row with the largest deviation, s.
        found: f64,
        /// Deviation of this time from the grid, s.
        deviation_s: f64,
        /// Largest permitted deviation, s.
        tolerance_s: f64,
        /// Sample time, s.
        sample_time_s: f64,
    },
    /// A resampled record that would consist almost entirely of interpolated samples.
    #[error(
        "{file}: resampling from t = {start_s} s to {end_s} s would turn {rows} samples into {samples:.0}, expected at most {factor} times as many; check t for a wrong time, or use a part with --from and --to"
    )]
    ResampledTooLong {
        /// Name of the file.
        file: String,
        /// First time of the record, s.
        start_s: f64,
        /// Last time of the record, s.
        end_s: f64,
        /// Number of samples after resampling.
        samples: f64,
        /// Number of recorded samples.
        rows: usize,
        /// Largest permitted ratio of resampled to recorded samples.
        factor: usize,
    },
    /// A time span without samples.
    #[error("{file}: the span {span} holds no samples; the record covers {start_s} to {end_s} s")]
    EmptySpan {
        /// Name of the file.
        file: String,
        /// The span as requested.
        span: String,
        /// First time of the record, s.
        start_s: f64,
        /// Last time of the record, s.
        end_s: f64,
    },
    /// A preparation step that cannot be applied.
    #[error("{record}: {step}: {found}, expected {expected}")]
    Preparation {
        /// Label of the record.
        record: String,
        /// Name of the step, as in its command-line option.
        step: &'static str,
        /// Description of the problem.
        found: String,
        /// The expected value, or the remedy.
        expected: String,
    },
    /// Text that is not a valid scale.
    #[error("the scale \"{found}\": expected {expected}")]
    Scaling {
        /// The given text or factor.
        found: String,
        /// Admissible values of a scale.
        expected: String,
    },
    /// Text that is not a valid offset.
    #[error("the offset \"{found}\": expected a number of samples (1, -0.5) or of seconds (0.0167s)")]
    Offset {
        /// The given text.
        found: String,
    },
    /// A channel name that cannot serve as a column name in a file.
    #[error("{file}: the column \"{name}\" cannot be written: {reason}; rename it")]
    ChannelName {
        /// Name of the file.
        file: String,
        /// Name of the channel.
        name: String,
        /// Reason for the error.
        reason: &'static str,
    },
    /// Columns of different lengths.
    #[error("{file}: the column \"{column}\" holds {found} values, expected {expected} as in the first column")]
    ColumnLength {
        /// Name of the file.
        file: String,
        /// Name of the column.
        column: String,
        /// Number of values of this column.
        found: usize,
        /// Number of values of the first column.
        expected: usize,
    },
    /// Arrays of different lengths in one record.
    #[error(
        "{file}: {column} holds {found} values, expected {expected} as in {other}; choose arrays of one recording with --input and --output"
    )]
    UnequalColumns {
        /// Name of the file.
        file: String,
        /// Path of the first array.
        column: String,
        /// Number of values of the first array.
        found: usize,
        /// Path of the second array.
        other: String,
        /// Number of values of the second array.
        expected: usize,
    },
    /// Streams that do not overlap in time.
    #[error(
        "{file}: input and output were recorded one after the other, expected streams that overlap in time; choose other streams with --input and --output"
    )]
    NoOverlap {
        /// Name of the file.
        file: String,
    },
    /// A name that matches several arrays.
    #[error("{file}: \"{requested}\" matches {found}; give the full path")]
    AmbiguousColumn {
        /// Name of the file.
        file: String,
        /// The ambiguous name.
        requested: String,
        /// The paths that end in the name.
        found: String,
    },
    /// A table without columns.
    #[error("{file}: the table has no columns, expected at least one")]
    NoColumns {
        /// Name of the file.
        file: String,
    },
    /// Rows that do not match the columns of the file.
    #[error(
        "{file}: the appended rows have the columns {found}, expected {expected}; append tables with the same columns in the same order"
    )]
    ColumnsDiffer {
        /// Name of the file.
        file: String,
        /// Columns of the appended rows.
        found: String,
        /// Columns of the file.
        expected: String,
    },
    /// Contents that are not Parquet.
    #[error(
        "{file} is not a Parquet file: {found}, expected PAR1 at both ends; copy or write it again if it was cut short, or name it .csv if it is text"
    )]
    NotParquet {
        /// Name of the file.
        file: String,
        /// Description of the contents found.
        found: String,
    },
    /// Contents whose format differs from the extension.
    #[error(
        "{file} is not in {format} format: {found}, expected {expected}; copy or write it again if it was cut \
         short, or give it the extension of its format"
    )]
    WrongFormat {
        /// Name of the file.
        file: String,
        /// Format that corresponds to the extension.
        format: &'static str,
        /// Description of the contents found.
        found: String,
        /// First bytes of a file in that format.
        expected: &'static str,
    },
    /// Contents that violate the file format.
    #[error("{file} is damaged: {found}; copy or write it again")]
    Damaged {
        /// Name of the file.
        file: String,
        /// Description of the violation and its place.
        found: String,
    },
    /// Valid contents that hoid does not support.
    #[error("{file}: {found}, which hoid does not read; {remedy}")]
    Unsupported {
        /// Name of the file.
        file: String,
        /// Description of the contents and their place.
        found: String,
        /// Remedy for the error.
        remedy: &'static str,
    },
    /// Data that do not form a record.
    #[error("{file}: {source}")]
    Model {
        /// Name of the file.
        file: String,
        /// Reason for the error.
        source: ModelError,
    },
}

/// Returns the remedy for missing values; rows without a time cannot be excluded by their time.
fn missing_remedy(column: &str) -> &'static str {
    match column {
        "t" => "bridge missing times linearly with --fill, or remove these rows from the file",
        _ => "bridge missing values linearly with --fill, or exclude the rows with --from and --to",
    }
}

/// Returns the remedy for missing values at the start or the end of the record.
fn open_end_remedy(column: &str) -> &'static str {
    match column {
        "t" => "remove these rows from the file",
        _ => "exclude these rows with --from and --to",
    }
}

/// Returns the remedy for a row whose length differs from that of the header.
fn row_length_remedy(found: usize, expected: usize) -> &'static str {
    // In such a row, decimal commas split each number into two cells.
    if expected > 1 && expected.checked_mul(2) == Some(found) {
        "if the numbers have decimal commas, save the table with semicolons or tabs between the columns; otherwise look \
         for a stray separator"
    } else {
        "look for a truncated line, a stray separator or an open quotation mark"
    }
}

/// Returns the remedy for a file that cannot be written.
fn write_error_remedy(source: &std::io::Error) -> &'static str {
    use std::io::ErrorKind;
    // An I/O error inside an error of the CSV writer determines the remedy.
    let wrapped = source.get_ref().and_then(|inner| inner.downcast_ref::<csv::Error>());
    let kind = match wrapped.map(csv::Error::kind) {
        Some(csv::ErrorKind::Io(inner)) => inner.kind(),
        _ => source.kind(),
    };
    match kind {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "free space there, or choose a location on another disk",
        ErrorKind::FileTooLarge => "raise the limit on file size (ulimit -f), or write less",
        ErrorKind::ReadOnlyFilesystem => "choose a location on a writable disk",
        _ => "check that the directory exists and that you may write there",
    }
}

/// Lists names as text.
fn list_of_names(names: &[String]) -> String {
    list_names(&names.iter().map(String::as_str).collect::<Vec<_>>())
}
