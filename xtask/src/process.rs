//! Execution of commands for the tasks: their output and their error messages.

use std::{
    env,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Command, ExitStatus, Stdio},
};

/// Runs a command; prints each line of its output and passes it to `show`.
pub fn run_by_line(command: &mut Command, mut show: impl FnMut(&str)) -> Result<ExitStatus, String> {
    let shown = format!("{command:?}");
    let cannot_run = |error: std::io::Error| format!("cannot run {shown}: {error}");
    let mut child = command.stdout(Stdio::piped()).spawn().map_err(cannot_run)?;
    if let Some(output) = child.stdout.take() {
        for line in BufReader::new(output).lines() {
            let line = line.map_err(cannot_run)?;
            println!("{line}");
            show(&line);
        }
    }
    child.wait().map_err(cannot_run)
}

pub fn cargo(arguments: &[&str], environment: &[(&str, &str)]) -> Result<(), String> {
    run(cargo_command().args(arguments).envs(environment.iter().copied()))
}

pub fn cargo_command() -> Command {
    Command::new(env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned()))
}

pub fn run(command: &mut Command) -> Result<(), String> {
    let shown = format!("{command:?}");
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("failed ({status}): {shown}")),
        Err(error) => Err(format!("cannot run {shown}: {error}")),
    }
}

/// Runs a command and returns its output.
pub fn output(command: &mut Command) -> Result<String, String> {
    let shown = format!("{command:?}");
    match command.stderr(Stdio::inherit()).output() {
        Ok(output) if output.status.success() => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        Ok(output) => Err(format!("failed ({}): {shown}", output.status)),
        Err(error) => Err(format!("cannot run {shown}: {error}")),
    }
}

/// Profile of the shipped programs, libraries and wheels.
pub const SHIPPED_PROFILE: &str = "shipped";

/// Arguments of the builds for tasks other than tests: the same features as for the tests, so nothing is compiled
/// twice. `--lib` is not included, because maturin compiles the Python module with its own settings. Building the test
/// `symbols` also builds the libraries for C, in the folder `deps`.
pub const TEST_BUILD_ARGUMENTS: [&str; 6] = ["build", "--workspace", "--bins", "--examples", "--test", "symbols"];

/// Returns the target directory of cargo.
pub fn target_directory() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), |named| root.join(named))
}

/// Returns the installed targets of Rust; empty without rustup.
pub fn installed_targets() -> Vec<String> {
    let told = output(Command::new("rustup").args(["target", "list", "--installed"])).unwrap_or_default();
    told.lines().map(str::to_owned).collect()
}
