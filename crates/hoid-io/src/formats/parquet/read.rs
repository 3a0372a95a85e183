//! Reading of Parquet tables written by any program.
//!
//! The file is not trusted: values are read in parts, so that memory grows with the decoded data and not with the
//! stated size, and a panic of the crate `parquet` is reported as an error.

use bytes::Bytes;
use half::f16;
use parquet::basic::{Compression, ConvertedType, LogicalType, TimeUnit, Type};
use parquet::column::reader::get_typed_column_reader;
use parquet::data_type::{
    BoolType, ByteArrayType, DataType, DoubleType, FixedLenByteArrayType, FloatType, Int32Type, Int64Type, Int96,
    Int96Type,
};
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::{ColumnDescPtr, ColumnDescriptor};

use super::{
    columns::{COMMENTS_KEY, ColumnData, ReadColumn, ReadFile},
    pages,
};
use crate::IoError;
use crate::formats::budget::Budget;
use crate::formats::panic_isolation::guard_read;
use crate::table::check_column_count;
use crate::wording::{abbreviate, quote_start, short_error};

/// Magic bytes at the start and the end of a file.
const MAGIC: &[u8; 4] = b"PAR1";
/// Maximum number of rows (a month at 100 samples/s); files with more rows are rejected before they exhaust the memory.
const MAX_ROWS: usize = 1 << 28;
const TIME_DESCRIPTION: &str = "a date or time";
/// Number of ns in a µs and in a ms.
const NS_PER_US: i64 = 1_000;
const NS_PER_MS: i64 = 1_000_000;
/// Memory in bytes of a value (as a number and as the index of a missing value), or of a string without its characters.
const VALUE_BYTES: u64 = 16;
const TEXT_BYTES: u64 = 24;
/// Number of values read at a time.
const VALUES_PER_READ: usize = 1 << 16;

/// Reads the columns from the bytes of a file.
pub(super) fn read(bytes: Vec<u8>, file: &str) -> Result<ReadFile, IoError> {
    check_magic(&bytes, file)?;
    guard_read(file, || read_columns(bytes.into(), file))
}

/// Checks that the file is a Parquet file; the error describes the actual contents.
fn check_magic(bytes: &[u8], file: &str) -> Result<(), IoError> {
    let file = || file.to_owned();
    let found = if bytes.is_empty() {
        String::from("it is empty")
    } else if bytes.starts_with(b"PARE") {
        return Err(IoError::Unsupported {
            file: file(),
            found: String::from("it is encrypted"),
            remedy: "write it without encryption",
        });
    } else if !bytes.starts_with(MAGIC) {
        quote_start(bytes)
    } else if bytes.len() < 12 {
        String::from("it ends after its first bytes")
    } else if !bytes.ends_with(MAGIC) {
        return Err(IoError::Damaged {
            file: file(),
            found: String::from("it is truncated: its end, which gives the positions of the columns, is missing"),
        });
    } else {
        return Ok(());
    };
    Err(IoError::NotParquet { file: file(), found })
}

fn read_columns(bytes: Bytes, file: &str) -> Result<ReadFile, IoError> {
    let size = bytes.len();
    let damaged = |found: String| IoError::Damaged {
        file: file.to_owned(),
        found,
    };
    let reader = SerializedFileReader::new(bytes.clone()).map_err(|error| damaged(short_error(&error.to_string())))?;
    let footer = reader.metadata().file_metadata();
    let count = |rows: i64| usize::try_from(rows).map_err(|_| damaged(format!("it states {rows} rows")));
    let rows = count(footer.num_rows())?;
    if rows > MAX_ROWS {
        return Err(IoError::Unsupported {
            file: file.to_owned(),
            found: format!("it holds {rows} rows, more than {MAX_ROWS}"),
            remedy: "write it in parts",
        });
    }
    let leaves = footer.schema_descr().num_columns();
    check_column_count(leaves, file)?;
    let mut budget = Budget::of(size);
    for group in reader.metadata().row_groups() {
        for chunk in group.columns() {
            budget.take(u64::try_from(chunk.uncompressed_size()).unwrap_or(u64::MAX), file)?;
        }
    }
    // All columns are converted to numbers, including those that are not used.
    budget.take(
        (rows as u64).saturating_mul(VALUE_BYTES).saturating_mul(leaves as u64),
        file,
    )?;
    let mut grouped = 0_usize;
    for group in reader.metadata().row_groups() {
        grouped = grouped.saturating_add(count(group.num_rows())?);
    }
    if grouped != rows {
        return Err(damaged(format!("{rows} rows in total, {grouped} in the row groups")));
    }
    for (number, group) in reader.metadata().row_groups().iter().enumerate() {
        for chunk in group.columns() {
            let place = || {
                let name = chunk.column_path().string();
                format!("column {}, row group {}", abbreviate(&name), number.saturating_add(1))
            };
            if chunk.file_path().is_some() {
                continue;
            }
            let start = chunk.dictionary_page_offset().unwrap_or(chunk.data_page_offset());
            let end = start.saturating_add(chunk.compressed_size());
            let place_of = |at: i64| usize::try_from(at).map_or(0, |at| at.min(size));
            let pages = bytes.get(place_of(start)..place_of(end)).unwrap_or_default();
            let values = u64::try_from(chunk.num_values()).unwrap_or(0);
            let Some(stated) = pages::decompressed_size(pages, chunk.compression(), values) else {
                return Err(damaged(format!(
                    "{}: a page is longer than stated, or its length is not stated",
                    place()
                )));
            };
            // The budget already includes the size stated in the footer.
            let counted = u64::try_from(chunk.uncompressed_size()).unwrap_or(0);
            budget.take(stated.saturating_sub(counted), file)?;
        }
    }
    let mut column = |(index, descriptor): (usize, &ColumnDescPtr)| {
        let parts: Vec<&str> = descriptor.path().parts().iter().map(|part| part.trim()).collect();
        let mut leaf = LeafColumn {
            reader: &reader,
            file,
            index,
            name: parts.join("."),
            nulls: Vec::new(),
            budget: &mut budget,
        };
        Ok(ReadColumn {
            data: leaf.read_data(descriptor)?,
            name: leaf.name,
            single: descriptor.physical_type() == Type::FLOAT
                || descriptor.logical_type_ref() == Some(&LogicalType::Float16),
            nulls: leaf.nulls,
        })
    };
    let leaves = footer.schema_descr().columns().iter().enumerate();
    let pairs = footer.key_value_metadata().into_iter().flatten();
    let comments = pairs
        .filter(|pair| pair.key == COMMENTS_KEY)
        .find_map(|pair| pair.value.as_ref());
    Ok(ReadFile {
        columns: leaves.map(&mut column).collect::<Result<_, IoError>>()?,
        rows,
        comments: comments.map_or_else(Vec::new, |text| text.split('\n').map(str::to_owned).collect()),
    })
}

/// A column in all row groups of a file.
struct LeafColumn<'a> {
    reader: &'a SerializedFileReader<Bytes>,
    file: &'a str,
    index: usize,
    name: String,
    nulls: Vec<usize>,
    budget: &'a mut Budget,
}

impl LeafColumn<'_> {
    /// Reads the values by their converted type, which the crate `parquet` derives from the logical type where the two
    /// are equivalent, and otherwise by their logical type.
    fn read_data(&mut self, column: &ColumnDescriptor) -> Result<ColumnData, IoError> {
        use ConvertedType as C;
        let unit = 10_f64.powi(column.type_scale());
        let logical = column.logical_type_ref();
        if column.max_rep_level() > 0 {
            return Ok(ColumnData::Unread("a list"));
        }
        Ok(match (column.physical_type(), column.converted_type()) {
            (Type::BOOLEAN, _) => ColumnData::Signed(self.read_values::<BoolType, _>(|value| i64::from(*value))?),
            (Type::FLOAT, _) => ColumnData::Real(self.read_values::<FloatType, _>(|value| f64::from(*value))?),
            (Type::DOUBLE, _) => ColumnData::Real(self.read_values::<DoubleType, _>(|value| *value)?),
            (Type::INT96, _) => ColumnData::Moments(self.read_values::<Int96Type, _>(Int96::to_nanos)?),
            (Type::INT32, C::TIME_MILLIS) => {
                ColumnData::Moments(self.read_values::<Int32Type, _>(|ms| i64::from(*ms).saturating_mul(NS_PER_MS))?)
            }
            (Type::INT64, _) if let Some(unit_ns) = clock_ns(column) => {
                ColumnData::Moments(self.read_values::<Int64Type, _>(|value| value.saturating_mul(unit_ns))?)
            }
            (_, C::DATE | C::TIME_MILLIS | C::TIME_MICROS | C::TIMESTAMP_MILLIS | C::TIMESTAMP_MICROS) => {
                ColumnData::Unread(TIME_DESCRIPTION)
            }
            (Type::INT32, C::DECIMAL) => {
                ColumnData::Real(self.read_values::<Int32Type, _>(|value| f64::from(*value) / unit)?)
            }
            (Type::INT64, C::DECIMAL) => {
                ColumnData::Real(self.read_values::<Int64Type, _>(|value| *value as f64 / unit)?)
            }
            (Type::INT32, C::UINT_8 | C::UINT_16 | C::UINT_32) => {
                ColumnData::Unsigned(self.read_values::<Int32Type, _>(|value| u64::from(value.cast_unsigned()))?)
            }
            (Type::INT64, C::UINT_64) => {
                ColumnData::Unsigned(self.read_values::<Int64Type, _>(|value| value.cast_unsigned())?)
            }
            (Type::INT32, _) => ColumnData::Signed(self.read_values::<Int32Type, _>(|value| i64::from(*value))?),
            (Type::INT64, _) => ColumnData::Signed(self.read_values::<Int64Type, _>(|value| *value)?),
            (Type::FIXED_LEN_BYTE_ARRAY, C::DECIMAL) if column.type_length() <= 16 => ColumnData::Real(
                self.read_values::<FixedLenByteArrayType, _>(|value| big_endian_integer(value.data()) as f64 / unit)?,
            ),
            (_, C::DECIMAL) => ColumnData::Unread("decimal numbers of variable length or more than 16 bytes"),
            (Type::FIXED_LEN_BYTE_ARRAY, _) if logical == Some(&LogicalType::Float16) => {
                ColumnData::Real(self.read_values::<FixedLenByteArrayType, _>(|value| f16_to_f64(value.data()))?)
            }
            (Type::BYTE_ARRAY, C::UTF8 | C::ENUM | C::JSON) => ColumnData::Text(
                self.read_values::<ByteArrayType, _>(|value| String::from_utf8_lossy(value.data()).into_owned())?,
            ),
            _ => ColumnData::Unread("binary data"),
        })
    }

    /// Returns one value per row; the rows of missing values are recorded.
    fn read_values<T: DataType, V: Default + OwnedMemory>(
        &mut self,
        of: impl Fn(&T::T) -> V,
    ) -> Result<Vec<V>, IoError> {
        let mut values = Vec::new();
        for group in 0..self.reader.num_row_groups() {
            self.read_group::<T, V>(group, &of, &mut values)
                .map_err(|error| self.error(group, error))?;
        }
        Ok(values)
    }

    fn read_group<T: DataType, V: Default + OwnedMemory>(
        &mut self,
        group: usize,
        of: &impl Fn(&T::T) -> V,
        values: &mut Vec<V>,
    ) -> Result<(), ParquetError> {
        let metadata = self.reader.metadata().row_group(group);
        let chunk = metadata.column(self.index);
        match chunk.compression() {
            Compression::ZSTD(_) => return Err(unsupported_error("is compressed with Zstandard")),
            Compression::BROTLI(_) => return Err(unsupported_error("is compressed with Brotli")),
            Compression::LZO => return Err(unsupported_error("is compressed with LZO")),
            _ if chunk.file_path().is_some() => return Err(unsupported_error("keeps its values in another file")),
            _ => {}
        }
        if chunk.num_values() != metadata.num_rows() {
            let (found, rows) = (chunk.num_values(), metadata.num_rows());
            return Err(ParquetError::General(format!("{found} values in {rows} rows")));
        }
        let defined = chunk.column_descr().max_def_level();
        let end = values.len().saturating_add(metadata.num_rows() as usize);
        let group = self.reader.get_row_group(group)?;
        let mut reader = get_typed_column_reader::<T>(group.get_column_reader(self.index)?);
        let (mut levels, mut stored) = (Vec::new(), Vec::new());
        while values.len() < end {
            levels.clear();
            stored.clear();
            let wanted = VALUES_PER_READ.min(end.saturating_sub(values.len()));
            let (rows, ..) = reader.read_records(wanted, Some(&mut levels), None, &mut stored)?;
            if rows != wanted {
                let missing = end.saturating_sub(values.len()).saturating_sub(rows);
                return Err(ParquetError::EOF(format!("{missing} values are missing")));
            }
            let first = values.len();
            if defined == 0 {
                values.extend(stored.iter().map(of));
                self.reserve_for_values(values.get(first..).unwrap_or_default())?;
                continue;
            }
            let mut stored = stored.iter();
            for level in &levels {
                let value = if *level == defined { stored.next() } else { None };
                if value.is_none() {
                    self.nulls.push(values.len());
                }
                values.push(value.map_or_else(V::default, of));
            }
            self.reserve_for_values(values.get(first..).unwrap_or_default())?;
        }
        Ok(())
    }

    /// Reserves the memory that the values own outside their vector.
    fn reserve_for_values<V: OwnedMemory>(&mut self, values: &[V]) -> Result<(), ParquetError> {
        let bytes = values.iter().map(OwnedMemory::owned_bytes).sum();
        let taken = self.budget.take(bytes, self.file);
        taken.map_err(|error| ParquetError::External(Box::new(error)))
    }

    /// Converts an error of the crate `parquet` and adds the column and the row group.
    fn error(&self, group: usize, error: ParquetError) -> IoError {
        let file = self.file.to_owned();
        let place = format!(
            "column {}, row group {}",
            abbreviate(&self.name),
            group.saturating_add(1)
        );
        match error {
            ParquetError::NYI(what) => IoError::Unsupported {
                file,
                found: format!("{place} {what}"),
                remedy: "write it again as one file with Snappy compression, as pandas and DuckDB do by default",
            },
            ParquetError::External(error) => match error.downcast::<IoError>() {
                Ok(own) => *own,
                Err(error) => IoError::Damaged {
                    file,
                    found: format!("{place}: {}", short_error(&error.to_string())),
                },
            },
            error => IoError::Damaged {
                file,
                found: format!("{place}: {}", short_error(&error.to_string())),
            },
        }
    }
}

/// Memory that a value owns outside the vector in which it is stored.
trait OwnedMemory {
    /// Returns this memory in bytes.
    fn owned_bytes(&self) -> u64 {
        0
    }
}

impl OwnedMemory for f64 {}
impl OwnedMemory for i64 {}
impl OwnedMemory for u64 {}

impl OwnedMemory for String {
    fn owned_bytes(&self) -> u64 {
        TEXT_BYTES.saturating_add(self.len() as u64)
    }
}

/// Returns the unit of a column of clock times in ns; `None` if the column does not contain clock times.
fn clock_ns(column: &ColumnDescriptor) -> Option<i64> {
    let unit = match column.logical_type_ref() {
        Some(LogicalType::Timestamp(clock)) => &clock.unit,
        Some(LogicalType::Time(clock)) => &clock.unit,
        _ => {
            return match column.converted_type() {
                ConvertedType::TIMESTAMP_MILLIS => Some(NS_PER_MS),
                ConvertedType::TIMESTAMP_MICROS | ConvertedType::TIME_MICROS => Some(NS_PER_US),
                _ => None,
            };
        }
    };
    Some(match unit {
        TimeUnit::MILLIS => NS_PER_MS,
        TimeUnit::MICROS => NS_PER_US,
        TimeUnit::NANOS => 1,
    })
}

/// Creates the error for valid but unsupported content.
fn unsupported_error(what: &str) -> ParquetError {
    ParquetError::NYI(what.to_owned())
}

/// Converts an IEEE 754 binary16 number, little-endian.
fn f16_to_f64(bytes: &[u8]) -> f64 {
    <[u8; 2]>::try_from(bytes).map_or(f64::NAN, |bytes| f16::from_le_bytes(bytes).to_f64())
}

/// Converts a big-endian integer of up to 16 bytes.
fn big_endian_integer(bytes: &[u8]) -> i128 {
    let negative = bytes.first().is_some_and(|first| *first >= 0x80);
    let sign = if negative { -1 } else { 0_i128 };
    bytes.iter().fold(sign, |value, byte| value << 8 | i128::from(*byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn big_endian_integers_are_decoded() {
        assert_eq!(big_endian_integer(&[]), 0);
        assert_eq!(big_endian_integer(&[0xff, 0xfe]), -2);
        assert_eq!(big_endian_integer(&[0x01, 0x00]), 256);
        assert_eq!(big_endian_integer(&i128::MIN.to_be_bytes()), i128::MIN);
    }
}
