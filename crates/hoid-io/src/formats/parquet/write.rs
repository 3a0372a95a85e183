//! Writing of a Parquet file in row groups, with plain encoding and Snappy compression, which every reader supports.
//!
//! The same columns give the same bytes: the file contains no time of writing and no path.

use std::io::{self, Write};
use std::mem;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::Result;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties, WriterVersion};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::columns::COMMENTS_KEY;
use crate::formats::format::RowWriter;
use crate::results::{ColumnKind, ColumnSchema, TableSchema, Values};

const CREATED_BY: &str = concat!("hoid version ", env!("CARGO_PKG_VERSION"));

/// State of a Parquet file between its row groups.
struct Writer {
    /// Writes to memory, from which each row group is copied to the file, since the file is borrowed only during each
    /// call.
    inner: SerializedFileWriter<Vec<u8>>,
}

/// Starts a file.
pub(super) fn start(file: &mut dyn Write, schema: &TableSchema) -> io::Result<Box<dyn RowWriter>> {
    Ok(Box::new(Writer::start(file, schema)?))
}

impl RowWriter for Writer {
    /// Writes a row group.
    fn write_rows(&mut self, file: &mut dyn Write, columns: &[Values<'_>]) -> io::Result<()> {
        self.append(columns)?;
        self.write_buffered(file)
    }

    fn finish(self: Box<Self>, file: &mut dyn Write) -> io::Result<()> {
        file.write_all(&self.inner.into_inner()?)
    }
}

impl Writer {
    fn start(file: &mut dyn Write, schema: &TableSchema) -> io::Result<Self> {
        let comments = (!schema.comments.is_empty())
            .then(|| vec![KeyValue::new(COMMENTS_KEY.to_owned(), schema.comments.join("\n"))]);
        let properties = WriterProperties::builder()
            .set_writer_version(WriterVersion::PARQUET_1_0)
            .set_created_by(CREATED_BY.to_owned())
            .set_compression(Compression::SNAPPY)
            .set_dictionary_enabled(false)
            .set_statistics_enabled(EnabledStatistics::None)
            .set_offset_index_disabled(true)
            .set_key_value_metadata(comments)
            .build();
        let fields: Result<_> = schema
            .columns
            .iter()
            .map(|column| schema_field(column).map(Arc::new))
            .collect();
        let schema = Type::group_type_builder("schema").with_fields(fields?).build()?;
        let inner = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties))?;
        let mut writer = Self { inner };
        writer.write_buffered(file)?;
        Ok(writer)
    }

    fn append(&mut self, columns: &[Values<'_>]) -> Result<()> {
        let mut group = self.inner.next_row_group()?;
        for values in columns {
            let Some(mut column) = group.next_column()? else { break };
            match values {
                Values::Real(values) => {
                    let levels: Vec<i16> = values.iter().map(|value| i16::from(!value.is_nan())).collect();
                    let values: Vec<f64> = values.iter().copied().filter(|value| !value.is_nan()).collect();
                    column.typed::<DoubleType>().write_batch(&values, Some(&levels), None)?;
                }
                Values::Whole(values) => {
                    let values: Vec<i64> = values.iter().map(|value| value.cast_signed()).collect();
                    column.typed::<Int64Type>().write_batch(&values, None, None)?;
                }
                Values::Text(values) => {
                    let values: Vec<ByteArray> = values.iter().map(|text| text.as_str().into()).collect();
                    column.typed::<ByteArrayType>().write_batch(&values, None, None)?;
                }
            }
            column.close()?;
        }
        group.close()?;
        Ok(())
    }

    fn write_buffered(&mut self, file: &mut dyn Write) -> io::Result<()> {
        self.inner.flush()?;
        file.write_all(&mem::take(self.inner.inner_mut()))
    }
}

/// A column of the schema.
fn schema_field(column: &ColumnSchema) -> Result<Type> {
    let (physical, logical, repetition) = match column.kind {
        ColumnKind::Real => (Physical::DOUBLE, None, Repetition::OPTIONAL),
        ColumnKind::Whole => (
            Physical::INT64,
            Some(LogicalType::integer(64, false)),
            Repetition::REQUIRED,
        ),
        ColumnKind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String), Repetition::REQUIRED),
    };
    Type::primitive_type_builder(&column.name, physical)
        .with_repetition(repetition)
        .with_logical_type(logical)
        .build()
}
