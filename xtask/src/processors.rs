//! Builds for other processors, for the interfaces of hoid and their tests.

use std::path::PathBuf;

use crate::{
    embedded::CORTEX_TARGET,
    process::{SHIPPED_PROFILE, cargo, installed_targets, target_directory},
};

const WASM_TARGET: &str = "wasm32-unknown-unknown";
/// Environment variable that informs `places` that these builds are up to date.
pub const BUILT_VARIABLE: &str = "HOID_PLACES_BUILT";

/// Builds the C ABI for WebAssembly with this profile and the kernel for a Cortex-M4 with `release`, as the task
/// `embedded` does. A target that is not installed is skipped.
pub fn build_for_other_processors(profile: &str) -> Result<(), String> {
    if target_is_installed(CORTEX_TARGET) {
        cargo(
            &["build", "--release", "-p", "hoid-embedded", "--target", CORTEX_TARGET],
            &[],
        )?;
    }
    build_webassembly(profile)?;
    Ok(())
}

/// Builds the C ABI for WebAssembly with this profile and returns its path; `None` if the target is not installed.
pub fn build_webassembly(profile: &str) -> Result<Option<PathBuf>, String> {
    if !target_is_installed(WASM_TARGET) {
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
        WASM_TARGET,
    ];
    // Only the shipped profile is stripped; the profile of the tests keeps its symbols, otherwise build scripts would
    // be compiled again.
    let stripped = format!("profile.{SHIPPED_PROFILE}.strip=true");
    cargo(&[&build[..], &["--config", &stripped]].concat(), &[])?;
    let folder = if profile == "dev" { "debug" } else { profile };
    Ok(Some(
        target_directory().join(WASM_TARGET).join(folder).join("hoid_ffi.wasm"),
    ))
}

/// True if a target is installed; otherwise a message is printed.
fn target_is_installed(target: &str) -> bool {
    let there = installed_targets().iter().any(|one| one == target);
    if !there {
        println!("skipped: hoid for {target} (rustup target add {target})");
    }
    there
}
