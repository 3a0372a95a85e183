//! 100 decompression bombs of each format: each is read or refused within 300 MB and 2 s, without a panic. The numbers
//! are those of the page `research/notes/mutations.md`.
//!
//! `cargo xtask slow bombs [COUNT] [FIRST] [DIRECTORY]`; those that fail are left in the directory.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[allow(dead_code)]
#[path = "../tests/common/bombs/mod.rs"]
mod bombs;
#[path = "../tests/common/memory.rs"]
mod memory;
#[allow(dead_code)]
#[path = "../tests/common/mutations/mod.rs"]
mod mutations;

use std::{fs, panic, path::PathBuf, process::ExitCode, time::Duration};

use bombs::{FORMATS, burst};

const MOST_KB: u64 = 300_000;
const LONGEST: Duration = Duration::from_secs(2);

fn main() -> ExitCode {
    let number = |k: usize, default: u64| std::env::args().nth(k).map_or(default, |text| text.parse().unwrap());
    let (count, first) = (number(1, 100), number(2, 0));
    let own = tempfile::tempdir().unwrap();
    let directory = std::env::args().nth(3).map_or(own.path().to_owned(), PathBuf::from);
    fs::create_dir_all(&directory).unwrap();
    let mut failed = false;
    for (format, ending, maker) in FORMATS {
        let (mut read, mut refused, mut slowest, mut largest) = (0, 0, (Duration::ZERO, 0), (0, 0));
        for k in first..first + count {
            let path = directory.join(format!("{format}-{k}.{ending}"));
            let Ok((answers, took)) = panic::catch_unwind(|| burst(&path, maker, k)) else {
                println!("{format} {k}: a panic");
                failed = true;
                continue;
            };
            let peak = memory::peak_kb().unwrap_or(0);
            if took > LONGEST || peak > MOST_KB {
                println!("{format} {k}: {:.1} s, {} MB", took.as_secs_f64(), peak / 1000);
                failed = true;
            } else {
                fs::remove_file(&path).unwrap();
            }
            read += answers.read;
            refused += answers.refused;
            slowest = slowest.max((took, k));
            largest = largest.max((peak, k));
        }
        println!(
            "{format}: {read} answers with values, {refused} with an error; slowest {:.2} s (bomb {}), largest {} MB (bomb {})",
            slowest.0.as_secs_f64(),
            slowest.1,
            largest.0 / 1000,
            largest.1
        );
    }
    if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}
