//! Everywhere hoid runs: one run through each place, its digits beside those of `hoid track`, the time of a sample
//! and what is shipped, as a table between the markers of the page "In your simulator".
//!
//! The places stand in `python/tests/places`, which the tests run too (`test_places.py`); here is what they
//! need, built as it is released. What is not installed is a row of the table that says so.

use std::{env, process::Command};

use crate::{
    embedded::CORTEX,
    page,
    process::{cargo, installed_targets, output, target_directory},
    python::{self, Wheel},
};

const PAGE: &str = "guides/simulators.md";
pub const WASM: &str = "wasm32-unknown-unknown";

/// Measures; `--dry` leaves the page as it is, `--dev` takes what the tests have compiled and leaves it too.
pub fn places(arguments: &[String]) -> Result<(), String> {
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (released, dry) = match words.as_slice() {
        [] => (true, false),
        ["--dry"] => (true, true),
        ["--dev"] => (false, true),
        _ => return Err("usage: cargo xtask places [--dry | --dev]".to_owned()),
    };
    let installed = installed_targets();
    if installed.iter().any(|target| target == CORTEX) {
        cargo(&["build", "--release", "-p", "hoid-embedded", "--target", CORTEX], &[])?;
    }
    let (python, folder) = if released {
        wasm("release")?;
        let shipped = ["-p", "hoid-cli", "-p", "hoid-ffi", "--lib", "--bins"];
        cargo(&[&["build", "--release"][..], &shipped].concat(), &[])?;
        cargo(&["build", "--release", "-p", "hoid", "--example", "place"], &[])?;
        (python::environment(Wheel::Released)?, "release")
    } else {
        wasm("dev")?;
        cargo(&["build", "--workspace", "--lib", "--bins", "--examples"], &[])?;
        (python::environment(Wheel::OfTests)?, "debug")
    };
    let hoid = (target_directory().join(folder)).join(format!("hoid{}", env::consts::EXE_SUFFIX));
    let table = output(
        Command::new(python)
            .args(["-m", "places"])
            .current_dir(python::package()?.join("tests"))
            .env("HOID_BINARY", hoid),
    )?;
    println!("\n{table}");
    page::write(PAGE, "places", &table, dry)
}

/// Builds the C ABI for WebAssembly where the target is installed.
pub fn wasm(profile: &str) -> Result<(), String> {
    if !installed_targets().iter().any(|target| target == WASM) {
        println!("skipped: hoid for {WASM} (rustup target add {WASM})");
        return Ok(());
    }
    cargo(
        &[
            "build",
            "--profile",
            profile,
            "-p",
            "hoid-ffi",
            "--lib",
            "--target",
            WASM,
            "--config",
            "profile.release.strip=true",
        ],
        &[],
    )
}
