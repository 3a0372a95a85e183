//! All interfaces of hoid: one run through each. The digits are compared with those of `hoid track`, and the time per
//! sample and the size of the shipped files are measured. The table is written between the markers of the page "In your
//! simulator".
//!
//! The interfaces are in `python/tests/places`, which is also run by the tests (`test_places.py`). Here their
//! requirements are built with the profile of shipped programs. If a program is missing, a row of the table reports it.

use std::{env, process::Command};

use crate::{
    page,
    process::{AS_TESTS, SHIPPED, cargo, output, target_directory},
    processors::{BUILT, other_processors},
    python::{self, Wheel},
};

const PAGE: &str = "guides/simulators.md";

/// Measures all interfaces. `--dry` leaves the page unchanged; so does `--dev`, which uses the builds of the tests.
pub fn places(arguments: &[String]) -> Result<(), String> {
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (shipped, dry) = match words.as_slice() {
        [] => (true, false),
        ["--dry"] => (true, true),
        ["--dev"] => (false, true),
        _ => return Err("usage: cargo xtask places [--dry | --dev]".to_owned()),
    };
    let (python, folder) = if shipped {
        other_processors(SHIPPED)?;
        let build = ["build", "--profile", SHIPPED];
        let what = ["-p", "hoid-cli", "-p", "hoid-ffi", "--lib", "--bins"];
        cargo(&[&build[..], &what].concat(), &[])?;
        cargo(&[&build[..], &["-p", "hoid", "--example", "place"]].concat(), &[])?;
        (python::environment(Wheel::Shipped)?, SHIPPED)
    } else {
        other_processors("dev")?;
        cargo(&AS_TESTS, &[])?;
        (python::environment(Wheel::OfTests)?, "debug")
    };
    let hoid = (target_directory().join(folder)).join(format!("hoid{}", env::consts::EXE_SUFFIX));
    let table = output(
        Command::new(python)
            .args(["-m", "places"])
            .current_dir(python::package()?.join("tests"))
            .env("HOID_BINARY", hoid)
            .env(BUILT, "1"),
    )?;
    println!("\n{table}");
    page::write(PAGE, "places", &table, dry)
}
