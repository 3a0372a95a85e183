//! The project's own chores.
//!
//! | command | does |
//! |---|---|
//! | `cargo xtask test` | all tests of the workspace, those of the documentation included, then those of the Python package |
//! | `cargo xtask python [ARGUMENT...]` | the tests of the Python package alone, arguments for pytest |
//! | `cargo xtask check` | formatting, lints, documentation of the crates and the book, as continuous integration does |
//! | `cargo xtask book` | the book in `docs/`, into `docs/book/` (needs mdbook) |
//! | `cargo xtask bench [OPTION...]` | the tasks of the page "Speed beside others" beside the peers that are installed, or how cost grows (module `bench`) |
//! | `cargo xtask slow NAME [ARGUMENT...]` | a study that takes too long for a test: `people-coverage`, `faults`, `faults-clean`, `tracker-faults`, `challenge`, `challenge-people` |
//!
//! Little but the standard library: a chore must start at once on a fresh machine.
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod bench;
mod counts;
mod process;
mod python;

use std::{
    env,
    process::{Command, ExitCode},
};

use counts::Counts;
use process::{cargo, cargo_command, each_line, run};

const USAGE: &str = "usage: cargo xtask test [ARGUMENT...] | python [ARGUMENT...] | check | book | bench [OPTION...] | slow NAME [ARGUMENT...]";

fn main() -> ExitCode {
    let mut arguments = env::args().skip(1);
    let outcome = match arguments.next().as_deref() {
        Some("test") => test(&arguments.collect::<Vec<_>>()),
        Some("python") => python::test(&arguments.collect::<Vec<_>>()).and_then(|counts| counts.verdict()),
        Some("check") => check(),
        Some("book") => book(),
        Some("bench") => bench::bench(&arguments.collect::<Vec<_>>()),
        Some("slow") => slow(&arguments.collect::<Vec<_>>()),
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

/// Runs all tests, passing further arguments on to `cargo test`, and closes with their number over
/// all crates and the Python package, whose tests are left out where the arguments choose some
/// tests of Rust.
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

/// Studies that take too long for a test: name, package and example, and the package whose program
/// one of them runs.
const SLOW: [(&str, &str, &str, Option<&str>); 6] = [
    ("people-coverage", "hoid", "people_coverage", None),
    ("faults", "hoid", "faults", Some("hoid-cli")),
    ("faults-clean", "hoid-ident", "faults_clean", None),
    ("tracker-faults", "hoid", "tracker_faults", None),
    ("challenge", "hoid-study", "challenge", None),
    ("challenge-people", "hoid-study", "challenge_people", None),
];

/// Runs one of them, with further arguments of its own.
fn slow(arguments: &[String]) -> Result<(), String> {
    let names = || SLOW.map(|(name, ..)| name).join(", ");
    let (name, rest) = arguments
        .split_first()
        .ok_or_else(|| format!("which study: {}", names()))?;
    let (_, package, example, program) = (SLOW.iter())
        .find(|(known, ..)| known == name)
        .ok_or_else(|| format!("no study is called {name}; there is {}", names()))?;
    if let Some(program) = program {
        cargo(&["build", "--release", "-p", program], &[])?;
    }
    let mut command = cargo_command();
    command
        .args([
            "run",
            "--release",
            "-p",
            package,
            "--no-default-features",
            "--example",
            example,
            "--",
        ])
        .args(rest);
    run(&mut command)
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
