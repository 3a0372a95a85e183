//! What runs on other processors than this one, for the places in which hoid runs and their tests.

use crate::{
    embedded::CORTEX,
    process::{SHIPPED, cargo, installed_targets},
};

const WASM: &str = "wasm32-unknown-unknown";
/// Tells the places that what runs on other processors has just been built.
pub const BUILT: &str = "HOID_PLACES_BUILT";

/// Builds the C ABI for WebAssembly by this profile and the kernel for a Cortex-M4 by `release`, as its own chore does;
/// each where its target is installed.
pub fn other_processors(profile: &str) -> Result<(), String> {
    let installed = installed_targets();
    let there = |target: &str| {
        let there = installed.iter().any(|one| one == target);
        if !there {
            println!("skipped: hoid for {target} (rustup target add {target})");
        }
        there
    };
    if there(CORTEX) {
        cargo(&["build", "--release", "-p", "hoid-embedded", "--target", CORTEX], &[])?;
    }
    if there(WASM) {
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
        // Of the tests' profile with its symbols, or what runs at build time would be compiled once more.
        let stripped = format!("profile.{SHIPPED}.strip=true");
        cargo(&[&build[..], &["--config", &stripped]].concat(), &[])?;
    }
    Ok(())
}
