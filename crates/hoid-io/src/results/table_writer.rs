//! Incremental writing of tables: CSV and Parquet in bounded memory, the array formats once all rows are known.

use std::io::{self, Write};
use std::path::Path;

use super::output_table::{ColumnKind, ColumnSchema, ColumnValues, OutputTable, TableSchema, Values};
use crate::IoError;
use crate::formats::{ColumnsWriter, Format, FormatWriter, RowWriter, format_to_write};
use crate::output::{WholeFile, write_atomically};

/// Number of rows written at a time; the contents of the file therefore do not depend on the groups in which rows were
/// appended.
const ROWS_PER_GROUP: usize = 1 << 16;

/// State of a file between two groups of rows.
enum Sink {
    Rows(Box<dyn RowWriter>),
    Columns(BufferedColumns),
}

/// Columns that are kept until all rows are known, since the length of an array is written before its values.
struct BufferedColumns {
    write: ColumnsWriter,
    schema: TableSchema,
    columns: Vec<ColumnValues>,
}

impl Sink {
    fn start(format: &Format, file: &mut dyn Write, schema: TableSchema) -> io::Result<Self> {
        match format.writing {
            FormatWriter::Rows(start) => start(file, &schema).map(Self::Rows),
            FormatWriter::Columns(write) => Ok(Self::Columns(BufferedColumns {
                write,
                columns: schema.columns.iter().map(|column| empty_values(column.kind)).collect(),
                schema,
            })),
            FormatWriter::ReadOnly(what) => Err(io::Error::other(what)),
        }
    }

    fn write_group(&mut self, file: &mut dyn Write, values: &[Values<'_>]) -> io::Result<()> {
        match self {
            Self::Rows(rows) => rows.write_rows(file, values),
            Self::Columns(waiting) => {
                for (column, values) in waiting.columns.iter_mut().zip(values) {
                    extend(column, *values);
                }
                Ok(())
            }
        }
    }

    fn finish(self, file: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::Rows(rows) => rows.finish(file),
            Self::Columns(BufferedColumns { write, schema, columns }) => {
                let values: Vec<Values<'_>> = columns.iter().map(ColumnValues::as_values).collect();
                write(file, &schema, &values)
            }
        }
    }
}

/// Writes columns of equal length.
pub(crate) fn write_values(path: &Path, schema: TableSchema, values: &[Values<'_>]) -> Result<(), IoError> {
    let format = format_to_write(path)?;
    let schema = schema.checked(&path.display().to_string())?;
    let rows = values.first().map_or(0, Values::len);
    if let FormatWriter::Columns(write) = format.writing {
        return write_atomically(path, |file| write(file, &schema, values));
    }
    write_atomically(path, |file| {
        let mut sink = Sink::start(format, file, schema)?;
        for start in (0..rows).step_by(ROWS_PER_GROUP) {
            let end = rows.min(start.saturating_add(ROWS_PER_GROUP));
            let group: Vec<Values<'_>> = values.iter().map(|values| values.slice(start..end)).collect();
            sink.write_group(file, &group)?;
        }
        sink.finish(file)
    })
}

/// A table written incrementally, for studies larger than memory; for NPZ and .mat the rows are kept in memory until
/// the end. The file appears at its path when [`finish`](Self::finish) returns; if the writer is dropped earlier, an
/// existing file is unchanged. The file is identical to the one that [`write_table`](crate::write_table) writes for all
/// rows at once.
pub struct TableWriter {
    file: WholeFile,
    name: String,
    columns: Vec<ColumnSchema>,
    /// State of the file; `None` after an error of the operating system: the file may then contain an incomplete group.
    sink: Option<Sink>,
    /// Rows that do not yet form a full group.
    waiting: Vec<ColumnValues>,
}

impl std::fmt::Debug for TableWriter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TableWriter")
            .field("file", &self.name)
            .finish_non_exhaustive()
    }
}

impl TableWriter {
    /// Creates a file in the format determined by its extension, as in [`write_table`](crate::write_table).
    ///
    /// # Errors
    /// [`IoError::UnknownFormat`]; [`IoError::NoColumns`], [`IoError::DuplicateColumn`] or [`IoError::ChannelName`] for
    /// a schema that cannot be written; [`IoError::Unwritable`] for errors reported by the operating system.
    pub fn create(path: &Path, schema: &TableSchema) -> Result<Self, IoError> {
        let format = format_to_write(path)?;
        let name = path.display().to_string();
        let schema = schema.clone().checked(&name)?;
        let columns = schema.columns.clone();
        let mut file = WholeFile::create(path)?;
        let sink = file.write(|file| Sink::start(format, file, schema))?;
        Ok(Self {
            file,
            name,
            waiting: columns.iter().map(|column| empty_values(column.kind)).collect(),
            columns,
            sink: Some(sink),
        })
    }

    /// Appends the rows of a table with the same columns; its comments are ignored.
    ///
    /// # Errors
    /// [`IoError::ColumnsDiffer`] and [`IoError::ColumnLength`], after which other rows may still be appended;
    /// [`IoError::Unwritable`], after which no more rows can be appended.
    pub fn append(&mut self, table: &OutputTable) -> Result<(), IoError> {
        let schema = table.schema();
        if schema.columns != self.columns {
            return Err(IoError::ColumnsDiffer {
                file: self.name.clone(),
                found: list_of_columns(&schema.columns),
                expected: list_of_columns(&self.columns),
            });
        }
        let rows = table.row_count(&self.name)?;
        let values = table.values();
        let mut start = 0;
        while start < rows {
            let room = ROWS_PER_GROUP.saturating_sub(self.waiting.first().map_or(0, ColumnValues::len));
            let end = rows.min(start.saturating_add(room));
            for (waiting, values) in self.waiting.iter_mut().zip(&values) {
                extend(waiting, values.slice(start..end));
            }
            if end.saturating_sub(start) == room {
                self.write_group()?;
            }
            start = end;
        }
        Ok(())
    }

    /// Completes the file and moves it to its final path.
    ///
    /// # Errors
    /// [`IoError::Unwritable`] for errors reported by the operating system.
    pub fn finish(mut self) -> Result<(), IoError> {
        if self.waiting.iter().any(|waiting| !waiting.is_empty()) {
            self.write_group()?;
        }
        let sink = self.sink.take().ok_or_else(|| unfinished_error(&self.name))?;
        self.file.write(|file| sink.finish(file))?;
        self.file.finish()
    }

    fn write_group(&mut self) -> Result<(), IoError> {
        let mut sink = self.sink.take().ok_or_else(|| unfinished_error(&self.name))?;
        let values: Vec<Values<'_>> = self.waiting.iter().map(ColumnValues::as_values).collect();
        self.file.write(|file| sink.write_group(file, &values))?;
        self.sink = Some(sink);
        for (waiting, column) in self.waiting.iter_mut().zip(&self.columns) {
            *waiting = empty_values(column.kind);
        }
        Ok(())
    }
}

fn unfinished_error(name: &str) -> IoError {
    IoError::Unwritable {
        file: name.to_owned(),
        source: io::Error::other("an earlier write failed"),
    }
}

fn empty_values(kind: ColumnKind) -> ColumnValues {
    match kind {
        ColumnKind::Real => ColumnValues::Real(Vec::new()),
        ColumnKind::Whole => ColumnValues::Whole(Vec::new()),
        ColumnKind::Text => ColumnValues::Text(Vec::new()),
    }
}

fn extend(column: &mut ColumnValues, values: Values<'_>) {
    match (column, values) {
        (ColumnValues::Real(column), Values::Real(values)) => column.extend_from_slice(values),
        (ColumnValues::Whole(column), Values::Whole(values)) => column.extend_from_slice(values),
        (ColumnValues::Text(column), Values::Text(values)) => column.extend_from_slice(values),
        // The kinds of the values were compared above.
        _ => debug_assert!(false, "values of two kinds in one column"),
    }
}

fn list_of_columns(columns: &[ColumnSchema]) -> String {
    let column = |column: &ColumnSchema| {
        let kind = match column.kind {
            ColumnKind::Real => "real",
            ColumnKind::Whole => "whole",
            ColumnKind::Text => "text",
        };
        format!("{} ({kind})", column.name)
    };
    if columns.is_empty() {
        return String::from("no columns");
    }
    columns.iter().map(column).collect::<Vec<_>>().join(", ")
}
