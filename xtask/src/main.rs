//! The project's own chores.
//!
//! | command | does |
//! |---|---|
//! | `cargo xtask test` | all tests of the workspace, those of the documentation included |
//! | `cargo xtask check` | formatting, lints, documentation of the crates and the book, as continuous integration does |
//! | `cargo xtask book` | the book in `docs/`, into `docs/book/` (needs mdbook) |
//!
//! Nothing but the standard library: a chore must start at once on a fresh machine.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::{
    env,
    process::{Command, ExitCode},
};

const USAGE: &str = "usage: cargo xtask test [ARGUMENT...] | check | book";

fn main() -> ExitCode {
    let mut arguments = env::args().skip(1);
    let outcome = match arguments.next().as_deref() {
        Some("test") => test(&arguments.collect::<Vec<_>>()),
        Some("check") => check(),
        Some("book") => book(),
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

/// Passes further arguments on to `cargo test`.
fn test(arguments: &[String]) -> Result<(), String> {
    let mut all = vec!["test", "--workspace", "--no-fail-fast"];
    all.extend(arguments.iter().map(String::as_str));
    cargo(&all, &[])
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
    let program = env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    run(Command::new(program).args(arguments).envs(environment.iter().copied()))
}

fn run(command: &mut Command) -> Result<(), String> {
    let shown = format!("{command:?}");
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("failed ({status}): {shown}")),
        Err(error) => Err(format!("cannot run {shown}: {error}")),
    }
}
