//! `hoid simulate`: one closed-loop run, written to a file.

use std::path::Path;

use hoid::io::{AnyScenario, ScenarioChangeError, ScenarioChanges, write_record, write_record_csv};
use hoid::model::Record;
use hoid::numerics::statistics::root_mean_square;
use hoid::report::numbers;
use hoid::sim::{FamilySimulator, RunSeed, SimError, Simulator};

use super::{output_paths, scenario::chosen_scenario};
use crate::{args::SimulateArgs, error::CliError, output};

pub fn run(args: &SimulateArgs) -> Result<(), CliError> {
    let inputs: Vec<&Path> = args.base.scenario.as_deref().into_iter().collect();
    output_paths::check(&inputs, &[Some(&args.out)], &[])?;
    let run_seed = RunSeed {
        seed: args.seed,
        cell: args.cell,
        replication: args.replication,
    };
    let base = chosen_scenario(&args.base)?;
    let scenario = changes(args)
        .apply(base.clone())
        .map_err(|error| change_error(&error))?;
    let found = run_of(&scenario, run_seed, args.keep_run_in);
    // A scenario that can be simulated only without the options has an option with a value out of range.
    let record = found.map_err(|error| match run_of(&base, run_seed, false) {
        Ok(_) if scenario != base => CliError::Usage(error.to_string()),
        _ => CliError::Sim(error),
    })?;
    let piped = args.out.as_os_str() == "-";
    if piped {
        print_record(&record)?;
        if output::is_pipe_closed() {
            return Ok(());
        }
    } else {
        write_record(&args.out, &record)?;
    }
    let summary = format!(
        "{}: {} samples of {} s, seed {}, replication {}; rms e {} deg, rms u {} deg.\nWritten to {}.\n",
        record.label(),
        record.len(),
        record.sample_time().s(),
        args.seed,
        args.replication,
        numbers::format_plain(root_mean_square(record.input())),
        numbers::format_plain(root_mean_square(record.output())),
        if piped {
            "standard output".to_owned()
        } else {
            args.out.display().to_string()
        },
    );
    if piped {
        output::print_message(summary.trim_end());
    } else {
        output::show(&summary)?;
    }
    Ok(())
}

fn run_of(scenario: &AnyScenario, run_seed: RunSeed, keep_run_in: bool) -> Result<Record, SimError> {
    match scenario {
        AnyScenario::Reference(scenario) => Simulator::new(scenario)?.run(run_seed, keep_run_in),
        AnyScenario::Family(scenario) => FamilySimulator::new(scenario)?.run_with_truth(run_seed, keep_run_in),
    }
}

/// Writes the record to standard output.
fn print_record(record: &Record) -> Result<(), CliError> {
    let mut text = Vec::new();
    write_record_csv(&mut text, "standard output", record)?;
    output::print(&String::from_utf8_lossy(&text))?;
    Ok(())
}

fn changes(args: &SimulateArgs) -> ScenarioChanges {
    ScenarioChanges {
        remnant_order: args.remnant_order,
        noise_level: args.noise_level,
        noise_definition: args.noise_definition,
        remnant_time_constant: args.remnant_time_constant,
        sample_time: args.sample_time,
        realisation: args.realisation,
        feedforward: args.feedforward.clone(),
        disturbance: args.disturbance,
    }
}

/// Converts the error; the message contains the option as typed on the command line.
fn change_error(error: &ScenarioChangeError) -> CliError {
    CliError::Usage(format!("--{} {}", error.option.replace('_', "-"), error.reason))
}
