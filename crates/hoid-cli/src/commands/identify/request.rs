//! Converts the options of `hoid identify` to a request to the library.

use std::collections::BTreeMap;

use hoid::analysis::{Request, ResolvedRequest};

use crate::{args::IdentifyArgs, error::CliError, output};

/// Name of the option that gives the roles of inputs other than the error; `FEEDBACK_ROLE` is the role of the error.
pub const ROLE_OPTION: &str = "role";
const FEEDBACK_ROLE: &str = "feedback";

/// Returns the request after checking that the options are consistent.
///
/// # Errors
/// [`CliError::Usage`] if options are invalid or contradict each other.
pub fn resolve_request(args: &IdentifyArgs) -> Result<ResolvedRequest, CliError> {
    let request = Request {
        structure: args.structure.clone(),
        method: Some(args.method.clone()),
        options: options(args)?,
        faults: args.faults.faults,
        rate: args.read.prepare.rate.decimate,
    };
    let (asked, notes) = request.resolve().map_err(CliError::from_options)?;
    for note in notes {
        output::add_notice("", format!("note: {note}"));
    }
    match misplaced_option(args, &asked) {
        Some((option, with)) => Err(CliError::Usage(format!("{option} applies only to {with}"))),
        None => Ok(asked),
    }
}

/// Returns the options by name. Each input other than the first has a role.
///
/// # Errors
/// [`CliError::Usage`] if an input other than the first has the role of the feedback.
pub fn options(args: &IdentifyArgs) -> Result<BTreeMap<String, String>, CliError> {
    let given = args.options.given_settings();
    let mut all: BTreeMap<String, String> = given.map(|(name, text)| (name.to_owned(), text.to_owned())).collect();
    let [first, further @ ..] = args.read.inputs.as_slice() else {
        return Ok(all);
    };
    let typed = all.remove(ROLE_OPTION).unwrap_or_default();
    let mut roles: Vec<String> = Vec::new();
    for role in typed.split(',').map(str::trim).filter(|role| !role.is_empty()) {
        match role.split_once('=') {
            Some((name, FEEDBACK_ROLE)) if name == first => {}
            Some((name, FEEDBACK_ROLE)) => {
                return Err(CliError::Usage(format!(
                    "--role {name}={FEEDBACK_ROLE}: the first --input is the feedback, but it is {first}; give {name} first"
                )));
            }
            _ => roles.push(role.to_owned()),
        }
    }
    let named = |role: &String, input: &String| role.split(['=', '/']).next() == Some(input.as_str());
    for input in further {
        if !roles.iter().any(|role| named(role, input)) {
            roles.push(input.clone());
        }
    }
    if !roles.is_empty() {
        all.insert(ROLE_OPTION.to_owned(), roles.join(","));
    }
    Ok(all)
}

/// Returns the first option of reading or writing that does not apply to the request, and the analysis to which that
/// option does apply; `None` if all options apply.
fn misplaced_option(args: &IdentifyArgs, asked: &ResolvedRequest) -> Option<(&'static str, &'static str)> {
    let changing = matches!(asked, ResolvedRequest::Change(_));
    let with_polynomials = matches!(asked, ResolvedRequest::Polynomials(_) | ResolvedRequest::Remnant(_));
    let steady = "a model that does not change";
    let all = [
        (
            args.picture.figure.is_some() && (changing || !asked.has_input()),
            "--figure",
            "a model that has an input and does not change",
        ),
        (args.trace.is_some() && !changing, "--trace", "--change sigmoid"),
        (args.validate.is_some() && changing, "--validate", steady),
        (
            args.horizon.is_some() && !with_polynomials,
            "--horizon",
            "models with polynomials, such as --structure bj, and to --remnant-order",
        ),
        (
            args.report.is_some() && changing,
            "--report",
            "a model that does not change; --trace writes the gains",
        ),
    ];
    let found = all.into_iter().find(|(wrong, ..)| *wrong);
    found.map(|(_, option, with)| (option, with))
}
