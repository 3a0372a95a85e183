//! The page of `hoid lab`: a check that the built file corresponds to its sources, tests in a browser, the page without
//! a server, and the studies that need a browser: a long session (`hour.mjs`) and operators in real time (`real.mjs`).
//!
//! All these tasks need npm, and those that load a page need a browser. If a program is missing, the task is skipped
//! and a message is printed.

use std::{
    env, fs,
    path::{Path, PathBuf, absolute},
    process::{Command, Stdio},
};

use crate::{
    process::{SHIPPED_PROFILE, TEST_BUILD_ARGUMENTS, cargo, output, run, target_directory},
    processors::build_webassembly,
};

/// The studies that run in a browser in real time: their names and their scripts in `browser-test`.
pub const STUDIES: [(&str, &str); 2] = [("lab-hour", "hour.mjs"), ("lab-real", "real.mjs")];

/// Checks the built page, tests it in a browser, and finally runs it for a minute in real time.
pub fn lab() -> Result<(), String> {
    if !install_npm_packages()? {
        return Ok(());
    }
    run(&mut npm_command(&["run", "check"]))?;
    run(&mut npm_command(&["run", "build", "--", "--check"]))?;
    run_in_browser("dev", "main.mjs", &[])?;
    if let Some(path) = build_page("dev", None, &page_path("of-tests.html"))? {
        run_in_browser("dev", "alone.mjs", &[path.to_string_lossy().into_owned()])?;
    }
    run_in_browser("dev", "hour.mjs", &["1".to_owned()])
}

/// Builds the page without a server, as one file with an experiment and the tracker.
pub fn lab_page(arguments: &[String]) -> Result<(), String> {
    let (mut config, mut out) = (None, None);
    let mut rest = arguments.iter();
    while let Some(option) = rest.next() {
        let place = match option.as_str() {
            "--config" => &mut config,
            "--out" => &mut out,
            _ => return Err("usage: cargo xtask lab-page [--config lab.toml] [--out FILE]".to_owned()),
        };
        let named = rest.next().ok_or_else(|| format!("{option} needs a file"))?;
        *place = Some(absolute(named).map_err(|error| format!("{named}: {error}"))?);
    }
    let out = out.unwrap_or_else(|| page_path("hoid-lab.html"));
    if install_npm_packages()?
        && let Some(path) = build_page(SHIPPED_PROFILE, config.as_deref(), &out)?
    {
        let path = fs::canonicalize(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        let size = fs::metadata(&path).map_or(0, |data| data.len());
        println!("{}, {:.1} MB", path.display(), size as f64 / 1e6);
    }
    Ok(())
}

/// Builds the page without a server, with the kernel in a given profile, and returns its path; `None` if the
/// WebAssembly target is not installed.
fn build_page(profile: &str, config: Option<&Path>, out: &Path) -> Result<Option<PathBuf>, String> {
    let Some(kernel) = build_webassembly(profile)? else {
        return Ok(None);
    };
    // The features are those of the tests, so nothing is compiled again.
    cargo(&["build", "--workspace", "--example", "tables"], &[])?;
    let program = target_directory().join("debug/examples");
    let told = output(Command::new(program.join(format!("tables{}", env::consts::EXE_SUFFIX))).args(config))?;
    let tables = page_path("experiment.json");
    fs::create_dir_all(page_path("")).map_err(|error| format!("{}: {error}", page_path("").display()))?;
    fs::write(&tables, told).map_err(|error| format!("{}: {error}", tables.display()))?;
    run(Command::new("node")
        .args(["build.mjs", "--alone"])
        .args([&kernel, &tables, out])
        .current_dir(page_folder()))?;
    Ok(Some(out.to_owned()))
}

/// Returns the path of a file in the folder of the built page.
fn page_path(name: &str) -> PathBuf {
    let folder = target_directory().join("lab-page");
    absolute(folder.join(name)).unwrap_or_else(|_| folder.join(name))
}

/// Runs one of the browser studies with its arguments.
pub fn study(script: &str, arguments: &[String]) -> Result<(), String> {
    if install_npm_packages()? {
        run_in_browser("release", script, arguments)?;
    }
    Ok(())
}

/// Installs the tools for building and testing the page. If npm is missing, prints a message and returns false.
fn install_npm_packages() -> Result<bool, String> {
    let there = npm_command(&["--version"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    if !there.is_ok_and(|status| status.success()) {
        println!("skipped: checking the page of hoid lab requires npm (apt-get install npm)");
        return Ok(false);
    }
    run(&mut npm_command(&["ci", "--no-fund", "--no-audit"]))?;
    Ok(true)
}

fn run_in_browser(profile: &str, script: &str, arguments: &[String]) -> Result<(), String> {
    if profile == "dev" {
        cargo(
            &[&TEST_BUILD_ARGUMENTS[..], &["--features", "hoid-cli/lab"]].concat(),
            &[],
        )?;
    } else {
        cargo(
            &["build", "--profile", profile, "-p", "hoid-cli", "--features", "lab"],
            &[],
        )?;
    }
    run(Command::new("node")
        .arg(Path::new("browser-test").join(script))
        .arg(program_path(if profile == "dev" { "debug" } else { profile }))
        .args(arguments)
        .current_dir(page_folder()))
}

fn page_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/hoid-lab/page")
}

fn npm_command(arguments: &[&str]) -> Command {
    let mut command = Command::new(if cfg!(windows) { "npm.cmd" } else { "npm" });
    command.args(arguments).current_dir(page_folder());
    command
}

/// Returns the path of the built program `hoid`.
fn program_path(folder: &str) -> PathBuf {
    target_directory()
        .join(folder)
        .join(format!("hoid{}", env::consts::EXE_SUFFIX))
}
