//! Description of a file format: its name, its extensions, and its functions for reading and writing.
//!
//! Each format defines a [`Format`] in its own module of `formats`; reading, writing, the survey of a file and all
//! messages depend on formats only through it.

use std::io::{self, Write};

use hoid_model::Record;

use super::arrays::{Contents, output_table_of, table_of};
use crate::IoError;
use crate::record::{ReadOptions, topics, trials};
use crate::results::{OutputTable, TableSchema, Values};
use crate::table::{Table, check_selected, select_columns};
use crate::time::with_time;

/// A file format.
pub(crate) struct Format {
    /// Name of the format for display.
    pub(crate) name: &'static str,
    /// Extensions in lower case, the default one first.
    pub(super) extensions: &'static [&'static str],
    /// Reader of the format.
    pub(crate) reading: FormatReader,
    /// Writer of a table of results.
    pub(crate) writing: FormatWriter,
    /// Writer of a record; `None` if a record is written as a table of its channels.
    pub(crate) record: Option<RecordWriter>,
}

/// Function that reads the columns of a record; it may take the bytes or borrow from them.
type TableReader = for<'a> fn(&'a mut Vec<u8>, &'a str, &ReadOptions) -> Result<Table<'a>, IoError>;
/// Function that reads the columns of a table of results with their kinds.
type ResultsReader = fn(Vec<u8>, &str) -> Result<OutputTable, IoError>;
/// Function that reads all arrays of a file with their paths.
type ArraysReader = fn(Vec<u8>, &str) -> Result<Contents, IoError>;
/// Function that starts a file to be written row by row.
type RowWriterStart = fn(&mut dyn Write, &TableSchema) -> io::Result<Box<dyn RowWriter>>;
/// Function that writes columns of equal length.
pub(crate) type ColumnsWriter = fn(&mut dyn Write, &TableSchema, &[Values<'_>]) -> io::Result<()>;
type RecordWriter = fn(&mut dyn Write, &Record) -> io::Result<()>;

/// Structure of a file of this format, and the functions that read it.
pub(crate) enum FormatReader {
    /// One flat table.
    Table {
        /// Reader of the numeric columns, for a record.
        record: TableReader,
        /// Reader of the columns with their original kinds, for results.
        results: ResultsReader,
    },
    /// Named arrays, from which the columns are selected.
    Arrays(ArraysReader),
}

/// Kind of writer of the format.
pub(crate) enum FormatWriter {
    /// Rows are written in groups, in bounded memory.
    Rows(RowWriterStart),
    /// Each column is written as one array preceded by its length: all rows must be known before writing.
    Columns(ColumnsWriter),
    /// Files are only read; the text describes the format, such as "hoid only reads this format".
    ReadOnly(&'static str),
}

/// Writer of a file in groups of rows. The file is borrowed only during each call.
pub(crate) trait RowWriter {
    /// Writes a group of rows as columns of equal length.
    fn write_rows(&mut self, file: &mut dyn Write, columns: &[Values<'_>]) -> io::Result<()>;
    /// Completes the file.
    fn finish(self: Box<Self>, file: &mut dyn Write) -> io::Result<()>;
}

impl Format {
    /// True if tables and records can be written.
    pub(super) fn is_written(&self) -> bool {
        !matches!(self.writing, FormatWriter::ReadOnly(_))
    }

    /// Reads the columns of a record.
    pub(crate) fn table<'a>(
        &self,
        bytes: &'a mut Vec<u8>,
        file: &'a str,
        options: &ReadOptions,
    ) -> Result<Table<'a>, IoError> {
        match self.reading {
            FormatReader::Table { record, .. } => {
                with_time_and_selection(record(bytes, file, options)?, false, options)
            }
            FormatReader::Arrays(read) => {
                let contents = read(std::mem::take(bytes), file)?;
                let (contents, is_trial) = trials::select_trial_in_contents(contents, options.trial.as_ref(), file)?;
                with_time_and_selection(table_of(contents, options, file)?, is_trial, options)
            }
        }
    }

    /// Reads a table of results.
    pub(crate) fn results(&self, bytes: Vec<u8>, file: &str) -> Result<OutputTable, IoError> {
        match self.reading {
            FormatReader::Table { results, .. } => results(bytes, file),
            FormatReader::Arrays(read) => output_table_of(read(bytes, file)?, file),
        }
    }
}

/// Determines the time of a table, and selects the requested columns and the requested trial.
pub(super) fn with_time_and_selection<'a>(
    table: Table<'a>,
    is_trial: bool,
    options: &ReadOptions,
) -> Result<Table<'a>, IoError> {
    let table = with_time(table, options.time.as_ref())?;
    check_selected(&table.names(), options, table.source.file())?;
    let table = select_columns(table, |_, name| name == "t" || options.needs_column(name));
    // With a given sampling frequency the samples are counted: no time column is needed, and a time that restarts is
    // ignored.
    let by_itself = options.trial.is_none() && options.sampling_hz.is_some();
    if is_trial || by_itself {
        return Ok(table);
    }
    let table = match options.trial {
        Some(_) => table,
        None => topics::join_topics(table, options),
    };
    trials::select_trial(table, options.trial.as_ref())
}
