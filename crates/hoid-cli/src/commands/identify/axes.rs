//! `hoid identify --pair`: an operator for each axis, and the coupling between them.

use hoid::analysis::{Axis, AxisPair, Identification, Recordings, ResolvedRequest, axes, axes_json, check_axes};
use serde_json::Value;

use super::{family_form::FamilyReport, request};
use crate::{args::IdentifyArgs, commands::reading, error::CliError, json, output, text};

pub fn run(args: &IdentifyArgs) -> Result<(), CliError> {
    let ResolvedRequest::Operator(identification) = request::resolve_request(args)? else {
        return Err(CliError::Usage(
            "--pair applies only to the structure operator, without --noise remnant or --change sigmoid".to_owned(),
        ));
    };
    let others = [
        (args.picture.figure.is_some(), "--figure"),
        (args.report.is_some(), "--report"),
        (args.validate.is_some(), "--validate"),
        (args.show.table.is_some(), "--table"),
    ];
    if let Some((_, option)) = others.into_iter().find(|(given, _)| *given) {
        return Err(CliError::Usage(format!(
            "{option} requires a single axis; replace --pair with --input and --output"
        )));
    }
    check_axes(&identification, &args.pair).map_err(CliError::from_options)?;
    let read = args.pair.iter().map(|pair| Ok((pair.clone(), recordings(args, pair)?)));
    let read = read.collect::<Result<Vec<_>, CliError>>()?;
    let found = output::run_with_spinner("fitting", || axes(&identification, read))?;
    if args.show.json {
        json::print(&Value::Object(axes_json(&found)?))?;
    } else {
        output::show(&page(args, &identification, &found)?)?;
    }
    let verdicts: Vec<_> = found
        .iter()
        .map(|axis| CliError::check_verdict(&axis.identified.verdict))
        .collect();
    // The command succeeds if the data determine the operator of at least one axis.
    if verdicts.iter().all(Result::is_err) {
        return verdicts.into_iter().next().unwrap_or(Ok(()));
    }
    Ok(())
}

/// Reads the recordings with the signals of one axis.
fn recordings(args: &IdentifyArgs, pair: &AxisPair) -> Result<Recordings, CliError> {
    let mut read = args.read.clone();
    read.inputs = vec![pair.input.clone()];
    read.output.clone_from(&pair.output);
    Ok(reading::of(&read, Some(&args.mask), true)?.read_files(&args.records, reading::report_problems)?)
}

fn page(args: &IdentifyArgs, identification: &Identification, all: &[Axis]) -> Result<String, CliError> {
    let mut page = String::new();
    for axis in all {
        let identified = &axis.identified;
        let report = FamilyReport {
            identified,
            fit: &identified.fit,
            files: &identified.data.names,
            records: &identified.data.records,
            accounts: &identified.data.accounts,
            element: identification.controlled_element.as_ref(),
            validation: None,
            settings: &identified.settings,
        };
        let name = format!("Axis {}, {}", axis.pair.input, axis.pair.output);
        page.push_str(&format!(
            "{name}\n{}\n{}\n",
            "=".repeat(name.len()),
            report.page(args.show.verbose)?
        ));
    }
    let mut rows = text::table(&["coupling", "p", ""]);
    for axis in all {
        for coupling in &axis.couplings {
            let (chance, result) = match &coupling.p_value {
                Err(why) => (String::new(), format!("not tested: {why}")),
                Ok(p) if coupling.responds => (format!("{p:.1e}"), "a response".to_owned()),
                Ok(p) => (format!("{p:.2}"), "no response found".to_owned()),
            };
            rows.add_row([format!("{} to {}", coupling.input, axis.pair.output), chance, result]);
        }
    }
    page.push_str(&format!("Coupling between the axes\n{rows}\n"));
    Ok(page)
}
