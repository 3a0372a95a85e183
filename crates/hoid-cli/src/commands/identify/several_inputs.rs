//! `hoid identify` for polynomial models with several inputs.

use hoid::analysis::{Recordings, SeveralInputsResult, parse_roles, several_inputs};
use hoid::model::Structure;
use serde_json::Value;

use super::request;
use crate::{
    args::IdentifyArgs,
    commands::{paper_table, reading},
    error::CliError,
    json, output, text,
};

/// Options that apply to models with several inputs.
const SUPPORTED_OPTIONS: [&str; 3] = ["orders", "nk", "role"];

/// Returns the structure if a polynomial model with several inputs is requested.
pub fn structure(args: &IdentifyArgs) -> Option<Structure> {
    let name = args.structure.as_deref()?.trim().to_ascii_lowercase();
    (args.read.inputs.len() > 1).then(|| name.parse().ok()).flatten()
}

pub fn run(args: &IdentifyArgs, structure: Structure) -> Result<(), CliError> {
    if let Some((name, _)) = args
        .options
        .given_settings()
        .find(|(name, _)| !SUPPORTED_OPTIONS.contains(name))
    {
        return Err(CliError::Usage(format!(
            "--{} does not apply to polynomials with several inputs; drop it, and use only --orders, --nk and --role",
            name.replace('_', "-")
        )));
    }
    let others = [
        (args.picture.figure.is_some(), "--figure"),
        (args.report.is_some(), "--report"),
        (args.validate.is_some(), "--validate"),
        (args.horizon.is_some(), "--horizon"),
        (args.trace.is_some(), "--trace"),
    ];
    if let Some((_, option)) = others.into_iter().find(|(given, _)| *given) {
        return Err(CliError::Usage(format!(
            "{option} applies only to models with one input"
        )));
    }
    let text = |name: &str| args.options.text(name);
    let model = several_inputs(
        structure,
        text("orders").unwrap_or_default(),
        text("nk"),
        &args.read.inputs,
    )
    .map_err(CliError::from_options)?;
    let typed = request::options(args)?;
    let of_further = typed.get(request::ROLE_OPTION).map_or("", String::as_str);
    let roles = parse_roles(&args.read.inputs[1..], of_further).map_err(CliError::from_options)?;
    paper_table::check(&args.show)?;
    let first = args.read.with_one_input();
    let read: Recordings =
        reading::of(&first, Some(&args.mask), true)?.read_files(&args.records, reading::report_problems)?;
    let rate = args.read.prepare.rate.decimate;
    let found = output::run_with_spinner("fitting", || {
        SeveralInputsResult::of(&model, roles, read, args.faults.faults, rate)
    })?;
    paper_table::write(&args.show, || Ok(found.json()))?;
    if args.show.json {
        json::print(&Value::Object(found.json()))?;
    } else {
        output::show(&page(&found))?;
    }
    CliError::check_verdict(&found.verdict)
}

fn page(found: &SeveralInputsResult) -> String {
    let fit = &found.fit;
    let mut page = text::verdict(&found.verdict);
    let inputs: Vec<&str> = fit.model.inputs.iter().map(|(name, _)| name.as_str()).collect();
    page.push_str(&format!(
        "{} with the inputs {}\n",
        fit.model.structure.label(),
        inputs.join(", ")
    ));
    let rows = fit.parameters().into_iter().map(|(name, e)| (name, String::new(), e));
    let rows: Vec<_> = rows.collect();
    let table = text::estimates(
        "coefficient",
        rows.iter().map(|(name, unit, e)| (name.as_str(), unit.clone(), *e)),
    );
    page.push_str(&format!("{table}\n"));
    page.push_str(&format!(
        "Fit: VAF of the prediction {:.2} %, loss {}, {} residuals. Search: {}.\n",
        fit.vaf_prediction,
        hoid::report::numbers::format_plain(fit.loss),
        fit.residuals,
        fit.termination
    ));
    let data = &found.data;
    page.push_str(&text::records(&data.names, &data.records, &data.accounts, false));
    page
}
