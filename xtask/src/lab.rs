//! The page of `hoid lab`: that the built file is what its sources build, and the page in a browser.
//!
//! Both need npm, the second a browser; what is not there is said and left out.

use std::{
    env,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use crate::process::{cargo, run, target_directory};

/// Checks the built page, then drives it in a browser.
pub fn lab() -> Result<(), String> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/hoid-lab/page");
    let npm = |arguments: &[&str]| {
        let mut command = Command::new(if cfg!(windows) { "npm.cmd" } else { "npm" });
        command.args(arguments).current_dir(&page);
        command
    };
    let there = npm(&["--version"]).stdout(Stdio::null()).stderr(Stdio::null()).status();
    if !there.is_ok_and(|status| status.success()) {
        println!("skipped: the page of hoid lab needs npm to be checked (apt-get install npm)");
        return Ok(());
    }
    run(&mut npm(&["ci", "--no-fund", "--no-audit"]))?;
    run(&mut npm(&["run", "check"]))?;
    run(&mut npm(&["run", "build", "--", "--check"]))?;
    cargo(&["build", "-p", "hoid-cli", "--features", "lab"], &[])?;
    run(Command::new("node")
        .arg("browser-test/main.mjs")
        .arg(program())
        .current_dir(&page))
}

/// The program that was built.
fn program() -> PathBuf {
    target_directory()
        .join("debug")
        .join(format!("hoid{}", env::consts::EXE_SUFFIX))
}
