//! Apache Parquet (<https://parquet.apache.org/docs/file-format/>) by the crate `parquet`, for flat
//! tables.
//!
//! | module | contents |
//! |---|---|
//! | `columns` | columns as they were read |
//! | `pages` | decoded pages of a column |
//! | `read` | the columns of a file of any program |
//! | `record` | the table that a record is made of |
//! | `results` | a table of results |
//! | `write` | row groups as they come |

mod columns;
mod pages;
mod read;
mod record;
mod results;
mod write;

use crate::formats::format::{Format, Reading, Writing};

pub(super) const PARQUET: Format = Format {
    name: "Parquet",
    endings: &["parquet", "pq"],
    reading: Reading::Table {
        record: |bytes, file| record::parse(std::mem::take(bytes), file),
        results: results::read,
    },
    writing: Writing::Rows(write::start),
    record: None,
};
