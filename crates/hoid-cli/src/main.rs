//! The command-line program `hoid`. Only this crate prints: results to standard output, everything else to standard
//! error.
//!
//! Exit codes: 0 for success; 1 if the data or the task give no result, or the result cannot be written; 2 for a usage
//! error; 128 plus the number of the signal after a signal. `args` defines the arguments, `commands` contains one file
//! per command; `json` and `text` are the two formats of a result.

mod args;
mod commands;
mod error;
mod family_operator;
mod interrupt;
mod json;
mod orders;
mod output;
mod recursion;
#[cfg(test)]
mod reference;
mod table;
mod text;

use std::process::ExitCode;

use clap::FromArgMatches;

use crate::{
    args::{Cli, Command},
    error::CliError,
};

fn main() -> ExitCode {
    interrupt::catch();
    let mut command = args::command();
    let parsed = command
        .try_get_matches_from_mut(std::env::args_os())
        .and_then(|matches| Cli::from_arg_matches(&matches).map_err(|error| error.format(&mut command)));
    let cli = match parsed {
        Ok(cli) => cli,
        // Help and version texts are printed like results.
        Err(error) if !error.use_stderr() => return exit(output::check_written(error.print())),
        Err(wrong) => wrong.exit(),
    };
    let outcome = match cli.command {
        Command::Demo(args) => commands::demo::run(&args),
        Command::Simulate(args) => commands::simulate::run(&args),
        Command::Identify(args) => commands::identify::run(&args),
        Command::Describe(args) => commands::describe::run(&args),
        Command::Track(args) => commands::track::run(&args),
        Command::Stream(args) => commands::stream::run(&args),
        Command::Fmu(args) => commands::fmu::run(&args),
        Command::Lab(args) => commands::lab::run(&args),
        Command::Info(args) => commands::info::run(&args),
        Command::Convert(args) => commands::convert::run(&args),
        Command::Margins(args) => commands::margins::run(&args),
        Command::Group(args) => commands::group::run(&args),
        Command::Compare(args) => commands::compare::run(&args),
        Command::Design(args) => commands::design::run(&args),
        Command::SimulateGroup(args) => commands::group::simulate(&args),
        Command::Reproduce(args) => commands::reproduce::run(&args),
        Command::Study(command) => commands::study::run_command(&command),
        Command::Completions(args) => commands::shell::completions(&args),
        Command::Man(args) => commands::shell::man(&args),
    };
    exit(outcome)
}

fn exit(outcome: Result<(), CliError>) -> ExitCode {
    output::print_notices();
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::print_message(&format!("error: {error}"));
            ExitCode::from(error.exit_code())
        }
    }
}
