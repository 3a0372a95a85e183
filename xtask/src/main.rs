//! The project's own chores.
//!
//! | command | does |
//! |---|---|
//! | `cargo xtask test` | all tests of the workspace, those of the documentation included, then those of the Python package |
//! | `cargo xtask python [ARGUMENT...]` | the tests of the Python package alone, arguments for pytest |
//! | `cargo xtask check` | formatting, lints, documentation of the crates and the book, as continuous integration does |
//! | `cargo xtask book` | the book in `docs/`, into `docs/book/` (needs mdbook) |
//! | `cargo xtask bench [OPTION...]` | the tasks of the page "Speed beside others" beside the peers that are installed, or how cost grows (module `bench`) |
//!
//! Little but the standard library: a chore must start at once on a fresh machine.
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod bench;
mod python;

use std::{
    env,
    io::{BufRead, BufReader},
    process::{Command, ExitCode, ExitStatus, Stdio},
};

const USAGE: &str = "usage: cargo xtask test [ARGUMENT...] | python [ARGUMENT...] | check | book | bench [OPTION...]";

fn main() -> ExitCode {
    let mut arguments = env::args().skip(1);
    let outcome = match arguments.next().as_deref() {
        Some("test") => test(&arguments.collect::<Vec<_>>()),
        Some("python") => python::test(&arguments.collect::<Vec<_>>()).and_then(|counts| counts.verdict()),
        Some("check") => check(),
        Some("book") => book(),
        Some("bench") => bench::bench(&arguments.collect::<Vec<_>>()),
        _ => Err(USAGE.to_owned()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

/// Runs all tests, passing further arguments on to `cargo test`, and closes with their number over all crates and the Python package, whose
/// tests are left out where the arguments choose some tests of Rust.
fn test(arguments: &[String]) -> Result<(), String> {
    let mut command = cargo_command();
    command.args(["test", "--workspace", "--no-fail-fast"]).args(arguments);
    let shown = format!("{command:?}");
    let mut total = Counts::default();
    let status = each_line(&mut command, |line| total.add(line))?;
    if arguments.is_empty() {
        total.join(&python::test(&[])?);
    }
    println!(
        "\n{} passed, {} failed, {} skipped",
        total.passed, total.failed, total.ignored
    );
    if !status.success() {
        return Err(format!("failed ({status}): {shown}"));
    }
    total.verdict()
}

/// Runs a command, and prints and shows each line of its output.
fn each_line(command: &mut Command, mut show: impl FnMut(&str)) -> Result<ExitStatus, String> {
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

#[derive(Debug, Default, PartialEq)]
struct Counts {
    passed: usize,
    failed: usize,
    ignored: usize,
}

impl Counts {
    fn join(&mut self, other: &Self) {
        self.passed += other.passed;
        self.failed += other.failed;
        self.ignored += other.ignored;
    }

    fn verdict(&self) -> Result<(), String> {
        match self.failed {
            0 => Ok(()),
            failed => Err(format!("{failed} tests failed")),
        }
    }

    /// Adds a line such as `test result: ok. 7 passed; 0 failed; 0 ignored; ...`; other lines count nothing.
    fn add(&mut self, line: &str) {
        let Some(numbers) = line.strip_prefix("test result: ") else {
            return;
        };
        for part in numbers.split([';', '.']) {
            let mut words = part.split_whitespace();
            let (Some(Ok(n)), Some(what)) = (words.next().map(str::parse::<usize>), words.next()) else {
                continue;
            };
            match what {
                "passed" => self.passed += n,
                "failed" => self.failed += n,
                "ignored" => self.ignored += n,
                _ => {}
            }
        }
    }
}

fn check() -> Result<(), String> {
    cargo(&["fmt", "--all", "--check"], &[])?;
    cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"], &[])?;
    cargo(&["doc", "--workspace", "--no-deps"], &[("RUSTDOCFLAGS", "-D warnings")])?;
    book()
}

fn book() -> Result<(), String> {
    run(Command::new("mdbook").args(["build", "docs"]))
        .map_err(|e| format!("{e}\nmdbook builds the book; install it with: cargo install mdbook --locked"))
}

fn cargo(arguments: &[&str], environment: &[(&str, &str)]) -> Result<(), String> {
    run(cargo_command().args(arguments).envs(environment.iter().copied()))
}

fn cargo_command() -> Command {
    Command::new(env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned()))
}

fn run(command: &mut Command) -> Result<(), String> {
    let shown = format!("{command:?}");
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("failed ({status}): {shown}")),
        Err(error) => Err(format!("cannot run {shown}: {error}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_add_up_over_crates() {
        let mut counts = Counts::default();
        for line in [
            "running 3 tests",
            "test result: ok. 7 passed; 0 failed; 1 ignored; 0 measured; 2 filtered out; finished in 0.00s",
            "test result: FAILED. 5 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out; finished in 1.00s",
        ] {
            counts.add(line);
        }
        assert_eq!(
            counts,
            Counts {
                passed: 12,
                failed: 2,
                ignored: 1
            }
        );
    }
}
