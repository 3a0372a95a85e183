//! Small files that unpack to any size: rejected with a message, in bounded memory. A sample of the
//! bombs of `cargo xtask slow bombs`.
//!
//! A single test, so that the peak memory of the process is that of the readers.
#![allow(clippy::unwrap_used)]

// Other commands use the rest of both modules.
#[allow(dead_code)]
#[path = "common/bombs/mod.rs"]
mod bombs;
#[path = "common/memory.rs"]
mod memory;
#[allow(dead_code)]
#[path = "common/mutations/mod.rs"]
mod mutations;

use std::{fs, path::PathBuf};

use bombs::{
    FORMATS, mat, npz,
    parquet::{Page, ROWS_PER_GROUP, file_with_columns, file_with_groups, file_with_page},
    run_bomb,
    zeros::{self, MEGABYTE},
};
use hoid_io::{read_any_scenario, read_fit, read_table, survey};
use parquet::basic::{Compression, GzipLevel};

/// Largest memory of the process in kB, on systems that report it.
const MAX_MEMORY_KB: u64 = 300_000;
/// Number of bombs of each format.
const BOMBS_PER_FORMAT: u64 = 5;

#[test]
fn decompression_bombs_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| -> PathBuf { directory.path().join(name) };
    let zipped = |values: usize, unpacked: usize, megabytes: usize| {
        file_with_page(&Page {
            compression: Compression::GZIP(GzipLevel::default()),
            optional: false,
            values: values as u64,
            unpacked: unpacked as u64,
            packed: &zeros::gzip(megabytes),
        })
    };
    let stated = file_with_page(&Page {
        compression: Compression::SNAPPY,
        optional: false,
        values: 100,
        unpacked: 2_000_000_000,
        packed: &[0; 20],
    });
    fs::write(at("honest.parquet"), zipped(MEGABYTE / 8, MEGABYTE, 1)).unwrap();
    let read = read_table(&at("honest.parquet")).unwrap();
    assert_eq!(read.column("e").unwrap().len(), MEGABYTE / 8);
    let header: Vec<String> = (0..10_001).map(|k| format!("c{k}")).collect();
    let unpacks = "unpacks to more than";
    for (name, bytes, message) in [
        (
            "constant.parquet",
            file_with_groups("message m { required double e; }", 64, ROWS_PER_GROUP),
            unpacks,
        ),
        (
            "dates.parquet",
            file_with_groups("message m { required int64 t (TIMESTAMP_MICROS); }", 64, ROWS_PER_GROUP),
            unpacks,
        ),
        (
            "texts.parquet",
            file_with_groups("message m { required binary e (UTF8); }", 1, ROWS_PER_GROUP),
            unpacks,
        ),
        (
            "zeros.parquet",
            zipped(512 * MEGABYTE / 8, 512 * MEGABYTE, 512),
            unpacks,
        ),
        ("lying.parquet", zipped(100, 800, 1024), "a page is longer than stated"),
        ("stated.parquet", stated, unpacks),
        ("many.parquet", file_with_columns(10_001), "10001"),
        (
            "zeros.npz",
            npz::archive(&[npz::member("e", &npz::array_header("<f8", &[16 * MEGABYTE, 0]), 128)]),
            unpacks,
        ),
        (
            "zeros.mat",
            mat::file(&[mat::variable(mat::DOUBLE, [1 << 24, 1], 9, 1 << 27, 128)]),
            unpacks,
        ),
        (
            "texts.npz",
            npz::archive(&[npz::member("e", &npz::array_header("|S1", &[8 * MEGABYTE, 0]), 8)]),
            unpacks,
        ),
        (
            "texts.mat",
            mat::file(&[mat::variable(mat::CHARACTERS, [8 << 20, 1], 2, 8 << 20, 8)]),
            unpacks,
        ),
        ("many.csv", (header.join(",") + "\n").into_bytes(), "10001"),
    ] {
        let path = at(name);
        assert!(bytes.len() < 2_000_000, "{name} is not a bomb");
        fs::write(&path, bytes).unwrap();
        let surveyed = survey(&path).map(drop).unwrap_err().to_string();
        let read = read_table(&path).map(drop).unwrap_err().to_string();
        assert!(surveyed.contains(message), "{name}: {surveyed}");
        assert!(read.contains(message), "{name}: {read}");
    }
    let values = "1.0, ".repeat(3 << 20);
    fs::write(at("long.toml"), format!("x = [{values}]\n")).unwrap();
    let message = read_any_scenario(&at("long.toml")).map(drop).unwrap_err().to_string();
    assert!(message.contains("the settings exceed 2 MB"), "{message}");
    fs::write(at("long.json"), format!("{{\"x\": [{values}1]}}")).unwrap();
    let message = read_fit(&at("long.json")).map(drop).unwrap_err().to_string();
    assert!(message.contains("the settings exceed 10 MB"), "{message}");
    drop(values);
    if let Some(peak) = memory::peak_kb() {
        assert!(peak < MAX_MEMORY_KB, "{peak} kB");
    }
    for (format, ending, maker) in FORMATS {
        let path = at("bomb").with_extension(ending);
        let refused: u64 = (0..BOMBS_PER_FORMAT)
            .map(|k| {
                let refused = run_bomb(&path, maker, k).0.refused;
                let peak = memory::peak_kb().unwrap_or(0);
                assert!(peak < MAX_MEMORY_KB, "{format} {k}: {peak} kB");
                refused
            })
            .sum();
        assert!(refused >= BOMBS_PER_FORMAT / 2, "{format}: {refused} refused");
    }
}
