//! `study`, `group` and `track` on disks that become full before the output is complete: existing files are complete,
//! earlier blocks are kept, and on another disk the resumed command gives the files of an undisturbed run.
//!
//! The size of a disk is random, between a page and the largest size of a whole run, so the disk becomes full at a
//! random write.

use std::fs;

use crate::{
    disk::{Disk, copy_folder},
    draw::Draw,
    interrupted::{Bench, Work, compare, read_files},
};

/// Size of a page of a disk, kB.
const PAGE_KB: usize = 4;

/// Result of the rounds.
#[derive(Debug, Default)]
pub struct Outcome {
    /// Number of rounds whose disk was full.
    pub full: usize,
    /// Number of complete blocks found on the disks.
    pub blocks: usize,
    pub failures: Vec<String>,
}

/// Runs a number of rounds of a work; `None` if no separate disk can be mounted.
pub fn run_rounds(bench: &Bench, work: &Work, count: usize, draw: &mut Draw) -> Option<Outcome> {
    let whole = bench.output_path(work, "whole");
    fs::create_dir_all(&whole).unwrap();
    bench.run_to_end(work, "whole");
    let expected = read_files(&whole);
    let bytes = |all: &std::collections::BTreeMap<_, Vec<u8>>| all.values().map(Vec::len).sum::<usize>();
    // The disk contains the blocks in addition to the tables made from them.
    let largest_kb = PAGE_KB * (expected.len() + 2) + (1 + usize::from(work.has_parts)) * bytes(&expected) / 1024;
    let at = bench.at.join("disk");
    fs::create_dir_all(&at).unwrap();
    let mut outcome = Outcome::default();
    for round in 0..count {
        let kilobytes = PAGE_KB * (1 + draw.integer_below(largest_kb / PAGE_KB));
        let disk = Disk::mount(&at, kilobytes)?;
        let what = format!("{} {round}, {kilobytes} kB", work.name);
        let mut fail = |said: String| outcome.failures.push(format!("{what}: {said}"));
        let run = bench.command(work, &at).output().unwrap();
        let said = String::from_utf8_lossy(&run.stderr).into_owned();
        let place = bench.output_path(work, "moved");
        copy_folder(&at, &place);
        drop(disk);
        if run.status.success() {
            compare(&expected, &place, &what).into_iter().for_each(&mut fail);
            fs::remove_dir_all(&place).unwrap();
            continue;
        }
        outcome.full += 1;
        if run.status.code() != Some(1) || !said.contains("No space left") || !said.contains("free space") {
            fail(format!("{}: {said}", run.status));
        }
        let left = read_files(&place);
        for (path, bytes) in &left {
            let name = path.file_name().unwrap().to_string_lossy();
            if name.starts_with('.') {
                fail(format!("{name} is left"));
            } else if name == "study.json" || name == "group.json" {
                // The file contains the progress, so it may differ, but it must be valid.
                if serde_json::from_slice::<serde_json::Value>(bytes).is_err() {
                    fail(format!("{name} is not whole"));
                }
            } else if expected.get(path).is_some_and(|whole| whole != bytes) {
                fail(format!("{} is not whole", path.display()));
            }
        }
        outcome.blocks += left
            .keys()
            .filter(|path| path.to_string_lossy().ends_with("-seal.json"))
            .count();
        let again = bench.command(work, &place).output().unwrap();
        let said = String::from_utf8_lossy(&again.stderr).into_owned();
        if !again.status.success() || said.contains("damaged") {
            fail(format!("continues with {}: {said}", again.status));
        }
        compare(&expected, &place, &what).into_iter().for_each(&mut fail);
        fs::remove_dir_all(&place).unwrap();
    }
    Some(outcome)
}
