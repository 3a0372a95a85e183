//! Records from files and into files.
//!
//! Reading takes the columns that are asked for, finds the sampling, checks every value in use and gives a [`Record`], or the
//! error that names the place. Nothing is repaired unless [`Repair`] asks for it, and what was repaired is said in the notes.
//! The format follows from the extension; a new format is a function from bytes to a table, one that writes, and a line in
//! [`Format`].

use std::io::Write;
use std::mem;
use std::path::Path;

use hoid_model::Record;

use crate::arrays::table_of;
use crate::format::{Format, bytes_of, format_to_write};
use crate::table::Table;
use crate::{
    ColumnExpression, IoError, Preparation, Step, Trouble, assemble, column_record, csv_record, csv_table, mat, npz,
    parquet_record, write_atomically, xdf,
};

/// What may be mended in a damaged record. By default nothing is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Repair {
    /// Interpolate linearly from an uneven t, also over gaps, to an even grid. The grid starts at the first t; its sample time
    /// is that of the typical step, or of [`ReadOptions::sampling_hz`].
    pub resample: bool,
    /// Bridge missing values (empty, NaN, NA) linearly between the values before and behind.
    pub fill: bool,
}

/// How to read a record.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadOptions {
    /// Input of the person; `e` by default. `None` reads an output alone, for the structures without input.
    pub input: Option<ColumnExpression>,
    /// Output of the person; `u` by default.
    pub output: ColumnExpression,
    /// Sampling frequency in Hz. It wins over the column t, which then gives only the time of the first sample (0 when there
    /// is none); with [`Repair::resample`] it is the frequency of the new grid. By default the sampling is that of t.
    pub sampling_hz: Option<f64>,
    /// The samples with `from <= t < to`, s; what lies outside is not looked at. By default all.
    pub span_s: (Option<f64>, Option<f64>),
    /// What may be mended.
    pub repair: Repair,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            input: Some(ColumnExpression::column("e")),
            output: ColumnExpression::column("u"),
            sampling_hz: None,
            span_s: (None, None),
            repair: Repair::default(),
        }
    }
}

/// A record, what was done to it, and what else a person should know about how it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadRecord {
    /// The record, labelled with the name of the file without extension.
    pub record: Record,
    /// What was not read or looks odd, such as columns left out; one sentence each.
    pub notes: Vec<String>,
    /// What was done to the numbers of the file, in this order.
    pub steps: Vec<Step>,
    /// What is wrong with the input, the output and their time in the file, before anything was done; within the span that is read.
    pub trouble: Vec<Trouble>,
}

/// Reads a record from a file: input, output, and each other column of numbers as a channel of its own.
///
/// # Errors
/// [`IoError`], naming the place in the file.
pub fn read_record(path: &Path, options: &ReadOptions) -> Result<ReadRecord, IoError> {
    read_prepared(path, options, &Preparation::default())
}

/// Reads a record and prepares it: the units, the alignment and the rate that the estimator is to see.
///
/// # Errors
/// [`IoError`], naming the place in the file or the step of the preparation.
pub fn read_prepared(path: &Path, options: &ReadOptions, preparation: &Preparation) -> Result<ReadRecord, IoError> {
    let file = path.display().to_string();
    let (format, mut bytes) = bytes_of(path)?;
    let table = table(format, &mut bytes, &file, options)?;
    let label = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let mut read = assemble::record_of(table, options, preparation.drop_repeated)?;
    let (record, steps) = preparation.apply(read.record.labelled(label.unwrap_or_default()))?;
    read.steps.extend(steps);
    Ok(ReadRecord { record, ..read })
}

/// The columns of a file.
pub(crate) fn table<'a>(
    format: Format,
    bytes: &'a mut Vec<u8>,
    file: &'a str,
    options: &ReadOptions,
) -> Result<Table<'a>, IoError> {
    match format {
        Format::Csv { .. } => csv_table::parse(bytes, file),
        Format::Parquet => parquet_record::parse(mem::take(bytes), file),
        Format::Npz => table_of(npz::read(bytes, file)?, options, file),
        Format::Mat => table_of(mat::read(mem::take(bytes), file)?, options, file),
        Format::Xdf => table_of(xdf::read(bytes, file)?, options, file),
        Format::Npy => table_of(npz::read_single(mem::take(bytes), file)?, options, file),
    }
}

/// Writes a record: t, then `f_t` where there is one, input, output, and the other channels in their order, all with the digits
/// that give the same numbers back. Units and sample time are kept beside them as comments; the label is not written.
///
/// # Errors
/// [`IoError::UnknownFormat`], [`IoError::ChannelName`] for a channel that could not be read back, and those of
/// [`write_atomically`].
pub fn write_record(path: &Path, record: &Record) -> Result<(), IoError> {
    let format = format_to_write(path)?;
    check_names(record, || path.display().to_string())?;
    match format {
        Format::Csv { separator } => write_atomically(path, |file| csv_record::write(file, record, separator)),
        _ => column_record::write(path, record),
    }
}

/// Writes a record as CSV into something that is open already, such as standard output.
///
/// # Errors
/// [`IoError::ChannelName`]; [`IoError::Unwritable`] for what `out` says. `name` stands for it in both.
pub fn write_record_csv(out: &mut dyn Write, name: &str, record: &Record) -> Result<(), IoError> {
    check_names(record, || name.to_owned())?;
    csv_record::write(out, record, b',').map_err(|source| IoError::Unwritable {
        file: name.to_owned(),
        source,
    })
}

fn check_names(record: &Record, file: impl Fn() -> String) -> Result<(), IoError> {
    for name in record.channels().map(|c| c.name.as_str()) {
        let reason = match name {
            "t" => "t is the time of the samples",
            "" => "it has no name",
            padded if padded != padded.trim() => "there are blanks around the name",
            _ => continue,
        };
        return Err(IoError::ChannelName {
            file: file(),
            name: name.to_owned(),
            reason,
        });
    }
    Ok(())
}
