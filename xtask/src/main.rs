//! The development tasks of the project.
//!
//! | command | does |
//! |---|---|
//! | `cargo xtask test` | all tests of the workspace, those of the documentation included, then those of the Python package |
//! | `cargo xtask python [ARGUMENT...]` | the tests of the Python package alone, arguments for pytest |
//! | `cargo xtask check` | formatting, crates that are used, lints, documentation of the crates and the book, as continuous integration does |
//! | `cargo xtask crates` | licences, bans and versions of the crates that are used, alone (module `crates`) |
//! | `cargo xtask words [--book]` | the words that prose does not use, in sources, or in the book, alone (module `words`) |
//! | `cargo xtask book` | the book in `docs/`, into `docs/book/` (needs mdbook) |
//! | `cargo xtask lab` | that the page of `hoid lab` is what its sources build, and the page in a browser (module `lab`) |
//! | `cargo xtask lab-page [--config FILE] [--out FILE]` | the page of `hoid lab` as one file that needs no program after it, into `target/lab-page/` |
//! | `cargo xtask embedded [--all]` | the kernel on bare processors, with the digits of the host (module `embedded`) |
//! | `cargo xtask ffi [--dev] [--out DIR]` | the libraries for C with header, pkg-config file, CMake package and examples, into `target/ffi/`; `--header` makes the header again, `--check` builds the examples by them (module `ffi`) |
//! | `cargo xtask miri [ARGUMENT...]` | the boundary to C under Miri, arguments for its tests (module `miri`) |
//! | `cargo xtask places [--dry or --dev]` | one run through every place in which hoid runs, as the table of the page "In your simulator" (module `places`) |
//! | `cargo xtask bench [OPTION...]` | the tasks of `research/notes/speed-peers.md` next to the peers that are installed, or how cost grows (module `bench`) |
//! | `cargo xtask slow NAME [ARGUMENT...]` | a study that takes too long for a test: `people-coverage`, `design-errors`, `faults`, `faults-clean`, `tracker-faults`, `mutations`, `bombs`, `hostile`, `kills`, `full-disks`, `latency`, `lab`, `lab-hour`, `lab-real`, `challenge`, `challenge-people` |
//!
//! Almost only the standard library is used: a task must start at once on a new machine.
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod background;
mod bench;
mod counts;
mod crates;
mod embedded;
mod ffi;
mod lab;
mod miri;
mod page;
mod places;
mod process;
mod processors;
mod python;
mod words;

use std::{
    env,
    process::{Command, ExitCode},
};

use background::Background;
use counts::Counts;
use process::{SHIPPED, cargo, cargo_command, each_line, run};

const USAGE: &str = "usage: cargo xtask test [ARGUMENT...] | python [ARGUMENT...] | check | crates | words [--book] | book | lab | lab-page [OPTION...] | embedded [--all] | ffi [OPTION...] | miri [ARGUMENT...] | places [--dry | --dev] | bench [OPTION...] | slow NAME [ARGUMENT...]";

fn main() -> ExitCode {
    let mut arguments = env::args().skip(1);
    let outcome = match arguments.next().as_deref() {
        Some("test") => test(&arguments.collect::<Vec<_>>()),
        Some("python") => python::test(&arguments.collect::<Vec<_>>()).and_then(|counts| counts.verdict()),
        Some(python::REQUIRE) => python::require(),
        Some(python::BUILD) => python::build(),
        Some("check") => check(),
        Some("crates") => crates::check(),
        Some("words") if arguments.next().as_deref() == Some("--book") => words::check_book(),
        Some("words") => words::check(),
        Some("book") => book(),
        Some("bench") => bench::bench(&arguments.collect::<Vec<_>>()),
        Some("lab") => lab::lab(),
        Some("lab-page") => lab::alone(&arguments.collect::<Vec<_>>()),
        Some("embedded") => embedded::embedded(&arguments.collect::<Vec<_>>()),
        Some("ffi") => ffi::ffi(&arguments.collect::<Vec<_>>()),
        Some("miri") => miri::miri(&arguments.collect::<Vec<_>>()),
        Some("places") => places::places(&arguments.collect::<Vec<_>>()),
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

/// Runs all tests, passing further arguments on to `cargo test`, and prints their number over all
/// crates and the Python package, whose tests are skipped if the arguments select tests of Rust.
fn test(arguments: &[String]) -> Result<(), String> {
    let mut command = cargo_command();
    command.args(["test", "--workspace", "--no-fail-fast"]).args(arguments);
    let shown = format!("{command:?}");
    let mut total = Counts::default();
    let status = if arguments.is_empty() {
        let required = Background::begin(python::REQUIRE)?;
        cargo(&["test", "--workspace", "--no-run"], &[])?;
        let mut required = Some(required.end());
        let mut built = Ok(None);
        let status = each_line(&mut command, |line| {
            // Not before the first test runs: until then cargo blocks other builds, and they block it.
            if let Some(required) = required.take() {
                built = required.and_then(|()| Background::begin(python::BUILD).map(Some));
            }
            total.add(line);
        })?;
        built?.map_or(Ok(()), Background::end)?;
        total.join(&python::pytest(&[])?);
        status
    } else {
        each_line(&mut command, |line| total.add(line))?
    };
    println!(
        "\n{} passed, {} failed, {} skipped",
        total.passed, total.failed, total.ignored
    );
    if !status.success() {
        return Err(format!("failed ({status}): {shown}"));
    }
    total.verdict()
}

/// A study that takes too long for a test.
struct Slow {
    name: &'static str,
    package: &'static str,
    example: &'static str,
    /// The package whose program is run.
    program: Option<&'static str>,
    /// `release`; `dev` for detecting overflow, as in the tests; the shipped profile if times are reported.
    profile: &'static str,
}

const fn slow_of(name: &'static str, package: &'static str, example: &'static str) -> Slow {
    Slow {
        name,
        package,
        example,
        program: None,
        profile: "release",
    }
}

const SLOW: [Slow; 19] = [
    slow_of("people-coverage", "hoid", "people_coverage"),
    Slow {
        program: Some("hoid-cli"),
        ..slow_of("faults", "hoid", "faults")
    },
    slow_of("faults-clean", "hoid-evidence", "faults_clean"),
    slow_of("little-noise", "hoid-evidence", "little_noise"),
    slow_of("intersample-coverage", "hoid-evidence", "intersample_coverage"),
    slow_of("inputs-coverage", "hoid-evidence", "inputs_coverage"),
    slow_of("design-errors", "hoid-design", "design_errors"),
    slow_of("tracker-faults", "hoid", "tracker_faults"),
    Slow {
        profile: "dev",
        ..slow_of("mutations", "hoid-io", "mutations")
    },
    slow_of("bombs", "hoid-io", "bombs"),
    slow_of("long-csv", "hoid-io", "long_csv"),
    slow_of("step-time", "hoid-core", "step_time"),
    Slow {
        profile: "dev",
        ..slow_of("hostile", "hoid-lab", "hostile")
    },
    Slow {
        program: Some("hoid-cli"),
        ..slow_of("kills", "hoid-cli", "kills")
    },
    Slow {
        program: Some("hoid-cli"),
        ..slow_of("full-disks", "hoid-cli", "full_disks")
    },
    Slow {
        program: Some("hoid-cli"),
        profile: SHIPPED,
        ..slow_of("latency", "hoid-cli", "latency")
    },
    slow_of("lab", "hoid-lab", "lab"),
    slow_of("challenge", "hoid-challenge", "challenge"),
    slow_of("challenge-people", "hoid-challenge", "challenge_people"),
];

/// Runs one of them, with its arguments.
fn slow(arguments: &[String]) -> Result<(), String> {
    let names = || {
        let all = SLOW.iter().map(|slow| slow.name);
        all.chain(lab::STUDIES.map(|(name, _)| name))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let (name, rest) = arguments
        .split_first()
        .ok_or_else(|| format!("which study: {}", names()))?;
    if let Some((_, script)) = lab::STUDIES.iter().find(|(study, _)| study == name) {
        return lab::study(script, rest);
    }
    let slow = (SLOW.iter())
        .find(|slow| slow.name == name)
        .ok_or_else(|| format!("no study is called {name}; there is {}", names()))?;
    if let Some(program) = slow.program {
        cargo(&["build", "--profile", slow.profile, "-p", program], &[])?;
    }
    let mut command = cargo_command();
    command
        .args(["run", "--profile", slow.profile, "-p", slow.package])
        .args(["--no-default-features", "--example", slow.example, "--"])
        .args(rest);
    run(&mut command)
}

fn check() -> Result<(), String> {
    cargo(&["fmt", "--all", "--check"], &[])?;
    crates::check()?;
    words::check()?;
    cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"], &[])?;
    cargo(&["doc", "--workspace", "--no-deps"], &[("RUSTDOCFLAGS", "-D warnings")])?;
    book()
}

fn book() -> Result<(), String> {
    run(Command::new("mdbook").args(["build", "docs"]))
        .map_err(|e| format!("{e}\nmdbook builds the book; install it with: cargo install mdbook --locked"))
}
