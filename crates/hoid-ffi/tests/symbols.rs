//! The shared library exports exactly the functions listed in `abi/symbols-N.txt`, where N is the version of the
//! interface.
//!
//! A program that was linked once must find its functions in every later library of the same version, so no function
//! may be removed. The list also prevents accidental exports.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::print_stderr)]

mod common;

use std::{collections::BTreeSet, fs, path::Path, process::Command};

use hoid_ffi::HOID_ABI_VERSION;

fn listed_symbols() -> BTreeSet<String> {
    let file = format!("{}/abi/symbols-{HOID_ABI_VERSION}.txt", env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(Path::new(&file)).unwrap();
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines.map(str::to_owned).collect()
}

#[test]
fn library_exports_the_listed_symbols() {
    let library = common::shared_library();
    let listing = Command::new("nm").args(["-D", "--defined-only"]).arg(&library).output();
    let Ok(listing) = listing else {
        eprintln!("skipped: nm is not here (binutils)");
        return;
    };
    let text = String::from_utf8(listing.stdout).unwrap();
    let symbols: BTreeSet<String> = text
        .lines()
        .filter_map(|line| line.rsplit(' ').next())
        .map(str::to_owned)
        .collect();
    let listed = listed_symbols();
    let vanished: Vec<_> = listed.difference(&symbols).collect();
    assert!(
        vanished.is_empty(),
        "functions vanished, which programs were linked with: {vanished:?}; keep them, or make HOID_ABI_VERSION another"
    );
    let unlisted: Vec<_> = symbols.difference(&listed).collect();
    assert!(
        unlisted.is_empty(),
        "not in abi/symbols-{HOID_ABI_VERSION}.txt, from where nothing is ever taken away: {unlisted:?}"
    );
}

/// All declarations of the header are listed, on every platform.
#[test]
fn header_declares_the_listed_symbols() {
    let header = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/include/hoid.h")).unwrap();
    let ours = listed_symbols().into_iter().filter(|name| name.starts_with("hoid_"));
    let missing: Vec<String> = ours.filter(|name| !header.contains(&format!("{name}("))).collect();
    assert_eq!(missing, Vec::<String>::new());
}
