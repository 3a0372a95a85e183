//! Runs `study`, `group` and `track` on 200 disks each, which become full before the output is complete. The program
//! prints the numbers of `research/notes/mutations.md`.
//!
//! `cargo xtask slow full-disks [ROUNDS] [SEED] [study|group|track]`, on Linux, as an administrator.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../../hoid-lab/tests/common/disk.rs"]
#[allow(dead_code)]
mod disk;
#[path = "../tests/common/draw.rs"]
#[allow(dead_code)]
mod draw;
#[path = "../tests/common/full_disks.rs"]
mod full_disks;
#[path = "../tests/common/interrupted.rs"]
mod interrupted;

use std::process::ExitCode;

use draw::Draw;
use full_disks::run_rounds;
use interrupted::{Bench, GROUP, STUDY, TRACK, built_program_path};

fn main() -> ExitCode {
    let number = |k: usize, default: u64| std::env::args().nth(k).map_or(default, |text| text.parse().unwrap());
    let (count, mut draw) = (number(1, 200) as usize, Draw(number(2, 1)));
    let directory = tempfile::tempdir().unwrap();
    let bench = Bench::new(built_program_path(), directory.path());
    let mut failed = false;
    let only = std::env::args().nth(3);
    let mut works = vec![STUDY, GROUP, TRACK];
    works.retain(|work| only.as_ref().is_none_or(|name| name == work.name));
    if works.is_empty() {
        println!("no work of this name, expected study, group or track");
        return ExitCode::FAILURE;
    }
    for work in works {
        let Some(outcome) = run_rounds(&bench, &work, count, &mut draw) else {
            println!("skipped: no disk of its own can be mounted here");
            return ExitCode::SUCCESS;
        };
        println!(
            "{}: {} of {count} disks were full, {} whole blocks on them; {} failures",
            work.name,
            outcome.full,
            outcome.blocks,
            outcome.failures.len()
        );
        outcome.failures.iter().for_each(|failure| println!("{failure}"));
        failed |= !outcome.failures.is_empty();
    }
    if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}
