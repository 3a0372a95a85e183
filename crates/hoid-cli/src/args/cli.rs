//! The program and its commands.

use clap::{Parser, Subcommand};

use super::{
    convert::{ConvertArgs, InfoArgs},
    describe::DescribeArgs,
    group::{GroupArgs, SimulateGroupArgs},
    identify::IdentifyArgs,
    recursion::{StreamArgs, TrackArgs},
    simulate::{DemoArgs, MarginsArgs, SimulateArgs},
    study::{ReproduceArgs, StudyCommand},
};

/// Human-operator identification: finds out how a person controls a machine.
///
/// From the tracking error e and the control output u it identifies gain, lead, delay and
/// neuromuscular dynamics, with ARX and Box-Jenkins models and standard errors.
#[derive(Debug, Parser)]
#[command(name = "hoid", version, max_term_width = 110)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// The whole path on a simulated run: simulate, identify, write a report
    Demo(DemoArgs),
    /// Simulate one closed-loop run and write it as CSV, Parquet, NPZ or .mat
    Simulate(SimulateArgs),
    /// Identify a model and the operator's parameters from one or several records
    Identify(Box<IdentifyArgs>),
    /// How a person responds at the lines of a periodic excitation, without a model: describing
    /// function, crossover, margins, remnant
    Describe(Box<DescribeArgs>),
    /// Track a model and the operator's parameters over a record, sample by sample
    Track(Box<TrackArgs>),
    /// Track live: samples as lines on standard input, one JSON line a sample on standard output
    Stream(Box<StreamArgs>),
    /// Show what is inside of a file: columns, sampling, ranges, what is suspicious, and a sketch
    /// of each
    Info(InfoArgs),
    /// Take discrete coefficients to operator parameters or back, or discretise a transfer function
    Convert(ConvertArgs),
    /// Crossover frequency, phase and gain margin of a scenario, and its remnant gains
    Margins(MarginsArgs),
    /// Analyse many recorded runs by subject and condition
    Group(GroupArgs),
    /// Simulate a virtual experiment for `hoid group`: subjects, conditions and runs, with the
    /// truth beside them
    SimulateGroup(SimulateGroupArgs),
    /// Monte Carlo studies: run a plan, join shards, list plans
    #[command(subcommand)]
    Study(StudyCommand),
    /// The tables, figures and claims of the reference text, each from a named study
    Reproduce(ReproduceArgs),
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_definitions_do_not_contradict_each_other() {
        Cli::command().debug_assert();
    }

    /// The help pages as a page of the book.
    fn reference_page() -> String {
        let mut page = "# Command line\n\nThe help pages of the program, word for word.\n".to_owned();
        let mut cli = Cli::command().term_width(110);
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
