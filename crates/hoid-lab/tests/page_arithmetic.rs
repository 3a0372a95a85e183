//! The page and Rust give bit-identical results. Without Node.js the test reports that it is skipped;
//! `cargo xtask slow lab` compares ten thousand runs.
#![allow(clippy::unwrap_used, clippy::print_stderr)]

#[path = "common/page.rs"]
mod page;

#[test]
fn page_arithmetic_is_bit_identical() {
    let Some(mut engine) = page::Engine::start() else {
        eprintln!("skipped: there is no node");
        return;
    };
    let differing: Vec<u32> = (1..=60)
        .filter(|seed| !page::is_bit_identical(&mut engine, *seed))
        .collect();
    assert!(differing.is_empty(), "{differing:?}");
}
