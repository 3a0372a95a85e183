//! Small files that are made to unpack to any size: refused in words, in bounded memory.
//!
//! One test, so that the peak of the process is that of the readers.
#![allow(clippy::unwrap_used)]

use std::{
    fs,
    io::{Read as _, Write as _},
    path::{Path, PathBuf},
    sync::Arc,
};

use hoid_io::{read_any_scenario, read_fit, read_table, survey};
use parquet::{
    basic::{Compression, GzipLevel},
    data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type},
    file::{
        metadata::{ParquetMetaDataReader, ParquetMetaDataWriter},
        properties::WriterProperties,
        writer::SerializedFileWriter,
    },
    schema::parser::parse_message_type,
};

/// Most memory of the process, kB, on systems that tell.
const MOST_KB: u64 = 300_000;
/// Rows of a row group.
const GROUP: usize = 1 << 18;

fn peak_kb() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// A file of Parquet of one column, in so many row groups of the same values.
fn parquet(path: &Path, schema: &str, groups: usize, gzip: bool, plain: bool) {
    let compression = match gzip {
        true => Compression::GZIP(GzipLevel::default()),
        false => Compression::UNCOMPRESSED,
    };
    let properties = WriterProperties::builder()
        .set_compression(compression)
        .set_dictionary_enabled(!plain)
        .build();
    let schema = Arc::new(parse_message_type(schema).unwrap());
    let mut writer = SerializedFileWriter::new(fs::File::create(path).unwrap(), schema, Arc::new(properties)).unwrap();
    for _ in 0..groups {
        let mut group = writer.next_row_group().unwrap();
        while let Some(mut column) = group.next_column().unwrap() {
            use parquet::column::writer::ColumnWriter as W;
            match column.untyped() {
                W::DoubleColumnWriter(_) => column
                    .typed::<DoubleType>()
                    .write_batch(&vec![0.0; GROUP], None, None)
                    .map(drop),
                W::Int64ColumnWriter(_) => column
                    .typed::<Int64Type>()
                    .write_batch(&vec![7; GROUP], None, None)
                    .map(drop),
                _ => {
                    let text = ByteArray::from("x".repeat(4000).as_str());
                    let texts = vec![text; GROUP];
                    column
                        .typed::<ByteArrayType>()
                        .write_batch(&texts, None, None)
                        .map(drop)
                }
            }
            .unwrap();
            column.close().unwrap();
        }
        group.close().unwrap();
    }
    writer.close().unwrap();
}

/// A file of one column of 100 numbers, whose page is another: it states what it unpacks to.
fn parquet_page(path: &Path, compression: Compression, unpacked: u32, packed: &[u8]) {
    let schema = Arc::new(parse_message_type("message m { required double e; }").unwrap());
    let properties = WriterProperties::builder()
        .set_compression(compression)
        .set_dictionary_enabled(false)
        .build();
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties)).unwrap();
    let mut group = writer.next_row_group().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    column
        .typed::<DoubleType>()
        .write_batch(&[0.0; 100], None, None)
        .unwrap();
    column.close().unwrap();
    group.close().unwrap();
    let honest = bytes::Bytes::from(writer.into_inner().unwrap());
    // PageHeader { type 0, unpacked, packed, DataPageHeader { 100 values, plain, levels by RLE } }.
    let mut page = vec![0x15, 0, 0x15];
    let put = |page: &mut Vec<u8>, value: u64| {
        let mut rest = 2 * value;
        while rest >= 0x80 {
            page.push(rest as u8 | 0x80);
            rest >>= 7;
        }
        page.push(rest as u8);
    };
    put(&mut page, u64::from(unpacked));
    page.push(0x15);
    put(&mut page, packed.len() as u64);
    page.extend([0x2c, 0x15]);
    put(&mut page, 100);
    page.extend([0x15, 0, 0x15, 6, 0x15, 6, 0, 0]);
    page.extend(packed);
    let metadata = ParquetMetaDataReader::new().parse_and_finish(&honest).unwrap();
    let group = metadata.row_group(0).clone();
    let chunk = group.column(0).clone().into_builder();
    let chunk = chunk
        .set_data_page_offset(4)
        .set_total_compressed_size(page.len() as i64)
        .set_column_index_offset(None)
        .set_offset_index_offset(None)
        .build()
        .unwrap();
    let group = group.into_builder().set_column_metadata(vec![chunk]).build().unwrap();
    let metadata = metadata.into_builder().set_row_groups(vec![group]).build();
    let mut file = [b"PAR1".as_slice(), &page].concat();
    ParquetMetaDataWriter::new(&mut file, &metadata).finish().unwrap();
    fs::write(path, file).unwrap();
}

/// So many zeros in gzip.
fn gzip_of_zeros(count: u64) -> Vec<u8> {
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    std::io::copy(&mut std::io::repeat(0).take(count), &mut packed).unwrap();
    packed.finish().unwrap()
}

/// A member of zeros of an archive, with the head of an array of numpy.
fn npz(path: &Path, bytes: u64) {
    let mut archive = zip::ZipWriter::new(fs::File::create(path).unwrap());
    let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
    archive.start_file("e.npy", options).unwrap();
    let mut head = format!(
        "{{'descr': '<f8', 'fortran_order': False, 'shape': ({},), }}",
        bytes / 8
    );
    while (head.len() + 11) % 64 != 0 {
        head.push(' ');
    }
    head.push('\n');
    archive.write_all(b"\x93NUMPY\x01\x00").unwrap();
    archive.write_all(&(head.len() as u16).to_le_bytes()).unwrap();
    archive.write_all(head.as_bytes()).unwrap();
    std::io::copy(&mut std::io::repeat(0).take(bytes), &mut archive).unwrap();
    archive.finish().unwrap();
}

/// A compressed variable of MATLAB, of zeros.
fn mat(path: &Path, values: u32) {
    let mut file = fs::File::create(path).unwrap();
    let mut head = [b' '; 128];
    head[..19].copy_from_slice(b"MATLAB 5.0 MAT-file");
    head[124..].copy_from_slice(&[0, 1, b'I', b'M']);
    file.write_all(&head).unwrap();
    let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    let word = |n: u32| n.to_le_bytes();
    let data = u64::from(values) * 8;
    let element = [
        [word(14), word(56 + data as u32)].concat(),
        [word(6), word(8), word(6), word(0)].concat(),
        [word(5), word(8), word(values), word(1)].concat(),
        [word(1), word(1), *b"e\0\0\0", word(0)].concat(),
        [word(9), word(data as u32)].concat(),
    ];
    packed.write_all(&element.concat()).unwrap();
    std::io::copy(&mut std::io::repeat(0).take(data), &mut packed).unwrap();
    let packed = packed.finish().unwrap();
    file.write_all(&[word(15), word(packed.len() as u32)].concat()).unwrap();
    file.write_all(&packed).unwrap();
}

#[test]
fn small_files_do_not_unpack_without_a_bound() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| -> PathBuf { directory.path().join(name) };
    parquet(
        &at("constant.parquet"),
        "message m { required double e; }",
        64,
        false,
        false,
    );
    parquet(
        &at("dates.parquet"),
        "message m { required int64 t (TIMESTAMP_MICROS); }",
        64,
        false,
        false,
    );
    parquet(&at("zeros.parquet"), "message m { required double e; }", 64, true, true);
    parquet(
        &at("texts.parquet"),
        "message m { required binary e (UTF8); }",
        1,
        false,
        false,
    );
    let gzip = || Compression::GZIP(GzipLevel::default());
    parquet_page(&at("lying.parquet"), gzip(), 800, &gzip_of_zeros(1 << 30));
    parquet_page(&at("stated.parquet"), Compression::SNAPPY, 2_000_000_000, &[0; 20]);
    parquet_page(&at("honest.parquet"), gzip(), 800, &gzip_of_zeros(800));
    assert_eq!(
        read_table(&at("honest.parquet")).unwrap().column("e").unwrap().len(),
        100
    );
    let many: String = (0..10_001).map(|k| format!("required double c{k}; ")).collect();
    parquet(&at("many.parquet"), &format!("message m {{ {many} }}"), 0, false, false);
    npz(&at("zeros.npz"), 1 << 27);
    mat(&at("zeros.mat"), 1 << 24);
    let header: Vec<String> = (0..10_001).map(|k| format!("c{k}")).collect();
    fs::write(at("many.csv"), format!("{}\n", header.join(","))).unwrap();
    for (name, said) in [
        ("constant.parquet", "unpacks to more than"),
        ("dates.parquet", "unpacks to more than"),
        ("zeros.parquet", "unpacks to more than"),
        ("texts.parquet", "unpacks to more than"),
        ("lying.parquet", "a page is longer than it says"),
        ("stated.parquet", "unpacks to more than"),
        ("many.parquet", "10001"),
        ("zeros.npz", "unpacks to more than"),
        ("zeros.mat", "unpacks to more than"),
        ("many.csv", "10001"),
    ] {
        let path = at(name);
        assert!(fs::metadata(&path).unwrap().len() < 2_000_000, "{name} is no bomb");
        let surveyed = survey(&path).map(drop).unwrap_err().to_string();
        let read = read_table(&path).map(drop).unwrap_err().to_string();
        assert!(surveyed.contains(said), "{name}: {surveyed}");
        assert!(read.contains(said), "{name}: {read}");
    }
    let values = "1.0, ".repeat(5 << 20);
    fs::write(at("long.toml"), format!("x = [{values}]\n")).unwrap();
    let said = read_any_scenario(&at("long.toml")).map(drop).unwrap_err().to_string();
    assert!(said.contains("more than 10 MB of settings"), "{said}");
    fs::write(at("long.json"), format!("{{\"x\": [{values}1]}}")).unwrap();
    let said = read_fit(&at("long.json")).map(drop).unwrap_err().to_string();
    assert!(said.contains("more than 10 MB of settings"), "{said}");
    if let Some(peak) = peak_kb() {
        assert!(peak < MOST_KB, "{peak} kB");
    }
}
