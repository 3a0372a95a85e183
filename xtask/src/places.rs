//! All interfaces of hoid: one run through each. The digits are compared with those of `hoid track`, and the time per
//! sample and the size of the shipped files are measured. The table is written between the markers of the page "In your
//! simulator".
//!
//! The interfaces are in `python/tests/places`, which is also run by the tests (`test_places.py`). Here their
//! requirements are built with the profile of shipped programs. If a program is missing, a row of the table reports it.

use std::{env, process::Command};

use crate::{
    page,
    process::{SHIPPED_PROFILE, TEST_BUILD_ARGUMENTS, cargo, output, target_directory},
    processors::{BUILT_VARIABLE, build_for_other_processors},
    python::{self, Wheel},
};

const PAGE_PATH: &str = "guides/simulators.md";

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
        build_for_other_processors(SHIPPED_PROFILE)?;
        let build = ["build", "--profile", SHIPPED_PROFILE];
        let what = ["-p", "hoid-cli", "-p", "hoid-ffi", "--lib", "--bins"];
        cargo(&[&build[..], &what].concat(), &[])?;
        cargo(&[&build[..], &["-p", "hoid", "--example", "place"]].concat(), &[])?;
        (python::environment_with_package(Wheel::Shipped)?, SHIPPED_PROFILE)
    } else {
        build_for_other_processors("dev")?;
        cargo(&TEST_BUILD_ARGUMENTS, &[])?;
        (python::environment_with_package(Wheel::OfTests)?, "debug")
    };
    let hoid = (target_directory().join(folder)).join(format!("hoid{}", env::consts::EXE_SUFFIX));
    let table = output(
        Command::new(python)
            .args(["-m", "places"])
            .current_dir(python::package_folder()?.join("tests"))
            .env("HOID_BINARY", hoid)
            .env(BUILT_VARIABLE, "1"),
    )?;
    println!("\n{table}");
    page::update_section(PAGE_PATH, "places", &table, dry)
}
