//! All errors of files, in terms of the user, who has to correct the file.

use hoid_model::ModelError;
use thiserror::Error;

use crate::wording::{list, sparse_option};

/// Reason why a file could not be read or written. Each message names the file, the place in it,
/// the content found, the expected content and the remedy. A `place` is "line 12" if the format has
/// lines, otherwise "row 12".
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum IoError {
    /// A file that the system cannot read.
    #[error("{file} cannot be read: {source}; check the name and the permissions")]
    Unreadable {
        /// The file.
        file: String,
        /// Error reported by the operating system.
        source: std::io::Error,
    },
    /// A file that the system cannot write.
    #[error("{file} cannot be written: {source}; {}", remedy_of_writing(source))]
    Unwritable {
        /// The file.
        file: String,
        /// Error reported by the operating system.
        source: std::io::Error,
    },
    /// A result that would overwrite its own input.
    #[error(
        "{file} is {input}, which is read by the same command and would be lost; choose another file for the result"
    )]
    OutputIsInput {
        /// The path of the result.
        file: String,
        /// The data read.
        input: String,
    },
    /// Results must not overwrite their inputs.
    #[error(
        "{directory} holds {input}, which is read by the same command and may be lost; choose another directory for \
         the results"
    )]
    OutputAmongInputs {
        /// The directory of the results.
        directory: String,
        /// The data read.
        input: String,
    },
    /// A file that holds no fit.
    #[error("{file}: {reason}; give the output of `hoid identify --json`")]
    NoFit {
        /// The file.
        file: String,
        /// Reason.
        reason: String,
    },
    /// A file that is not a shared library of a platform that units are made for.
    #[error(
        "{file} is not a 64-bit shared library for Linux, Windows or macOS; give the one that `cargo xtask ffi` built"
    )]
    NoLibrary {
        /// The file.
        file: String,
    },
    /// A shared library without the functions of a unit.
    #[error(
        "{file} is a shared library, but not that of hoid: it has no {missing}; give the one that `cargo xtask ffi` \
         built"
    )]
    OtherLibrary {
        /// The file.
        file: String,
        /// The function that it lacks.
        missing: &'static str,
    },
    /// A directory in use by another process.
    #[error("another process is working on {directory}: wait until it ends, or choose another directory")]
    InUse {
        /// The directory.
        directory: String,
    },
    /// A directory where a file is expected.
    #[error("{file} is a directory, expected a file; name the file in it")]
    Directory {
        /// The directory.
        file: String,
    },
    /// An extension that does not correspond to any format.
    #[error("{file}: {found}; expected {expected}{remedy}")]
    UnknownFormat {
        /// The file.
        file: String,
        /// The extension, or that there is none.
        found: String,
        /// The extensions that are known.
        expected: String,
        /// "; unpack it", empty if the format is unknown.
        remedy: String,
    },
    /// Content that is not text.
    #[error("{file}, {place}: {found}, expected text in UTF-8; save the table as CSV in UTF-8")]
    NotText {
        /// The file.
        file: String,
        /// Place.
        place: String,
        /// The first bad byte.
        found: String,
    },
    /// A file with only blank lines and comments.
    #[error("{file} is empty, expected a header with the names of the columns and one line per sample")]
    Empty {
        /// The file.
        file: String,
    },
    /// A header without rows.
    #[error("{file} has a header but no samples; check that the recording was saved completely")]
    NoRows {
        /// The file.
        file: String,
    },
    /// Numbers where the column names should be.
    #[error(
        "{file}, {place}: the first line holds numbers ({found}), expected the names of the columns; put a header such as t,e,u above it, without # in front"
    )]
    NoHeader {
        /// The file.
        file: String,
        /// Place.
        place: String,
        /// The first cells.
        found: String,
    },
    /// Cells separated by blanks.
    #[error(
        "{file}: a line has {found} numbers separated by blanks, expected commas, semicolons or tabs; save the table \
         with these, and with a header such as t,e,u"
    )]
    Blanks {
        /// The file.
        file: String,
        /// Number of numbers in the first line.
        found: usize,
    },
    /// A table with too many columns.
    #[error(
        "{file} has {found} columns, expected at most {most}; save only the columns that are needed, or look for \
         missing line ends"
    )]
    TooManyColumns {
        /// The file.
        file: String,
        /// Columns of the file.
        found: usize,
        /// The limit.
        most: usize,
    },
    /// Two columns with the same name.
    #[error("{file}: columns {first} and {second} are both named \"{name}\"; give each column its own name")]
    DuplicateColumn {
        /// The file.
        file: String,
        /// The name.
        name: String,
        /// Number of the first column, from 1.
        first: usize,
        /// Number of the second column, from 1.
        second: usize,
    },
    /// A row that is shorter or longer than the header.
    #[error(
        "{file}, {place}: {found} values, expected {expected} as in the header; look for a truncated line, a stray \
         separator or an open quotation mark"
    )]
    RowLength {
        /// The file.
        file: String,
        /// Place.
        place: String,
        /// Values in the row.
        found: usize,
        /// Names in the header.
        expected: usize,
    },
    /// A truncated last line.
    #[error(
        "{file} is truncated in {place}, its last: {found} of {expected} values; copy or record it again, or remove \
         that line and use the lines above it"
    )]
    CutRow {
        /// The file.
        file: String,
        /// Place.
        place: String,
        /// Values in the row.
        found: usize,
        /// Names in the header.
        expected: usize,
    },
    /// A column that the file does not have.
    #[error(
        "{file} has no column {missing} (asked for: {asked}{meant}); it has {available}; choose with --input and \
         --output by NAME, -NAME or NAME-NAME"
    )]
    NoSuchColumn {
        /// The file.
        file: String,
        /// The names that were not found.
        missing: String,
        /// The whole expression.
        asked: String,
        /// "; did you mean "u"?", empty if no name is near.
        meant: String,
        /// The names that exist.
        available: String,
    },
    /// Text that does not select a column.
    #[error("the column \"{found}\": {expected}")]
    Expression {
        /// The text as given.
        found: String,
        /// The problem and the remedy.
        expected: String,
    },
    /// The same column as input and output.
    #[error("{file}: input and output are both {asked}; choose two columns with --input and --output")]
    SameColumn {
        /// The file.
        file: String,
        /// The expression.
        asked: String,
    },
    /// Text where a number is expected.
    #[error("{file}, {place}, column {column}: found \"{found}\", expected a number; {remedy}")]
    NotANumber {
        /// The file.
        file: String,
        /// Place.
        place: String,
        /// The column.
        column: String,
        /// The text found, shortened to a readable length.
        found: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// An infinite value.
    #[error(
        "{file}, {place}, column {column}: found {found}, expected a finite number; correct the value, or empty the cell and bridge it with --fill"
    )]
    Infinite {
        /// The file.
        file: String,
        /// Place.
        place: String,
        /// The column.
        column: String,
        /// The cell.
        found: String,
    },
    /// Missing values.
    #[error(
        "{file}, {place}, column {column}: the value is missing ({found}), as are {count} of {rows} in this column; bridge them linearly with --fill, or leave them out with --from and --to"
    )]
    Missing {
        /// The file.
        file: String,
        /// The first.
        place: String,
        /// The column.
        column: String,
        /// The cell.
        found: String,
        /// Number of missing values.
        count: usize,
        /// Number of rows examined.
        rows: usize,
    },
    /// Values missing in many places, as for a topic with another rate.
    #[error(
        "{file}, {place}, column {column}: the value is missing ({found}), as are {count} of {rows} in this column; if \
         it was logged at its own instants, read it with {} (or linear, drop); otherwise bridge them linearly with \
         --fill, or leave them out with --from and --to",
        sparse_option(column)
    )]
    Sparse {
        /// The file.
        file: String,
        /// The first.
        place: String,
        /// The column.
        column: String,
        /// The cell.
        found: String,
        /// Number of missing values.
        count: usize,
        /// Number of rows examined.
        rows: usize,
    },
    /// Missing values at the start or end.
    #[error(
        "{file}, {place}, column {column}: the values are missing up to the {end} of the record, so that --fill has nothing to bridge to; leave them out with --from and --to"
    )]
    NothingToBridgeTo {
        /// The file.
        file: String,
        /// The first or last of them.
        place: String,
        /// The column.
        column: String,
        /// "start" or "end".
        end: &'static str,
    },
    /// Neither a time column nor a given sampling frequency.
    #[error(
        "{file} has no column t (time in s), and no sampling frequency was given; name the column of the time with \
         --time COLUMN, or give --fs HZ; it has {available}"
    )]
    NoSampling {
        /// The file.
        file: String,
        /// The names that exist.
        available: String,
    },
    /// An invalid sampling frequency.
    #[error("the sampling frequency is {found} Hz, expected a positive finite number of samples per second")]
    SamplingFrequency {
        /// The value given.
        found: f64,
    },
    /// Too few samples to determine the sampling.
    #[error(
        "{file}: {found} sample, expected at least 2 to determine the sampling from t; check the file and the span, or \
         give --fs HZ"
    )]
    TooFewSamples {
        /// The file.
        file: String,
        /// Number of samples.
        found: usize,
    },
    /// Several trials where one is expected.
    #[error("{file} holds {} trials by {by}: {}; read one of them with --trial {by}={}", .trials.len(), listed(.trials), .trials.first().map_or("", |name| name.as_str()))]
    SeveralTrials {
        /// The file.
        file: String,
        /// The column that counts them, or t.
        by: String,
        /// Names of the trials, at least two.
        trials: Vec<String>,
    },
    /// A trial that does not exist.
    #[error("{file}: there is no trial {asked}; it has {available}")]
    NoSuchTrial {
        /// The file.
        file: String,
        /// The requested trial.
        asked: String,
        /// The names that exist.
        available: String,
    },
    /// Time that is constant or runs backwards.
    #[error(
        "{file}, {place}: t = {found} s after {previous} s, expected increasing time; drop rows that were written \
         twice with --drop-repeated, use --trial t if the time restarts with each trial, write t with more decimals, \
         or give --fs HZ in place of t"
    )]
    NotIncreasing {
        /// The file.
        file: String,
        /// The later row.
        place: String,
        /// Its time, s.
        found: f64,
        /// Previous time, s.
        previous: f64,
    },
    /// Missing samples.
    #[error(
        "{file}: samples missing after {place}, t = {after_s} s: {missing} (the next is at {next_s} s, the sample time is {sample_time_s:.6} s; gaps in all: {gaps}); interpolate over them with --resample, or use the part before or after with --from and --to"
    )]
    Gap {
        /// The file.
        file: String,
        /// The row before the first gap.
        place: String,
        /// Its time, s.
        after_s: f64,
        /// The time of the row after the gap, s.
        next_s: f64,
        /// Samples missing in the first gap.
        missing: u64,
        /// Number of gaps.
        gaps: usize,
        /// Sample time, s.
        sample_time_s: f64,
    },
    /// Samples that deviate from the even grid.
    #[error(
        "{file}: t is uneven: at {place}, t = {found} s, it is {deviation_s:.3e} s off the even grid with sample time {sample_time_s:.6} s, more than the allowed {tolerance_s:.3e} s; interpolate onto the grid with --resample, or give --fs HZ if the samples were taken evenly and only t is wrong"
    )]
    Jitter {
        /// The file.
        file: String,
        /// The row with the largest deviation.
        place: String,
        /// Its time, s.
        found: f64,
        /// Deviation, s.
        deviation_s: f64,
        /// Tolerance, s.
        tolerance_s: f64,
        /// Sample time, s.
        sample_time_s: f64,
    },
    /// A resampled record that would consist mostly of interpolated samples.
    #[error(
        "{file}: resampling from t = {start_s} s to {end_s} s would make {samples:.0} samples out of {rows}, expected at most {factor} times as many; look for a wrong time in t, or use a part with --from and --to"
    )]
    ResampledTooLong {
        /// The file.
        file: String,
        /// First time, s.
        start_s: f64,
        /// Last time, s.
        end_s: f64,
        /// Number of samples after resampling.
        samples: f64,
        /// Number of recorded samples.
        rows: usize,
        /// The largest ratio allowed.
        factor: usize,
    },
    /// A time span without samples.
    #[error("{file}: the span {span} holds no samples; the record covers {start_s} to {end_s} s")]
    EmptySpan {
        /// The file.
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
        /// The step, named as its option.
        step: &'static str,
        /// The problem.
        found: String,
        /// The expected value, or the remedy.
        expected: String,
    },
    /// Text that is not a valid scale.
    #[error("the scale \"{found}\": expected {expected}")]
    Scaling {
        /// The text, or the factor.
        found: String,
        /// Admissible values of a scale.
        expected: String,
    },
    /// Text that is not a valid offset.
    #[error("the offset \"{found}\": expected a number of samples (1, -0.5) or of seconds (0.0167s)")]
    Offset {
        /// The text.
        found: String,
    },
    /// A channel name that cannot be a column of a file.
    #[error("{file}: the column \"{name}\" cannot be written: {reason}; rename it")]
    ChannelName {
        /// The file.
        file: String,
        /// Name of the channel.
        name: String,
        /// Reason.
        reason: &'static str,
    },
    /// Columns of different lengths.
    #[error("{file}: the column \"{column}\" holds {found} values, expected {expected} as in the first column")]
    ColumnLength {
        /// The file.
        file: String,
        /// Name of the column.
        column: String,
        /// Number of its values.
        found: usize,
        /// Number of values of the first column.
        expected: usize,
    },
    /// Arrays of different lengths in one record.
    #[error(
        "{file}: {column} holds {found} values, expected {expected} as in {other}; choose arrays of one recording with --input and --output"
    )]
    UnequalColumns {
        /// The file.
        file: String,
        /// Path of the first array.
        column: String,
        /// Number of its values.
        found: usize,
        /// Path of the second array.
        other: String,
        /// Number of its values.
        expected: usize,
    },
    /// Streams without a common time.
    #[error(
        "{file}: input and output were recorded one after the other, expected a time in which both have samples; choose other streams with --input and --output"
    )]
    NoOverlap {
        /// The file.
        file: String,
    },
    /// A name that matches several arrays.
    #[error("{file}: \"{asked}\" may be any of {found}; give the whole path with --input and --output")]
    AmbiguousColumn {
        /// The file.
        file: String,
        /// The name.
        asked: String,
        /// The paths that end in the name.
        found: String,
    },
    /// A table without columns.
    #[error("{file}: the table has no columns, expected at least one")]
    NoColumns {
        /// The file.
        file: String,
    },
    /// Rows that do not match the columns of the file.
    #[error("{file}: rows of {found} cannot follow {expected}; append tables of the same columns in the same order")]
    ColumnsDiffer {
        /// The file.
        file: String,
        /// Columns of the rows.
        found: String,
        /// Columns of the file.
        expected: String,
    },
    /// Content that is not Parquet.
    #[error(
        "{file} is not a Parquet file: {found}, expected PAR1 at both ends; copy or write it again if it was cut short, or name it .csv if it is text"
    )]
    NotParquet {
        /// The file.
        file: String,
        /// The content found.
        found: String,
    },
    /// Content in a format other than that of the extension.
    #[error(
        "{file} is not in the format {format}: {found}, expected {expected}; copy or write it again if it was cut \
         short, or give it the extension of its format"
    )]
    WrongFormat {
        /// The file.
        file: String,
        /// The format of the extension.
        format: &'static str,
        /// The content found.
        found: String,
        /// First bytes of such a file.
        expected: &'static str,
    },
    /// Content that violates the file format.
    #[error("{file} is damaged: {found}; copy or write it again")]
    Damaged {
        /// The file.
        file: String,
        /// The violation and its place.
        found: String,
    },
    /// Valid content that hoid does not support.
    #[error("{file}: {found}, which hoid does not read; {remedy}")]
    Unsupported {
        /// The file.
        file: String,
        /// The content found and its place.
        found: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// Data that do not form a record.
    #[error("{file}: {source}")]
    Model {
        /// The file.
        file: String,
        /// Reason.
        source: ModelError,
    },
}

/// Remedy for a file that cannot be written.
fn remedy_of_writing(source: &std::io::Error) -> &'static str {
    use std::io::ErrorKind;
    // An I/O error wrapped by the CSV writer.
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

/// Names as text.
fn listed(names: &[String]) -> String {
    list(&names.iter().map(String::as_str).collect::<Vec<_>>())
}
