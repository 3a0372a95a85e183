//! Reading and writing of records.
//!
//! Reading selects the requested columns, determines the sampling, checks every value in use and returns a [`Record`],
//! or an error with its place in the file. Data are repaired only if [`Repair`](crate::Repair) requests it, and the
//! repairs are reported in the notes. The extension determines the format.

use std::io::Write;
use std::path::Path;

use hoid_model::Record;

use super::alignment::read_aligned;
use super::channels::{comments, ordered_channels};
use super::from_table::ReadRecord;
use super::read_options::ReadOptions;
use crate::IoError;
use crate::formats::{format_to_write, write_record_as_csv};
use crate::output::write_atomically;
use crate::preparation::Preparation;
use crate::results::{ColumnKind, ColumnSchema, TableSchema, Values, write_values};

/// Reads a record with the defaults of the command line: columns e, u and t, and every other numeric column as a
/// separate channel.
///
/// # Errors
/// As [`read_record`].
pub fn read(path: impl AsRef<Path>) -> Result<Record, IoError> {
    Ok(read_record(path.as_ref(), &ReadOptions::default())?.record)
}

/// Reads a record from a file: the input, the output, and every other numeric column as a separate channel.
///
/// # Errors
/// [`IoError`] with the place in the file.
pub fn read_record(path: &Path, options: &ReadOptions) -> Result<ReadRecord, IoError> {
    read_prepared(path, options, &Preparation::default())
}

/// Reads a record and prepares it for the estimator: units, alignment and rate. With offsets a span keeps its length if
/// the file extends beyond it.
///
/// # Errors
/// [`IoError`] with the place in the file or the preparation step.
pub fn read_prepared(path: &Path, options: &ReadOptions, preparation: &Preparation) -> Result<ReadRecord, IoError> {
    read_aligned(path, options, preparation, 0.0)
}

/// Writes a record: t, then `f_t` if there is one, the input, the output, and the other channels in their order, with
/// enough digits to reproduce the numbers exactly. Units and sample time are written as comments; the label is not
/// written.
///
/// # Errors
/// [`IoError::UnknownFormat`]; [`IoError::ChannelName`] for a channel that could not be read back; the errors of
/// [`write_atomically`].
pub fn write_record(path: &Path, record: &Record) -> Result<(), IoError> {
    let format = format_to_write(path)?;
    check_names(record, || path.display().to_string())?;
    match format.record {
        Some(write) => write_atomically(path, |file| write(file, record)),
        None => write_columns(path, record),
    }
}

/// Writes a record as a table of its channels, with the same comments as in CSV.
fn write_columns(path: &Path, record: &Record) -> Result<(), IoError> {
    let channels = ordered_channels(record);
    let t = record.times_s();
    let names = std::iter::once("t").chain(channels.iter().map(|c| c.name.as_str()));
    let values = std::iter::once(Values::Real(&t)).chain(channels.iter().map(|c| Values::Real(&c.values)));
    let schema = TableSchema {
        comments: comments(record, &channels),
        columns: names
            .map(|name| ColumnSchema {
                name: name.to_owned(),
                kind: ColumnKind::Real,
            })
            .collect(),
    };
    write_values(path, schema, &values.collect::<Vec<_>>())
}

/// Writes a record as CSV to a stream, such as standard output.
///
/// # Errors
/// [`IoError::ChannelName`]; [`IoError::Unwritable`] for an error of `out`. Both refer to the stream as `name`.
pub fn write_record_csv(out: &mut dyn Write, name: &str, record: &Record) -> Result<(), IoError> {
    check_names(record, || name.to_owned())?;
    write_record_as_csv(out, record).map_err(|source| IoError::Unwritable {
        file: name.to_owned(),
        source,
    })
}

fn check_names(record: &Record, file: impl Fn() -> String) -> Result<(), IoError> {
    for name in record.channels().map(|c| c.name.as_str()) {
        let reason = match name {
            "t" => "t is the time of the samples",
            "" => "it has no name",
            padded if padded != padded.trim() => "its name starts or ends with a blank",
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
