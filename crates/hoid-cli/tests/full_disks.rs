//! A sample of the cases of `cargo xtask slow full-disks`.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)]

#[path = "../../hoid-lab/tests/common/disk.rs"]
#[allow(dead_code)]
mod disk;
#[path = "common/draw.rs"]
#[allow(dead_code)]
mod draw;
#[path = "common/full_disks.rs"]
mod full_disks;
#[path = "common/interrupted.rs"]
mod interrupted;

use draw::Draw;
use full_disks::run_rounds;
use interrupted::{Bench, GROUP, STUDY, TRACK};

#[test]
fn full_disk_leaves_complete_files_and_resumable_blocks() {
    let directory = tempfile::tempdir().unwrap();
    let bench = Bench::new(env!("CARGO_BIN_EXE_hoid").into(), directory.path());
    let mut draw = Draw(54);
    for (work, count) in [(STUDY, 3), (GROUP, 6), (TRACK, 4)] {
        let Some(outcome) = run_rounds(&bench, &work, count, &mut draw) else {
            eprintln!("skipped: no disk of its own can be mounted here");
            return;
        };
        assert!(outcome.failures.is_empty(), "{:#?}", outcome.failures);
        assert!(outcome.full >= count / 2, "{}: {outcome:?}", work.name);
        assert!(outcome.blocks > 0 || !work.has_parts, "{}: {outcome:?}", work.name);
    }
}
