//! The page of `hoid lab`: that the built file is what its sources build, the page in a browser, and the studies
//! that need both: a long session (`hour.mjs`), operators in real time (`real.mjs`).
//!
//! All need npm, all but the first a browser; what is not there is said and left out.

use std::{
    env,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use crate::process::{cargo, run, target_directory};

/// The studies in a browser in real time: their names, and their scripts in `browser-test`.
pub const STUDIES: [(&str, &str); 2] = [("lab-hour", "hour.mjs"), ("lab-real", "real.mjs")];

/// Checks the built page, then drives it in a browser, for a minute in real time at the end.
pub fn lab() -> Result<(), String> {
    if !npm_is_there()? {
        return Ok(());
    }
    run(&mut npm(&["run", "check"]))?;
    run(&mut npm(&["run", "build", "--", "--check"]))?;
    in_browser("dev", "main.mjs", &[])?;
    in_browser("dev", "hour.mjs", &["1".to_owned()])
}

/// One of the studies, with arguments of its own.
pub fn study(script: &str, arguments: &[String]) -> Result<(), String> {
    if npm_is_there()? {
        in_browser("release", script, arguments)?;
    }
    Ok(())
}

/// Installs what the page is built and driven with; false where there is no npm, which is said.
fn npm_is_there() -> Result<bool, String> {
    let there = npm(&["--version"]).stdout(Stdio::null()).stderr(Stdio::null()).status();
    if !there.is_ok_and(|status| status.success()) {
        println!("skipped: the page of hoid lab needs npm to be checked (apt-get install npm)");
        return Ok(false);
    }
    run(&mut npm(&["ci", "--no-fund", "--no-audit"]))?;
    Ok(true)
}

fn in_browser(profile: &str, script: &str, arguments: &[String]) -> Result<(), String> {
    cargo(
        &["build", "--profile", profile, "-p", "hoid-cli", "--features", "lab"],
        &[],
    )?;
    run(Command::new("node")
        .arg(Path::new("browser-test").join(script))
        .arg(program(if profile == "dev" { "debug" } else { profile }))
        .args(arguments)
        .current_dir(page()))
}

fn page() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/hoid-lab/page")
}

fn npm(arguments: &[&str]) -> Command {
    let mut command = Command::new(if cfg!(windows) { "npm.cmd" } else { "npm" });
    command.args(arguments).current_dir(page());
    command
}

/// The program that was built.
fn program(folder: &str) -> PathBuf {
    target_directory()
        .join(folder)
        .join(format!("hoid{}", env::consts::EXE_SUFFIX))
}
