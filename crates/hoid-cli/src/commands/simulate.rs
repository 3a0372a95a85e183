//! `hoid simulate`: one closed-loop run, written to a file.

use std::path::Path;

use hoid::io::{AnyScenario, write_record, write_record_csv};
use hoid::model::{FamilyScenario, Record, SampleTime, scenario::Scenario};
use hoid::numerics::statistics::root_mean_square;
use hoid::report::numbers;
use hoid::sim::{FamilySimulator, RunSeed, Simulator};

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
    let record = match chosen_scenario(&args.base)? {
        AnyScenario::Reference(scenario) => {
            Simulator::new(&with_changes(*scenario, args)?)?.run(run_seed, args.keep_run_in)?
        }
        AnyScenario::Family(scenario) => {
            FamilySimulator::new(&of_family(*scenario, args)?)?.run_with_truth(run_seed, args.keep_run_in)?
        }
    };
    let piped = args.out.as_os_str() == "-";
    if piped {
        write_out(&record)?;
        if output::pipe_closed() {
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
        numbers::plain(root_mean_square(record.input())),
        numbers::plain(root_mean_square(record.output())),
        if piped {
            "standard output".to_owned()
        } else {
            args.out.display().to_string()
        },
    );
    if piped {
        output::message(summary.trim_end());
    } else {
        output::show(&summary)?;
    }
    Ok(())
}

/// Writes the record to standard output.
fn write_out(record: &Record) -> Result<(), CliError> {
    let mut text = Vec::new();
    write_record_csv(&mut text, "standard output", record)?;
    output::print(&String::from_utf8_lossy(&text))?;
    Ok(())
}

fn with_changes(mut scenario: Scenario, args: &SimulateArgs) -> Result<Scenario, CliError> {
    if let Some(order) = args.remnant_order {
        scenario.remnant.order = order;
    }
    if let Some(time_constant) = args.remnant_time_constant {
        scenario.remnant.time_constant_s = time_constant;
    }
    if let Some(ts) = args.sample_time {
        scenario.sample_time = SampleTime::new(ts)?;
    }
    if let Some(realisation) = args.realisation {
        scenario.realisation = realisation;
    }
    let definition = args.noise_definition;
    let Some(strength) = scenario.remnant.strength.changed(args.noise_level, definition) else {
        return Err(CliError::Usage(
            "--noise-definition needs --noise-level: the scenario gives the gain K_n itself".to_owned(),
        ));
    };
    scenario.remnant.strength = strength;
    Ok(scenario)
}

/// Rejects remnant options, since the remnant of an operator of the family is defined in its file.
fn of_family(mut scenario: FamilyScenario, args: &SimulateArgs) -> Result<FamilyScenario, CliError> {
    let remnant = [
        ("--remnant-order", args.remnant_order.is_some()),
        ("--noise-level", args.noise_level.is_some()),
        ("--noise-definition", args.noise_definition.is_some()),
        ("--remnant-time-constant", args.remnant_time_constant.is_some()),
    ];
    if let Some((option, _)) = remnant.iter().find(|(_, given)| *given) {
        return Err(CliError::Usage(format!(
            "{option} is for the remnant of the thesis; in a scenario with a form, the tables [[remnant]] specify the \
             remnant"
        )));
    }
    if let Some(ts) = args.sample_time {
        scenario.sample_time = SampleTime::new(ts)?;
    }
    if let Some(realisation) = args.realisation {
        scenario.realisation = realisation;
    }
    Ok(scenario)
}
