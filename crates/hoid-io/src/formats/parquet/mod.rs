//! Apache Parquet (<https://parquet.apache.org/docs/file-format/>) for flat tables, with the crate `parquet`.
//!
//! | module | contents |
//! |---|---|
//! | `columns` | columns as read |
//! | `pages` | size of the decompressed pages of a column |
//! | `read` | reading of the columns of a file written by any program |
//! | `record` | the table from which a record is made |
//! | `results` | reading of a table of results |
//! | `write` | writing in row groups |

mod columns;
mod pages;
mod read;
mod record;
mod results;
mod write;

use crate::formats::format::{Format, FormatReader, FormatWriter};

pub(super) const PARQUET: Format = Format {
    name: "Parquet",
    extensions: &["parquet", "pq"],
    reading: FormatReader::Table {
        record: |bytes, file, _| record::parse(std::mem::take(bytes), file),
        results: results::read,
    },
    writing: FormatWriter::Rows(write::start),
    record: None,
};
