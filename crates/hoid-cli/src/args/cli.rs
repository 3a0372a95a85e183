//! The program and its commands.

use clap::{Parser, Subcommand};

use super::{
    compare::CompareArgs,
    convert::{ConvertArgs, InfoArgs},
    describe::DescribeArgs,
    design::DesignArgs,
    fmu::FmuArgs,
    group::{GroupArgs, SimulateGroupArgs},
    identify::IdentifyArgs,
    lab::LabArgs,
    recursion::{StreamArgs, TrackArgs},
    shell::{CompletionsArgs, ManArgs},
    simulate::{DemoArgs, MarginsArgs, SimulateArgs},
    study::{ReproduceArgs, StudyCommand},
};

/// Human-operator identification: estimates how a person controls a machine.
///
/// Estimates gain, lead, delay, neuromuscular dynamics and remnant, with standard errors, from the tracking error e and
/// the control output u, and gives a verdict on the reliability of the result.
#[derive(Debug, Parser)]
#[command(name = "hoid", version, max_term_width = 110)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run the whole analysis on a simulated run, with reports
    ///
    /// Simulates a run in which the controlled element changes, then identifies and tracks the operator.
    Demo(DemoArgs),
    /// Simulate one closed-loop run
    Simulate(SimulateArgs),
    /// Estimate the operator's parameters from recordings
    ///
    /// Fits a model to one or more records and gives a verdict on the result.
    Identify(Box<IdentifyArgs>),
    /// Estimate gain and phase at the excited frequencies, without a model
    ///
    /// Computes the describing function, crossover, margins and remnant from records with a periodic excitation.
    Describe(Box<DescribeArgs>),
    /// Track the operator over a record, sample by sample
    ///
    /// Tracks a model and the operator's parameters, and detects changes.
    Track(Box<TrackArgs>),
    /// Track live: samples in, one JSON line per sample out
    ///
    /// Reads lines from standard input and writes to standard output.
    Stream(Box<StreamArgs>),
    /// Write a functional mock-up unit (FMI 2.0, 3.0)
    ///
    /// Writes the tracker, or with --operator a simulated person, as a unit for simulators. Needs the shared library
    /// built by `cargo xtask ffi`.
    Fmu(FmuArgs),
    /// Show channels, sampling and data-quality problems
    ///
    /// Shows columns, sampling, ranges, suspicious values, and a sketch of each column.
    Info(InfoArgs),
    /// Convert discrete coefficients to operator parameters and back
    ///
    /// Also discretises transfer functions.
    Convert(ConvertArgs),
    /// Compute crossover and margins of a scenario
    ///
    /// Computes crossover frequency, phase margin, gain margin and remnant gains.
    Margins(MarginsArgs),
    /// Run a tracking experiment in the browser
    ///
    /// Serves a tracking task as a page on this computer and prints its address. Identifies the operator during each
    /// run, and verifies every run bit for bit. Included in release binaries; other builds need --features lab.
    Lab(LabArgs),
    /// Analyse many recorded runs by subject and condition
    ///
    /// `hoid group init DIR` inspects the files and writes a manifest; `hoid group DIR --out OUT` fits
    /// each run, and each person in each condition, and writes tables and pages.
    Group(Box<GroupArgs>),
    /// Test differences between conditions or people
    ///
    /// Combines the results of `hoid group` across people and estimates differences, each with an interval, a test, an
    /// effect size and a summary sentence.
    Compare(CompareArgs),
    /// Design the most informative forcing function for a person
    ///
    /// Computes the frequencies, amplitudes and phases of a forcing function from approximate values for the person and
    /// the controlled element, and predicts the standard errors for a number of runs.
    Design(DesignArgs),
    /// Simulate a virtual experiment for `hoid group`
    ///
    /// Simulates subjects, conditions and runs, and also writes the true values.
    SimulateGroup(SimulateGroupArgs),
    /// Run Monte Carlo studies: run a plan, join shards, list plans
    #[command(subcommand)]
    Study(StudyCommand),
    /// Reproduce the thesis (Ortiz Moya 2023)
    ///
    /// Reproduces its tables, figures and claims, each from a named study.
    Reproduce(ReproduceArgs),
    /// Write shell completions (bash, zsh, fish, PowerShell, Elvish)
    ///
    /// Writes to standard output.
    Completions(CompletionsArgs),
    /// Write manual pages
    ///
    /// Writes one page for the program and one for each command.
    Man(ManArgs),
}

#[cfg(test)]
mod tests {
    #[test]
    fn command_definitions_are_consistent() {
        crate::args::command().debug_assert();
    }

    /// Returns the help pages as a page of the book.
    fn reference_page() -> String {
        let mut page = "# Command line\n\nThe help pages of the program, word for word.\n".to_owned();
        let mut cli = crate::args::command().term_width(110);
        cli.build();
        for command in cli.get_subcommands_mut().filter(|c| c.get_name() != "help") {
            let help = command.render_long_help().to_string();
            let trimmed: Vec<&str> = help.lines().map(str::trim_end).collect();
            page.push_str(&format!(
                "\n## hoid {}\n\n```text\n{}\n```\n",
                command.get_name(),
                trimmed.join("\n").trim_end()
            ));
        }
        page
    }

    #[test]
    fn documented_help_pages_are_current() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/reference/command-line.md");
        let page = reference_page();
        if std::env::var_os("HOID_UPDATE_DOCS").is_some() {
            std::fs::write(path, &page).unwrap();
        }
        let book = std::fs::read_to_string(path).unwrap();
        assert_eq!(
            book, page,
            "run HOID_UPDATE_DOCS=1 cargo test -p hoid-cli to renew the page"
        );
    }
}
