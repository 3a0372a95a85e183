//! CSV: text with a header and one line per row, separated by commas, semicolons or tabs; `foreign` converts other
//! separators.
//!
//! | module | contents |
//! |---|---|
//! | `foreign` | conversion of files from other programs to plain CSV |
//! | `text` | encoding, comments, separator, lines |
//! | `table`, `plain_rows` | the columns of a record; fast reading of rows of plain numbers |
//! | `line_limit` | the length of a line |
//! | `quotes` | quotation marks that are not closed |
//! | `block_reader` | reading of a long text of plain numbers, block by block |
//! | `span_end` | the row at which reading stops if only a span is requested |
//! | `record` | writing of a record |
//! | `columns` | writing and reading of tables of results |

mod block_reader;
mod columns;
mod foreign;
mod line_limit;
mod plain_rows;
mod quotes;
mod record;
mod span_end;
mod table;
mod text;

pub(super) use block_reader::table as long_table;
pub(super) use foreign::is_table;
pub(super) use line_limit::{LineLimit, read_whole_text};
pub(crate) use record::write_with_commas as write_record;

use crate::formats::format::{Format, FormatReader, FormatWriter};

/// Format that is written with commas and read with any separator.
pub(super) const CSV: Format = Format {
    name: "CSV",
    extensions: &["csv", "txt"],
    reading: TABLE_READER,
    writing: FormatWriter::Rows(columns::start_with_commas),
    record: Some(record::write_with_commas),
};

/// Format that is written with tabs.
pub(super) const TSV: Format = Format {
    name: "CSV",
    extensions: &["tsv"],
    reading: TABLE_READER,
    writing: FormatWriter::Rows(columns::start_with_tabs),
    record: Some(record::write_with_tabs),
};

const TABLE_READER: FormatReader = FormatReader::Table {
    record: |bytes, file, options| {
        let notes = foreign::convert_to_plain_csv(bytes, options);
        let mut table = table::parse(bytes, file)?;
        table.notes.extend(notes);
        Ok(table)
    },
    results: |bytes, file| columns::read(&bytes, file),
};
