//! The C boundary under Miri, an interpreter that checks of every memory access whether the memory is allocated,
//! initialised and not borrowed elsewhere, and of every allocation whether it was freed.
//!
//! It runs the tests of `hoid-ffi` that use raw pointers, with few samples (`cfg(miri)`). Miri is part of the nightly
//! toolchain; if it is missing, the installation command is reported.

use std::process::Command;

use crate::process::{output, run};

/// On x86-64 the mathematical functions are written in assembly, which is not interpreted.
const TARGET: &str = "riscv64gc-unknown-linux-gnu";

/// Tests that only access memory; the others run compilers and other programs.
const TESTS: [&str; 5] = ["--lib", "--test", "every_function", "--test", "hostile"];

/// Interprets the tests; arguments select some of them.
pub fn miri(arguments: &[String]) -> Result<(), String> {
    if let Some(lacking) = lacking() {
        println!("skipped: hoid-ffi under Miri ({lacking})");
        return Ok(());
    }
    // Files are read, and numbers must be reproducible.
    let flags = "-Zmiri-disable-isolation -Zmiri-deterministic-floats";
    run(Command::new("rustup")
        .args(["run", "nightly"])
        .args(["cargo", "miri", "test", "--target", TARGET, "-p", "hoid-ffi"])
        .args(TESTS)
        .arg("--")
        .args(arguments)
        .env("MIRIFLAGS", flags))
}

/// Command that installs missing programs; none if all are installed.
fn lacking() -> Option<&'static str> {
    const INSTALL: &str = "rustup toolchain install nightly --profile minimal --component miri --component rust-src";
    let told = |arguments: &[&str]| output(Command::new("rustup").args(arguments)).unwrap_or_default();
    // `nightly-2026-01-31-...` is a different toolchain.
    let is_nightly = |line: &str| {
        let behind = line.strip_prefix("nightly");
        behind.is_some_and(|behind| !behind.trim_start_matches('-').starts_with(|c: char| c.is_ascii_digit()))
    };
    if !told(&["toolchain", "list"]).lines().any(is_nightly) {
        return Some(INSTALL);
    }
    let components = told(&["component", "list", "--installed", "--toolchain", "nightly"]);
    let has = |name: &str| components.lines().any(|line| line.starts_with(name));
    (!(has("miri") && has("rust-src"))).then_some(INSTALL)
}
