//! Parquet: wrong page headers, runs of millions of values, excessive numbers of columns and groups.

use std::sync::Arc;

use parquet::{
    basic::{Compression, GzipLevel},
    data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type},
    file::{
        metadata::{FileMetaData, ParquetMetaDataReader, ParquetMetaDataWriter},
        properties::WriterProperties,
        writer::SerializedFileWriter,
    },
    schema::parser::parse_message_type,
};

use super::zeros::{self, MEGABYTE};
use crate::mutations::draw::Draw;

/// Number of rows of a row group.
pub const ROWS_PER_GROUP: usize = 1 << 18;
/// Encodings of the format.
const PLAIN_ENCODING: u64 = 0;
const RUN_LENGTH_ENCODING: u64 = 3;

/// A page with an arbitrary header.
pub struct Page<'a> {
    pub compression: Compression,
    pub optional: bool,
    pub values: u64,
    pub unpacked: u64,
    pub packed: &'a [u8],
}

/// Makes a bomb.
pub fn bomb(draw: &mut Draw) -> Vec<u8> {
    let gzip = || Compression::GZIP(GzipLevel::default());
    let megabytes = 1 << (4 + draw.below(8));
    let values = 1 << (20 + draw.below(12));
    match draw.below(9) {
        // The data decompress to more than the stated size.
        0 => file_with_page(&Page {
            compression: gzip(),
            optional: false,
            values: 100,
            unpacked: 800,
            packed: &zeros::gzip(megabytes),
        }),
        // The stated size exceeds the data.
        1 => file_with_page(&Page {
            compression: *draw.one_of(&[
                gzip(),
                Compression::SNAPPY,
                Compression::LZ4_RAW,
                Compression::UNCOMPRESSED,
            ]),
            optional: false,
            values,
            unpacked: (8 * values).min(i32::MAX as u64),
            packed: &[0; 20],
        }),
        // The data match the header.
        2 => file_with_page(&Page {
            compression: gzip(),
            optional: false,
            values: (megabytes * MEGABYTE / 8) as u64,
            unpacked: (megabytes * MEGABYTE).min(i32::MAX as usize) as u64,
            packed: &zeros::gzip(megabytes),
        }),
        // One run of nulls.
        3 => {
            let mut run = Vec::new();
            append_number(&mut run, values << 1);
            run.push(0);
            let packed = [&(run.len() as u32).to_le_bytes()[..], &run].concat();
            file_with_page(&Page {
                compression: Compression::UNCOMPRESSED,
                optional: true,
                values,
                unpacked: packed.len() as u64,
                packed: &packed,
            })
        }
        4 => file_with_columns(10_001 + draw.below(10_000)),
        5 => file_with_groups("message m { required double e; }", 1000 + draw.below(4000), 0),
        6 => file_with_groups("message m { required binary e (UTF8); }", 1, 1 << (10 + draw.below(9))),
        7 => file_with_groups(
            "message m { required int64 t (TIMESTAMP_MICROS); }",
            1 + draw.below(48),
            ROWS_PER_GROUP,
        ),
        _ => file_with_groups(
            "message m { required double e; required double u; }",
            1 + draw.below(32),
            ROWS_PER_GROUP,
        ),
    }
}

/// A file with a given number of groups with the same values, which are stored only once.
pub fn file_with_groups(schema: &str, groups: usize, rows: usize) -> Vec<u8> {
    let mut writer = writer(schema, Compression::UNCOMPRESSED, true);
    for _ in 0..groups {
        let mut group = writer.next_row_group().unwrap();
        while let Some(mut column) = group.next_column().unwrap() {
            use parquet::column::writer::ColumnWriter as W;
            let written = match column.untyped() {
                W::DoubleColumnWriter(_) => column.typed::<DoubleType>().write_batch(&vec![0.0; rows], None, None),
                W::Int64ColumnWriter(_) => column.typed::<Int64Type>().write_batch(&vec![7; rows], None, None),
                _ => {
                    let texts = vec![ByteArray::from("x".repeat(4000).as_str()); rows];
                    column.typed::<ByteArrayType>().write_batch(&texts, None, None)
                }
            };
            written.unwrap();
            column.close().unwrap();
        }
        group.close().unwrap();
    }
    writer.into_inner().unwrap()
}

/// A file with a given number of columns and no rows.
pub fn file_with_columns(count: usize) -> Vec<u8> {
    let each: String = (0..count).map(|k| format!("required double c{k}; ")).collect();
    file_with_groups(&format!("message m {{ {each} }}"), 0, 0)
}

fn writer(schema: &str, compression: Compression, dictionary: bool) -> SerializedFileWriter<Vec<u8>> {
    let properties = WriterProperties::builder()
        .set_compression(compression)
        .set_dictionary_enabled(dictionary)
        .build();
    let schema = Arc::new(parse_message_type(schema).unwrap());
    SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties)).unwrap()
}

/// Appends a number as in page headers (compact protocol of Thrift: the sign is in the lowest bit, with seven bits per
/// byte).
fn append_signed(page: &mut Vec<u8>, value: u64) {
    append_number(page, value << 1);
}

fn append_number(page: &mut Vec<u8>, mut rest: u64) {
    while rest >= 0x80 {
        page.push(rest as u8 | 0x80);
        rest >>= 7;
    }
    page.push(rest as u8);
}

/// A file with one column, e, of one page.
pub fn file_with_page(of: &Page) -> Vec<u8> {
    let schema = match of.optional {
        true => "message m { optional double e; }",
        false => "message m { required double e; }",
    };
    let mut writer = writer(schema, of.compression, false);
    let mut group = writer.next_row_group().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    let levels = of.optional.then_some(&[1_i16; 100][..]);
    column
        .typed::<DoubleType>()
        .write_batch(&[0.0; 100], levels, None)
        .unwrap();
    column.close().unwrap();
    group.close().unwrap();
    let honest = bytes::Bytes::from(writer.into_inner().unwrap());
    // PageHeader { type 0, unpacked, packed, DataPageHeader { values, encoding, levels by runs } }.
    let mut page = vec![0x15, 0, 0x15];
    append_signed(&mut page, of.unpacked);
    page.push(0x15);
    append_signed(&mut page, of.packed.len() as u64);
    page.extend([0x2c, 0x15]);
    append_signed(&mut page, of.values);
    for encoding in [PLAIN_ENCODING, RUN_LENGTH_ENCODING, RUN_LENGTH_ENCODING] {
        page.push(0x15);
        append_signed(&mut page, encoding);
    }
    page.extend([0, 0]);
    page.extend(of.packed);
    let metadata = ParquetMetaDataReader::new().parse_and_finish(&honest).unwrap();
    let group = metadata.row_group(0).clone();
    let chunk = group.column(0).clone().into_builder();
    let chunk = chunk
        .set_data_page_offset(4)
        .set_num_values(of.values as i64)
        .set_total_compressed_size(page.len() as i64)
        .set_total_uncompressed_size(of.unpacked as i64)
        .set_column_index_offset(None)
        .set_offset_index_offset(None)
        .build()
        .unwrap();
    let rows = of.values as i64;
    let group = group
        .into_builder()
        .set_num_rows(rows)
        .set_column_metadata(vec![chunk])
        .build()
        .unwrap();
    let file_metadata = metadata.file_metadata();
    let file_metadata = FileMetaData::new(
        file_metadata.version(),
        rows,
        None,
        None,
        file_metadata.schema_descr_ptr(),
        None,
    );
    let metadata = parquet::file::metadata::ParquetMetaData::new(file_metadata, vec![group]);
    let mut file = [b"PAR1".as_slice(), &page].concat();
    ParquetMetaDataWriter::new(&mut file, &metadata).finish().unwrap();
    file
}
