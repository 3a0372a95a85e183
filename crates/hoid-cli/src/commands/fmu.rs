//! `hoid fmu`: writes a unit for simulators (FMU) that contains the installed library.

use std::{
    env,
    path::{Path, PathBuf},
};

use hoid::io::{
    AnyScenario, IoError,
    fmu::{FmiVersion, FmuKind, FmuSettings, FmuStart, Library, write_fmu},
    is_fit_file, parse_any_scenario, parse_fit, read_settings,
};
use hoid::model::SampleTime;
use hoid::sim::{FamilyOperatorRun, FamilySimulator, RunSeed, Simulator};

use super::output_paths;
use crate::{
    args::{FmuArgs, OperatorChoice},
    error::CliError,
    output,
    recursion::parse_method,
};

pub fn run(args: &FmuArgs) -> Result<(), CliError> {
    let libraries = match args.libraries.as_slice() {
        [] => vec![library_path()?],
        named => named.to_vec(),
    };
    let (settings, read, step_s) = match &args.operator {
        Some(operator) => operator_unit(operator, args.seed)?,
        None => tracker_unit(args)?,
    };
    let inputs: Vec<&Path> = libraries.iter().chain(&read).map(PathBuf::as_path).collect();
    output_paths::check(&inputs, &[Some(&args.out)], &[])?;
    let loaded: Vec<Library> = (libraries.iter())
        .map(|path| Library::read(path))
        .collect::<Result<_, IoError>>()?;
    write_fmu(&args.out, args.fmi, &settings, &loaded, step_s)?;
    let what = match args.operator {
        Some(_) => "an operator: e in, u out",
        None => "a tracker: e and u in, estimates out",
    };
    let version = match args.fmi {
        FmiVersion::Two => "2.0",
        FmiVersion::Three => "3.0",
    };
    output::print(&format!(
        "{what}; FMI {version} for co-simulation, sample time {step_s} s.\nWritten to {}.\n",
        args.out.display()
    ))?;
    Ok(())
}

/// Settings of a unit, the files read for it, and its sample time in s.
type FmuUnit = (FmuSettings, Vec<PathBuf>, f64);

fn tracker_unit(args: &FmuArgs) -> Result<FmuUnit, CliError> {
    let step = SampleTime::new(args.sample_time)?;
    let mut method = parse_method(&args.method)?;
    let mut settings = FmuSettings::new(FmuKind::Tracker)
        .with("sample_time", FmuStart::Real(step.s()))
        .with("method", FmuStart::Text(method.name().to_owned()));
    let mut read = Vec::new();
    let wrong = |prior: &str, error: &dyn std::fmt::Display| CliError::Usage(format!("--prior {prior}: {error}"));
    match &args.prior {
        None => {}
        Some(file) if is_fit_file(file) => {
            let text = read_settings(Path::new(file))?;
            // An error that would prevent the unit from starting in a simulator is reported here.
            let fit = parse_fit(&text, file)?.operator()?;
            method.start_from(fit).map_err(|error| wrong(file, &error))?;
            settings = (settings.with_fit(text)).with("prior", FmuStart::Text("fit".to_owned()));
            read.push(PathBuf::from(file));
        }
        Some(prior) => {
            hoid::survey::set(&mut method, "prior", prior).map_err(|error| wrong(prior, &error))?;
            settings = settings.with("prior", FmuStart::Text(prior.clone()));
        }
    }
    if let Some(element) = &args.controlled_element {
        settings = settings.with("controlled_element", FmuStart::Text(element.to_string()));
    }
    Ok((settings, read, step.s()))
}

fn operator_unit(operator: &OperatorChoice, seed: i32) -> Result<FmuUnit, CliError> {
    let (text, source, read) = match operator {
        OperatorChoice::Condition(condition) => (
            format!("condition = \"{}\"\n", condition.name()),
            condition.name().to_owned(),
            Vec::new(),
        ),
        OperatorChoice::File(file) => (read_settings(file)?, file.display().to_string(), vec![file.clone()]),
    };
    // An error that would prevent the unit from starting in a simulator is reported here.
    let scenario = parse_any_scenario(&text, &source, &source)?;
    let seen = match &scenario {
        AnyScenario::Reference(scenario) => scenario.feedforward.is_some(),
        AnyScenario::Family(scenario) => scenario.feedforward.is_some() || scenario.motion.is_some(),
    };
    if seen {
        return Err(CliError::Usage(format!(
            "{source} has [feedforward] or [motion], but the only input of the unit is the error; remove this table, \
             or add the response outside the unit"
        )));
    }
    let step_s = match scenario {
        AnyScenario::Reference(scenario) => {
            Simulator::new(&scenario)?;
            scenario.sample_time.s()
        }
        AnyScenario::Family(scenario) => {
            FamilyOperatorRun::new(FamilySimulator::new(&scenario)?, RunSeed::default(), 0.0)?;
            scenario.sample_time.s()
        }
    };
    let settings = FmuSettings::new(FmuKind::Operator)
        .with_scenario(text)
        .with("seed", FmuStart::Integer(seed));
    Ok((settings, read, step_s))
}

/// Returns the path of the library in the directory of this program, under its installed or its build name.
fn library_path() -> Result<PathBuf, CliError> {
    let program = env::current_exe().unwrap_or_default();
    let folder = program.parent().unwrap_or(Path::new("."));
    let (prefix, suffix) = (env::consts::DLL_PREFIX, env::consts::DLL_SUFFIX);
    let places = ["hoid", "hoid_ffi"].map(|name| folder.join(format!("{prefix}{name}{suffix}")));
    let found = places.iter().find(|location| location.is_file()).cloned();
    found.ok_or_else(|| {
        CliError::Usage(format!(
            "there is no {prefix}hoid{suffix} in {}; build it with cargo xtask ffi, and name it with --library",
            folder.display()
        ))
    })
}
