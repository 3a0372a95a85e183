//! Time and memory of reading a long CSV file: all columns, those of the signals, a span. The numbers are those of the
//! page `research/notes/speed.md`.
//!
//! `cargo xtask slow long-csv [ROWS] [FILE]`; a file that is not there is made.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[allow(dead_code)]
#[path = "../tests/common/memory.rs"]
mod memory;

use std::{
    fs::{self, File},
    io::{BufWriter, Write},
    path::{Path, PathBuf},
    time::Instant,
};

use hoid_io::{ReadOptions, read_record, survey};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let rows: u32 = arguments.next().map_or(10_000_000, |text| text.parse().unwrap());
    let own = tempfile::tempdir().unwrap();
    let path = arguments.next().map_or(own.path().join("long.csv"), PathBuf::from);
    if !path.exists() {
        write(&path, rows);
    }
    let signals = ReadOptions {
        columns: Some(Vec::new()),
        ..ReadOptions::default()
    };
    let span = |from: f64| ReadOptions {
        span_s: (Some(from), Some(from + 100.0)),
        ..ReadOptions::default()
    };
    println!("reading                          s   s of processor       MB  samples");
    for (name, options) in [
        ("from 0 to 100 s", span(0.0)),
        ("from 50 000 to 50 100 s", span(50_000.0)),
        ("e and u", signals),
        ("all columns", ReadOptions::default()),
    ] {
        timed(name, || read_record(&path, &options).unwrap().record.len());
    }
    timed("survey of all columns", || survey(&path).unwrap().columns[0].rows);
}

fn timed(name: &str, read: impl FnOnce() -> usize) {
    memory::forget_peak();
    let (start, before) = (Instant::now(), processor_s());
    let samples = read();
    let (took, spent) = (start.elapsed().as_secs_f64(), processor_s() - before);
    let megabytes = memory::peak_kb().unwrap_or(0) / 1000;
    println!("{name:<26} {took:>8.2} {spent:>16.2} {megabytes:>8} {samples:>9}");
}

/// Processor time of all threads, s, on systems that report it.
fn processor_s() -> f64 {
    let stat = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let ticks = stat
        .rsplit(')')
        .next()
        .unwrap_or_default()
        .split_whitespace()
        .skip(11)
        .take(2);
    ticks.filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// A tracking run of five columns at 100 Hz, with seven digits.
fn write(path: &Path, rows: u32) {
    let mut file = BufWriter::new(File::create(path).unwrap());
    writeln!(file, "t,e,u,x,n").unwrap();
    let mut state = 1_u64;
    let mut noise = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / f64::from(1 << 23) - 1.0
    };
    for row in 0..rows {
        let t = f64::from(row) / 100.0;
        let (e, n) = ((0.3 * t).sin() + 0.2 * noise(), noise());
        let u = 0.5 * e + 0.1 * n;
        writeln!(file, "{t:.2},{e:.7},{u:.7},{:.7},{n:.7}", e - u).unwrap();
    }
}
