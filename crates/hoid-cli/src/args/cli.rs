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
/// From the tracking error e and the control output u: gain, lead, delay, neuromuscular dynamics and
/// remnant, with standard errors and a verdict on their reliability.
#[derive(Debug, Parser)]
#[command(name = "hoid", version, max_term_width = 110)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run the whole analysis on a simulated run, with a report
    ///
    /// Simulates a run in which the controlled element changes, identifies the operator, tracks it, and writes reports.
    Demo(DemoArgs),
    /// Simulate one closed-loop run into a file
    Simulate(SimulateArgs),
    /// Estimate the operator's parameters from recordings
    ///
    /// Fits a model to one or several records and gives a verdict on the result.
    Identify(Box<IdentifyArgs>),
    /// Estimate gain and phase at the excited frequencies, without a model
    ///
    /// Computes the response of a person at the frequencies of a periodic excitation: describing function,
    /// crossover, margins and remnant.
    Describe(Box<DescribeArgs>),
    /// Track the operator over a record, sample by sample
    ///
    /// Tracks a model and the operator's parameters over a record and detects changes.
    Track(Box<TrackArgs>),
    /// Track live: samples in, one JSON line per sample out
    ///
    /// Reads samples as lines from standard input and writes one JSON line per sample to standard output.
    Stream(Box<StreamArgs>),
    /// Write a unit for simulators (FMI 2.0, 3.0)
    ///
    /// Writes a functional mock-up unit: the tracker, or with --operator a simulated person. It takes the
    /// shared library that `cargo xtask ffi` builds.
    Fmu(FmuArgs),
    /// Show channels, sampling and data-quality problems
    ///
    /// Shows columns, sampling, ranges, suspicious values, and a sketch of each column.
    Info(InfoArgs),
    /// Convert coefficients to operator parameters and back
    ///
    /// Converts discrete coefficients to operator parameters or back, or discretises a transfer function.
    Convert(ConvertArgs),
    /// Compute crossover and margins of a scenario
    ///
    /// Computes crossover frequency, phase margin, gain margin and remnant gains of a scenario.
    Margins(MarginsArgs),
    /// Run a tracking experiment in the browser
    ///
    /// Serves a page on this computer in which a person tracks, identifies the operator during the run, and
    /// verifies every run to the last bit. Prints the address of the page. Release binaries contain it; other
    /// builds need --features lab.
    Lab(LabArgs),
    /// Analyse many recorded runs by subject and condition
    ///
    /// `hoid group init DIR` inspects the files and writes a manifest; `hoid group DIR --out OUT` fits
    /// each run, and each person in each condition, and writes tables and pages.
    Group(Box<GroupArgs>),
    /// Test differences between conditions or people
    ///
    /// Estimates the differences between the conditions or people of a group, with intervals, tests, effect sizes and a
    /// sentence each. It combines the results of `hoid group` over people.
    Compare(CompareArgs),
    /// Design the forcing function that is most informative about a person
    ///
    /// Computes frequencies, amplitudes and phases of a forcing function, and the expected standard errors for a number of
    /// runs, from approximate values of the person and the controlled element.
    Design(DesignArgs),
    /// Simulate a virtual experiment for `hoid group`
    ///
    /// Simulates subjects, conditions and runs, and writes the true values next to them.
    SimulateGroup(SimulateGroupArgs),
    /// Run Monte Carlo studies: run a plan, join shards, list plans
    #[command(subcommand)]
    Study(StudyCommand),
    /// Reproduce the thesis (Ortiz Moya 2023)
    ///
    /// Computes the tables, figures and claims of the thesis, each from a named study.
    Reproduce(ReproduceArgs),
    /// Write completions for bash, zsh, fish, PowerShell, Elvish
    ///
    /// Writes the completions of a shell to standard output.
    Completions(CompletionsArgs),
    /// Write manual pages
    ///
    /// Writes a manual page for the program and one for each command.
    Man(ManArgs),
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_definitions_do_not_contradict_each_other() {
        crate::args::command().debug_assert();
    }

    /// The help pages as a page of the book.
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
    fn the_book_has_the_help_pages() {
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
