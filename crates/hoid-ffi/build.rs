//! Sets the stack size in WebAssembly. The initialisation of a filter takes most of the default of 1 MB.

#![allow(clippy::print_stdout)]

use std::env;

/// Stack size in bytes.
const STACK_SIZE: u32 = 4 << 20;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_ARCH").is_ok_and(|arch| arch == "wasm32") {
        println!("cargo:rustc-link-arg-cdylib=-zstack-size={STACK_SIZE}");
    }
}
