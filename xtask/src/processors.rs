//! Builds for other processors, for the places in which hoid runs and their tests.

use std::path::PathBuf;

use crate::{
    embedded::CORTEX,
    process::{SHIPPED, cargo, installed_targets, target_directory},
};

const WASM: &str = "wasm32-unknown-unknown";
/// Reports the places that what runs on other processors has just been built.
pub const BUILT: &str = "HOID_PLACES_BUILT";

/// Builds the C ABI for WebAssembly by this profile and the kernel for a Cortex-M4 by `release`, as its own chore does;
/// each where its target is installed.
pub fn other_processors(profile: &str) -> Result<(), String> {
    if is_there(CORTEX) {
        cargo(&["build", "--release", "-p", "hoid-embedded", "--target", CORTEX], &[])?;
    }
    webassembly(profile)?;
    Ok(())
}

/// Builds the C ABI for WebAssembly by this profile; where it is, nothing if the target is not installed.
pub fn webassembly(profile: &str) -> Result<Option<PathBuf>, String> {
    if !is_there(WASM) {
        return Ok(None);
    }
    let build = [
        "build",
        "--profile",
        profile,
        "-p",
        "hoid-ffi",
        "--lib",
        "--target",
        WASM,
    ];
    // For the tests' profile with its symbols, or what runs at build time would be compiled once more.
    let stripped = format!("profile.{SHIPPED}.strip=true");
    cargo(&[&build[..], &["--config", &stripped]].concat(), &[])?;
    let folder = if profile == "dev" { "debug" } else { profile };
    Ok(Some(target_directory().join(WASM).join(folder).join("hoid_ffi.wasm")))
}

/// Whether Rust can build for a target here; reported where it cannot.
fn is_there(target: &str) -> bool {
    let there = installed_targets().iter().any(|one| one == target);
    if !there {
        println!("skipped: hoid for {target} (rustup target add {target})");
    }
    there
}
