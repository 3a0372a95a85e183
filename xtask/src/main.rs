//! The development tasks of the project.
//!
//! | command | task |
//! |---|---|
//! | `cargo xtask test` | all tests of the workspace, including the documentation tests, then those of the Python package |
//! | `cargo xtask python [ARGUMENT...]` | only the tests of the Python package; the arguments are passed to pytest |
//! | `cargo xtask check` | formatting, dependencies, lints, documentation of the crates, and the book, as in continuous integration |
//! | `cargo xtask crates` | only the licences, bans and versions of the dependencies (module `crates`) |
//! | `cargo xtask words [--book]` | only the check for words that prose must not use, in the sources or in the book (module `words`) |
//! | `cargo xtask book` | builds the book in `docs/` into `docs/book/` (needs mdbook) |
//! | `cargo xtask lab` | checks that the built page of `hoid lab` corresponds to its sources, and tests it in a browser (module `lab`) |
//! | `cargo xtask lab-page [--config FILE] [--out FILE]` | builds the page of `hoid lab` as one file that works without a server, into `target/lab-page/` |
//! | `cargo xtask embedded [--all]` | runs the kernel on microcontrollers and compares its digits with those of the host (module `embedded`) |
//! | `cargo xtask ffi [--dev] [--out DIR]` | builds the libraries for C with header, pkg-config file, CMake package and examples into `target/ffi/`; `--header` generates the header, `--check` builds the examples with them (module `ffi`) |
//! | `cargo xtask miri [ARGUMENT...]` | runs the tests of the C boundary under Miri; the arguments are passed to the tests (module `miri`) |
//! | `cargo xtask places [--dry or --dev]` | runs every interface of hoid once, and writes the table of the page "In your simulator" (module `places`) |
//! | `cargo xtask bench [OPTION...]` | compares the tasks of `research/notes/speed-peers.md` with the installed peers, or measures how the cost grows (module `bench`) |
//! | `cargo xtask slow NAME [ARGUMENT...]` | runs a study that takes too long for a test: `people-coverage`, `faults`, `faults-clean`, `little-noise`, `intersample-coverage`, `inputs-coverage`, `design-errors`, `tracker-faults`, `mutations`, `bombs`, `long-csv`, `step-time`, `hostile`, `kills`, `full-disks`, `latency`, `lab`, `lab-hour`, `lab-real`, `challenge`, `challenge-people` |
//!
//! Little more than the standard library is used, because a task must start at once on a new machine.
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
use process::{SHIPPED_PROFILE, cargo, cargo_command, run, run_by_line};

const USAGE: &str = "usage: cargo xtask test [ARGUMENT...] | python [ARGUMENT...] | check | crates | words [--book] | book | lab | lab-page [OPTION...] | embedded [--all] | ffi [OPTION...] | miri [ARGUMENT...] | places [--dry | --dev] | bench [OPTION...] | slow NAME [ARGUMENT...]";

fn main() -> ExitCode {
    let mut arguments = env::args().skip(1);
    let outcome = match arguments.next().as_deref() {
        Some("test") => test(&arguments.collect::<Vec<_>>()),
        Some("python") => python::test(&arguments.collect::<Vec<_>>()).and_then(|counts| counts.to_result()),
        Some(python::REQUIRE_TASK) => python::create_test_environment(),
        Some(python::BUILD_TASK) => python::build(),
        Some("check") => check(),
        Some("crates") => crates::check(),
        Some("words") if arguments.next().as_deref() == Some("--book") => words::check_book(),
        Some("words") => words::check(),
        Some("book") => book(),
        Some("bench") => bench::bench(&arguments.collect::<Vec<_>>()),
        Some("lab") => lab::lab(),
        Some("lab-page") => lab::lab_page(&arguments.collect::<Vec<_>>()),
        Some("embedded") => embedded::embedded(&arguments.collect::<Vec<_>>()),
        Some("ffi") => ffi::ffi(&arguments.collect::<Vec<_>>()),
        Some("miri") => miri::miri(&arguments.collect::<Vec<_>>()),
        Some("places") => places::places(&arguments.collect::<Vec<_>>()),
        Some("slow") => run_slow_study(&arguments.collect::<Vec<_>>()),
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

/// Runs all tests, passes further arguments on to `cargo test`, and prints the number of tests in all crates and the
/// Python package. With arguments, which select tests of Rust, the tests of the Python package are skipped.
fn test(arguments: &[String]) -> Result<(), String> {
    let mut command = cargo_command();
    command.args(["test", "--workspace", "--no-fail-fast"]).args(arguments);
    let shown = format!("{command:?}");
    let mut total = Counts::default();
    let status = if arguments.is_empty() {
        let required = Background::spawn(python::REQUIRE_TASK)?;
        cargo(&["test", "--workspace", "--no-run"], &[])?;
        let mut required = Some(required.wait());
        let mut built = Ok(None);
        let status = run_by_line(&mut command, |line| {
            // The build must not start before the first test runs: until then the two cargo processes would block each
            // other.
            if let Some(required) = required.take() {
                built = required.and_then(|()| Background::spawn(python::BUILD_TASK).map(Some));
            }
            total.add(line);
        })?;
        built?.map_or(Ok(()), Background::wait)?;
        total.merge(&python::pytest(&[])?);
        status
    } else {
        run_by_line(&mut command, |line| total.add(line))?
    };
    println!(
        "\n{} passed, {} failed, {} skipped",
        total.passed, total.failed, total.ignored
    );
    if !status.success() {
        return Err(format!("failed ({status}): {shown}"));
    }
    total.to_result()
}

/// A study that takes too long for a test.
struct SlowStudy {
    name: &'static str,
    package: &'static str,
    example: &'static str,
    /// The package whose program the study runs.
    program: Option<&'static str>,
    /// Build profile: `release`; `dev` to detect overflow, as in the tests; the shipped profile if times are reported.
    profile: &'static str,
}

const fn slow_study(name: &'static str, package: &'static str, example: &'static str) -> SlowStudy {
    SlowStudy {
        name,
        package,
        example,
        program: None,
        profile: "release",
    }
}

const SLOW_STUDIES: [SlowStudy; 19] = [
    slow_study("people-coverage", "hoid", "people_coverage"),
    SlowStudy {
        program: Some("hoid-cli"),
        ..slow_study("faults", "hoid", "faults")
    },
    slow_study("faults-clean", "hoid-evidence", "faults_clean"),
    slow_study("little-noise", "hoid-evidence", "little_noise"),
    slow_study("intersample-coverage", "hoid-evidence", "intersample_coverage"),
    slow_study("inputs-coverage", "hoid-evidence", "inputs_coverage"),
    slow_study("design-errors", "hoid-design", "design_errors"),
    slow_study("tracker-faults", "hoid", "tracker_faults"),
    SlowStudy {
        profile: "dev",
        ..slow_study("mutations", "hoid-io", "mutations")
    },
    slow_study("bombs", "hoid-io", "bombs"),
    slow_study("long-csv", "hoid-io", "long_csv"),
    slow_study("step-time", "hoid-core", "step_time"),
    SlowStudy {
        profile: "dev",
        ..slow_study("hostile", "hoid-lab", "hostile")
    },
    SlowStudy {
        program: Some("hoid-cli"),
        ..slow_study("kills", "hoid-cli", "kills")
    },
    SlowStudy {
        program: Some("hoid-cli"),
        ..slow_study("full-disks", "hoid-cli", "full_disks")
    },
    SlowStudy {
        program: Some("hoid-cli"),
        profile: SHIPPED_PROFILE,
        ..slow_study("latency", "hoid-cli", "latency")
    },
    slow_study("lab", "hoid-lab", "lab"),
    slow_study("challenge", "hoid-challenge", "challenge"),
    slow_study("challenge-people", "hoid-challenge", "challenge_people"),
];

/// Runs one of the slow studies with its arguments.
fn run_slow_study(arguments: &[String]) -> Result<(), String> {
    let names = || {
        let all = SLOW_STUDIES.iter().map(|slow| slow.name);
        all.chain(lab::STUDIES.map(|(name, _)| name))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let (name, rest) = arguments
        .split_first()
        .ok_or_else(|| format!("name a study, one of {}", names()))?;
    if let Some((_, script)) = lab::STUDIES.iter().find(|(study, _)| study == name) {
        return lab::study(script, rest);
    }
    let slow = (SLOW_STUDIES.iter())
        .find(|slow| slow.name == name)
        .ok_or_else(|| format!("no study is called {name}, expected one of {}", names()))?;
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
