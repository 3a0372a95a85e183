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

/// Human-operator identification: finds out how a person controls a machine.
///
/// From the tracking error e and the control output u: gain, lead, delay, neuromuscular dynamics and
/// remnant, with standard errors and a verdict on what they are worth.
#[derive(Debug, Parser)]
#[command(name = "hoid", version, max_term_width = 110)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// The whole path on a simulated run, with a report
    ///
    /// Simulates a run in which the controlled element changes, identifies, tracks, and writes reports.
    Demo(DemoArgs),
    /// Simulate one closed-loop run into a file
    Simulate(SimulateArgs),
    /// Gain, lead, delay ... of the person, from whole records
    ///
    /// Fits a model to one or several records, and reports the verdict on the result.
    Identify(Box<IdentifyArgs>),
    /// Gain and phase at the lines of the excitation, without a model
    ///
    /// How a person responds at the lines of a periodic excitation: describing function, crossover,
    /// margins, remnant.
    Describe(Box<DescribeArgs>),
    /// The person over a record, sample by sample
    ///
    /// Tracks a model and the operator's parameters over a record, and finds changes.
    Track(Box<TrackArgs>),
    /// The same live: samples in, one JSON line a sample out
    ///
    /// Reads samples as lines on standard input and writes one JSON line a sample on standard output.
    Stream(Box<StreamArgs>),
    /// A unit for simulators (FMI 2.0, 3.0)
    ///
    /// Writes a functional mock-up unit: the tracker, or with --operator a simulated person. It takes the
    /// shared library that `cargo xtask ffi` builds.
    Fmu(FmuArgs),
    /// What is inside of a file, and the problems of it
    ///
    /// Shows columns, sampling, ranges, what is suspicious, and a sketch of each column.
    Info(InfoArgs),
    /// Coefficients to operator parameters and back
    ///
    /// Takes discrete coefficients to operator parameters or back, or discretises a transfer function.
    Convert(ConvertArgs),
    /// Crossover and margins of a scenario
    ///
    /// Crossover frequency, phase and gain margin of a scenario, and its remnant gains.
    Margins(MarginsArgs),
    /// A tracking experiment in the browser
    ///
    /// Serves a page on this computer in which a person tracks, identifies them while they do, and
    /// checks every run to the last bit. Prints the address of the page. Part of release binaries;
    /// others are built with --features lab.
    Lab(LabArgs),
    /// Many recorded runs by subject and condition
    ///
    /// `hoid group init DIR` looks at the files and writes a manifest; `hoid group DIR --out OUT` fits
    /// each run, and each person in each condition, and writes tables and pages.
    Group(GroupArgs),
    /// Whether conditions differ, and people
    ///
    /// Differences between the conditions or people of a group, with intervals, tests, effect sizes and a sentence each: what
    /// `hoid group` found of each person, over people.
    Compare(CompareArgs),
    /// The forcing function that is most informative about a person
    ///
    /// Lines, amplitudes and phases of a forcing function, and the standard errors to be expected of so many runs, for a person
    /// and a controlled element that are about known.
    Design(DesignArgs),
    /// A virtual experiment for `hoid group`
    ///
    /// Simulates subjects, conditions and runs, with the truth next to them.
    SimulateGroup(SimulateGroupArgs),
    /// Monte Carlo studies: run a plan, join shards, list plans
    #[command(subcommand)]
    Study(StudyCommand),
    /// The thesis: tables, figures, claims
    ///
    /// The tables, figures and claims of the thesis, each from a named study.
    Reproduce(ReproduceArgs),
    /// Completions for bash, zsh, fish, PowerShell, Elvish
    ///
    /// Writes the completions of a shell to standard output.
    Completions(CompletionsArgs),
    /// Manual pages
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
