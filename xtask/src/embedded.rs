//! The real-time kernel for processors without an operating system: that it is built for them, without
//! the standard library. A target that is not installed is told and left out.

use std::{path::Path, process::Command};

use crate::process::{cargo, output};

/// A Cortex-M4 or M7 with numbers in hardware, and a RISC-V.
const TARGETS: [&str; 2] = ["thumbv7em-none-eabihf", "riscv32imac-unknown-none-elf"];

/// Builds the kernel for each target that is there.
pub fn embedded() -> Result<(), String> {
    for target in TARGETS {
        let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
        let libraries = output(Command::new(rustc).args(["--print", "target-libdir", "--target", target]))?;
        if !Path::new(libraries.trim()).is_dir() {
            println!("skipped: {target} is not installed (rustup target add {target})");
            continue;
        }
        cargo(&["build", "--release", "-p", "hoid-core", "--target", target], &[])?;
        println!("hoid-core is built for {target}");
    }
    Ok(())
}
