//! A record into the formats of columns.

use std::path::Path;

use hoid_model::Record;

use crate::output_table::{ColumnKind, ColumnSchema, TableSchema, Values};
use crate::table_writer::write_values;
use crate::{IoError, csv_record};

/// Writes a record with the columns and comments of CSV.
pub(crate) fn write(path: &Path, record: &Record) -> Result<(), IoError> {
    let channels = csv_record::channels(record);
    let t = record.times_s();
    let names = std::iter::once("t").chain(channels.iter().map(|c| c.name.as_str()));
    let values = std::iter::once(Values::Real(&t)).chain(channels.iter().map(|c| Values::Real(&c.values)));
    let schema = TableSchema {
        comments: csv_record::comments(record, &channels),
        columns: names
            .map(|name| ColumnSchema {
                name: name.to_owned(),
                kind: ColumnKind::Real,
            })
            .collect(),
    };
    write_values(path, schema, &values.collect::<Vec<_>>())
}
