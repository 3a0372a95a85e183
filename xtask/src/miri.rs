//! The C boundary under Miri, an interpreter that checks for every memory access whether the memory is allocated,
//! initialised and not borrowed elsewhere, and for every allocation whether it is freed.
//!
//! The tests of `hoid-ffi` that use raw pointers are run with few samples (`cfg(miri)`). Miri is part of the nightly
//! toolchain; if it is missing, the installation command is reported.

use std::process::Command;

use crate::process::{output, run};

/// Target that Miri interprets: on x86-64 the mathematical functions are written in assembly, which Miri cannot
/// interpret.
const MIRI_TARGET: &str = "riscv64gc-unknown-linux-gnu";

/// Tests that only access memory; the other tests run compilers and other programs.
const TEST_ARGUMENTS: [&str; 5] = ["--lib", "--test", "every_function", "--test", "hostile"];

/// Runs the tests under Miri; arguments select some of the tests.
pub fn miri(arguments: &[String]) -> Result<(), String> {
    if let Some(lacking) = install_command() {
        println!("skipped: hoid-ffi under Miri ({lacking})");
        return Ok(());
    }
    // The tests read files, and their results must be reproducible.
    let flags = "-Zmiri-disable-isolation -Zmiri-deterministic-floats";
    run(Command::new("rustup")
        .args(["run", "nightly"])
        .args(["cargo", "miri", "test", "--target", MIRI_TARGET, "-p", "hoid-ffi"])
        .args(TEST_ARGUMENTS)
        .arg("--")
        .args(arguments)
        .env("MIRIFLAGS", flags))
}

/// Returns the command that installs missing programs; `None` if all programs are installed.
fn install_command() -> Option<&'static str> {
    const INSTALL: &str = "rustup toolchain install nightly --profile minimal --component miri --component rust-src";
    let told = |arguments: &[&str]| output(Command::new("rustup").args(arguments)).unwrap_or_default();
    // A name such as `nightly-2026-01-31-...` belongs to a different toolchain.
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
