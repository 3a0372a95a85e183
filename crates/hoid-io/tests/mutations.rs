//! A sample of the damaged files of `cargo xtask slow mutations`: no reader panics, and results are
//! valid.
#![allow(clippy::unwrap_used)]

// The command uses the rest of this module.
#[allow(dead_code)]
#[path = "common/mutations/mod.rs"]
mod mutations;

use std::fs;

use mutations::{case, originals::originals, readers};

/// A seed that differs from the default seed of `cargo xtask slow mutations`.
const SEED: u64 = 5;
const CASE_COUNT: u64 = 2000;

#[test]
fn damaged_files_are_read_or_refused() {
    let originals = originals();
    let directory = tempfile::tempdir().unwrap();
    let (mut read, mut refused) = (0, 0);
    for number in 0..CASE_COUNT {
        let case = case(&originals, SEED, number);
        let path = directory.path().join(format!("{number}.{}", case.extension));
        fs::write(&path, &case.bytes).unwrap();
        let answers = readers::read_with_all(&path, case.bytes.len(), case.choice);
        read += answers.read;
        refused += answers.refused;
        fs::remove_file(&path).unwrap();
    }
    // Both successful and rejected reads are frequent.
    assert!(
        read > CASE_COUNT / 2 && refused > CASE_COUNT,
        "{read} read, {refused} refused"
    );
}

#[test]
fn cases_are_reproducible_and_originals_are_readable() {
    let originals = originals();
    for number in 0..50 {
        assert_eq!(
            case(&originals, SEED, number).bytes,
            case(&originals, SEED, number).bytes
        );
    }
    let directory = tempfile::tempdir().unwrap();
    for original in &originals {
        let path = directory.path().join("good").with_extension(original.extension);
        fs::write(&path, &original.bytes).unwrap();
        let answers = readers::read_with_all(&path, original.bytes.len(), 1);
        assert!(answers.read > 0, "{}", original.name);
        if let Some(inside) = &original.inside {
            fs::write(&path, inside.pack()).unwrap();
            assert!(
                readers::read_with_all(&path, original.bytes.len(), 1).read > 0,
                "{} packed",
                original.name
            );
        }
    }
}
